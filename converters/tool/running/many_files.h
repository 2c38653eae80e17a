// A command on the files that it was given: on one as it is, on several one by one, with a line for
// each and a sum at the end.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

// Gives the exit code: of several files the largest. One bad file does not stop the others, and
// what is refused is refused before any of them is begun.
int run_on_files(FileCommand& command);

}  // namespace shm::converters
