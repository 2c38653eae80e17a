// The command append of the tool shm.
#pragma once

#include "tool_options.h"
#include "tool_support.h"

namespace shm::converters {

ExitCode run_append(Options& options);

}  // namespace shm::converters
