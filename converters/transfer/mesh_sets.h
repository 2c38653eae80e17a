// The named groups of a mesh, for people to look at; nothing else depends on it.
#pragma once

#include <vector>

#include "transfer/format.h"

namespace shm::converters {

std::vector<MeshSet> mesh_sets(const MeshInfo& info);

}  // namespace shm::converters
