// What goes wrong in a command, on standard error, and the exit code that follows from it.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

// For who handles what a command has thrown: reports it, and the exit code that follows from it.
// `chosen`: the command that runs, null as long as there is none. Where memory has run out there
// may be none for a sentence either: kLimit, and one that takes none.
int code_of_failure(const Command* chosen) noexcept;

// What `work` returns, or the exit code of what it throws. `chosen` is looked at when something is
// thrown.
template <class Work>
int reported(const Command* const& chosen, const Work& work) noexcept {
  try {
    return work();
  } catch (...) {
    return code_of_failure(chosen);
  }
}

}  // namespace shm::converters
