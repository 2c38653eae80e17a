// The topology of groups that are found by the index.
#pragma once

#include <cstddef>

#include "access/indexed_file.h"
#include "segment/topology_replay.h"

namespace shm {

/// Reads what tells the topology of a group, and adds it to `topology`, whose next group it is.
Result<void> add_group(IndexedFile& file, std::size_t group, TopologyReplay& topology);

}  // namespace shm
