// Finds the sets of a mesh, whichever format the mesh came from.
#pragma once

#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

// Returns the sets of a mesh: those in the extras of its source format, and those of shm/sets.h.
// Leaves out sets that consist only of whole blocks with the same name as the set. Adds the keys of
// the extras that describe the sets to `used`.
std::vector<MeshSet> transfer_sets(const MeshInfo& info, Keys& used);

}  // namespace shm::converters
