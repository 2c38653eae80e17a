// All sets of a mesh, whatever format it came from.
#pragma once

#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

// Returns the sets of a mesh: those of its format, and those of shm/sets.h, except sets that
// consist of all blocks with the same name. `used` receives the keys of their extras.
std::vector<MeshSet> transfer_sets(const MeshInfo& info, Keys& used);

}  // namespace shm::converters
