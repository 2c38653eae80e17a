// Functions that convert node sets, side sets and element groups (shm/sets.h) between formats.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

// Returns the location of arrays on sets of this kind.
Location location_of(MeshSet::Kind kind);

std::string label_of(const MeshSet& set);  // returns e.g. "side set 3 'inlet'"

// Returns the set's name, or e.g. "side_set_3" if it has no name.
std::string short_name_of(const MeshSet& set);
// Returns true if the number of distribution factors is plausible: at least one per side in a side
// set (usually one per node of each side), and one per member in any other set.
bool has_usual_factors(const MeshSet& set);

// Converts sets to extras for a writer. Does the same as extras_of_sets() of shm/sets.h, but throws
// Failure in case of an error.
std::vector<Extra> set_extras(const std::vector<MeshSet>& sets);
// Returns the sets that the extras of a mesh describe, except invalid sets. Adds the keys of the
// extras of these sets to `used`.
std::vector<MeshSet> sets_of_extras(const MeshInfo& info, std::set<std::string>& used);
std::vector<MeshSet> sets_of_extras(const MeshInfo& info);
// Removes the extras of all sets, including sets of unknown kinds, so that new sets can use the
// same numbers.
void erase_set_folders(std::vector<Extra>& extras);

// If a set consists of whole blocks, replaces the list of blocks with a list of cells. Reads all
// cells of the mesh if there is at least one set of this kind.
void list_members(MeshSource& mesh, std::vector<MeshSet>& sets);

}  // namespace shm::converters
