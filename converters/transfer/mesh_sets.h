// Finds the sets of a mesh that came from any format.
#pragma once

#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

// Returns the sets of a mesh, which may be stored in the extras of its source format or in the
// extras of shm/sets.h. Leaves out the sets of shm/sets.h that consist of whole blocks with the
// name of the set. Adds the keys of the extras that describe the sets to `used`.
std::vector<MeshSet> transfer_sets(const MeshInfo& info, Keys& used);

}  // namespace shm::converters
