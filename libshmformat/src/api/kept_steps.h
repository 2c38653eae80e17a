// kept_steps(): where readers and writers store values of earlier steps.
#pragma once

#include <cstdint>
#include <string>

#include "steps/step_store.h"

namespace shm {

/// Returns a description of a store that keeps up to `memory` bytes in memory, and the rest in a
/// temporary file in `folder` (see ReadLimits::temporary_folder).
KeptSteps kept_steps(std::uint64_t memory, const std::string& folder);

}  // namespace shm
