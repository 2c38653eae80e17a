// Conversion of node sets, side sets and element groups (shm/sets.h) between formats.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

std::string label_of(const MeshSet& set);  // returns e.g. "side set 3 'inlet'"

// Returns the set's name, or e.g. "side_set_3" if it has no name.
std::string short_name_of(const MeshSet& set);
// Returns true if the number of distribution factors is usual: one per member, or, in a side set,
// one per node of each side.
bool has_usual_factors(const MeshSet& set);

// Returns the sets in the form of extras for a writer. Calls extras_of_sets() of shm/sets.h and
// throws Failure with the error that it returns.
std::vector<Extra> set_extras(const std::vector<MeshSet>& sets);
// Returns the valid sets in the extras of a mesh, and adds the keys of their extras to `used`.
std::vector<MeshSet> sets_of_extras(const MeshInfo& info, std::set<std::string>& used);
std::vector<MeshSet> sets_of_extras(const MeshInfo& info);
// Removes all extras that belong to folders of sets, including sets of unknown kinds, so that new
// sets can use the same numbers.
void erase_set_folders(std::vector<Extra>& extras);

// Converts sets of whole blocks to lists of cells. Reads all cells of the mesh if there are such
// sets.
void list_members(MeshSource& mesh, std::vector<MeshSet>& sets);

}  // namespace shm::converters
