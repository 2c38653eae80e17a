// Node sets, side sets and groups of elements of a mesh (shm/sets.h) on their way from one format
// to another.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

std::string label_of(const MeshSet& set);       // "side set 3 'inlet'"
std::string short_name_of(const MeshSet& set);  // its name, or "side_set_3"
// Whether there can be one distribution factor for each member, or each node of each side.
bool has_usual_factors(const MeshSet& set);

// How the sets reach a writer: extras_of_sets() of shm/sets.h, whose errors are thrown.
std::vector<Extra> set_extras(const std::vector<MeshSet>& sets);
// Those that make sense; `used` gets the keys of their extras.
std::vector<MeshSet> sets_of_extras(const MeshInfo& info, std::set<std::string>& used);
std::vector<MeshSet> sets_of_extras(const MeshInfo& info);
// All that stands in the folder of a set, known or not, so that others can have its number.
void erase_set_folders(std::vector<Extra>& extras);

// Sets of whole blocks become lists of cells. Walks the cells when there are such sets.
void list_members(MeshSource& mesh, std::vector<MeshSet>& sets);

}  // namespace shm::converters
