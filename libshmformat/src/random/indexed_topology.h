// add_group(): finds a group through the index and reads its topology.
#pragma once

#include <cstddef>

#include "random/indexed_file.h"
#include "steps/step_topology.h"

namespace shm {

/// Reads the streams that contain the topology of a group, and adds the group to `topology`.
/// Precondition: `group` is the next group that `topology` needs.
Result<void> add_group(IndexedFile& file, std::size_t group, StepTopology& topology);

}  // namespace shm
