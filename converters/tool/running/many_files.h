// Runs a command on its files: on a single file directly; on several files one by one, with a line
// for each and a sum at the end.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

// Returns the exit code; for several files, the largest one. A bad file does not stop the others.
// All refusals are found before the first file is started.
int run_on_files(FileCommand& command);

}  // namespace shm::converters
