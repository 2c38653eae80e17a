// The tool shm, given its commands.
#pragma once

#include <memory>
#include <vector>

#include "tool/running/command.h"

namespace shm::converters {

using Commands = std::vector<std::unique_ptr<Command>>;

// Runs the one that the arguments name, and reports on standard error what goes wrong, memory for
// the commands themselves included. Gives the exit code.
int run_tool(Commands (*commands)(), int argc, char** argv) noexcept;

}  // namespace shm::converters
