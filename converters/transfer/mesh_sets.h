// Finds the sets of a mesh that came from any format.
#pragma once

#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "shm/sets.h"

namespace shm::converters {

// Returns the sets of a mesh. They may be stored in extras of the source format, or in the extras
// that shm/sets.h defines. If a set in the extras of shm/sets.h consists of whole blocks with the
// same name as the set, it is omitted. Adds the keys of the extras that describe the sets to
// `used`.
std::vector<MeshSet> transfer_sets(const MeshInfo& info, Keys& used);

}  // namespace shm::converters
