// The command append of the tool shm.
#pragma once

#include "tool/options.h"
#include "tool/support.h"

namespace shm::converters {

ExitCode run_append(Options& options);

}  // namespace shm::converters
