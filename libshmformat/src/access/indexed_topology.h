// The topology of groups that are found by the index.
#pragma once

#include <cstddef>

#include "access/indexed_file.h"
#include "steps/step_topology.h"

namespace shm {

/// Reads the streams with the topology of a group, and adds it to `topology`, whose next group it
/// is.
Result<void> add_group(IndexedFile& file, std::size_t group, StepTopology& topology);

}  // namespace shm
