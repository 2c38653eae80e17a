// Runs a command on its files. A single file is handled directly. Several files are handled one by
// one, with a line for each and a summary at the end.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

// Runs the command. Returns the exit code; for several files, the largest one. A failure of one
// file does not stop the work on the other files. Files that must be refused are found before the
// first file is started.
int run_on_files(FileCommand& command);

}  // namespace shm::converters
