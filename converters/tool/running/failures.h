// Reports failures of a command on standard error, and determines their exit codes.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

// Reports the current exception and returns its exit code. Call this while an exception of a
// command is being handled. `chosen`: the running command; null if no command has been chosen yet.
// If memory has run out, prints a fixed message, which needs no memory, and returns kLimit.
int code_of_failure(const Command* chosen) noexcept;

// Returns the result of `work`, or the exit code of the exception it throws. `chosen` is read when
// an exception is thrown.
template <class Work>
int reported(const Command* const& chosen, const Work& work) noexcept {
  try {
    return work();
  } catch (...) {
    return code_of_failure(chosen);
  }
}

}  // namespace shm::converters
