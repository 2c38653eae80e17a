// What goes wrong in a command, on standard error, and the exit code that follows from it.
#pragma once

#include <functional>

#include "tool/running/command.h"

namespace shm::converters {

// What `work` returns, or the exit code of what it throws. `chosen`: the command that runs, null as
// long as there is none; looked at when something is thrown.
int reported(const Command* const& chosen, const std::function<int()>& work);

}  // namespace shm::converters
