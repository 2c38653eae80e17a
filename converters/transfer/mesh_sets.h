// The sets of a mesh of any format.
#pragma once

#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

// Returns the sets of a mesh: the sets in the extras of its format and the sets of shm/sets.h,
// except sets that consist of all blocks with the same name. Adds the keys of the extras that
// describe these sets to `used`.
std::vector<MeshSet> transfer_sets(const MeshInfo& info, Keys& used);

}  // namespace shm::converters
