// Conversion of node sets, side sets and element groups (shm/sets.h) between formats.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

std::string label_of(const MeshSet& set);  // e.g. "side set 3 'inlet'"

// Returns the set's name, or e.g. "side_set_3" if it has no name.
std::string short_name_of(const MeshSet& set);
// Returns true if there is one distribution factor per member, or one per node of each side.
bool has_usual_factors(const MeshSet& set);

// Returns the sets as extras for a writer. Uses extras_of_sets() of shm/sets.h and throws its
// errors.
std::vector<Extra> set_extras(const std::vector<MeshSet>& sets);
// Returns the valid sets. `used` receives the keys of their extras.
std::vector<MeshSet> sets_of_extras(const MeshInfo& info, std::set<std::string>& used);
std::vector<MeshSet> sets_of_extras(const MeshInfo& info);
// Removes all extras in the folders of sets, known or unknown, so that other sets can use the same
// numbers.
void erase_set_folders(std::vector<Extra>& extras);

// Converts sets of whole blocks to lists of cells. Reads all cells if there are such sets.
void list_members(MeshSource& mesh, std::vector<MeshSet>& sets);

}  // namespace shm::converters
