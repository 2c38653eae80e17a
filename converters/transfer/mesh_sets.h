// Finds the sets of a mesh that came from any format.
#pragma once

#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

// Returns the sets of a mesh. They may be stored in extras of the source format, or in extras as
// shm/sets.h defines them. In the latter case, leaves out the sets that consist of whole blocks
// with the same name as the set. Adds the keys of the extras that describe the sets to `used`.
std::vector<MeshSet> transfer_sets(const MeshInfo& info, Keys& used);

}  // namespace shm::converters
