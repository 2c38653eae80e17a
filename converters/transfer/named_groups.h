// Lists the named groups of a mesh (sets, physical groups, ...) for display.
#pragma once

#include <vector>

#include "interface/format.h"

namespace shm::converters {

std::vector<NamedGroup> named_groups_of(const MeshInfo& info);

}  // namespace shm::converters
