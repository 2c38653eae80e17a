// The commands of the tool shm that make archives, take them apart, and check them.
#pragma once

#include "tool/options.h"
#include "tool/support.h"

namespace shm::converters {

ExitCode run_join(Options& options);
ExitCode run_split(Options& options);
// Each member as a file of its own; --against names the directory of their sources.
ExitCode verify_archive(const Options& options);

}  // namespace shm::converters
