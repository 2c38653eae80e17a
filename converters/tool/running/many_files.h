// Runs a command on its files. A single file is processed directly. If there are several files,
// each is processed in a separate process; a line is printed for each file, and a summary at the
// end.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

// Runs the command and returns its exit code. If there are several files, returns the largest of
// their exit codes. If one file fails, the other files are still processed. Before any file is
// processed, all files are checked for reasons to refuse them.
int run_on_files(FileCommand& command);

}  // namespace shm::converters
