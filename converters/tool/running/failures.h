// Reports failures of a command on standard error, and determines their exit codes.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

// Reports the current exception and returns its exit code. Call this while an exception of a
// command is being handled. `chosen` is the running command, or null if no command has been chosen
// yet. If memory has run out, prints a fixed message, for which no memory is allocated, and returns
// kLimit.
int code_of_failure(const Command* chosen) noexcept;

// Calls work() and returns its result. If work() throws an exception, reports it and returns its
// exit code. `chosen` is a reference, because work() may set the running command.
template <class Work>
int reported(const Command* const& chosen, const Work& work) noexcept {
  try {
    return work();
  } catch (...) {
    return code_of_failure(chosen);
  }
}

}  // namespace shm::converters
