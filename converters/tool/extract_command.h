// shm extract: a piece of a .shm file, in any format.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tool/support.h"

namespace shm::converters {

ExitCode run_extract(Options& options);

}  // namespace shm::converters
