// Runs the tool shm, given its commands.
#pragma once

#include <memory>
#include <vector>

#include "tool/running/command.h"

namespace shm::converters {

using Commands = std::vector<std::unique_ptr<Command>>;

// Runs the command that the arguments name, and reports failures on standard error, even if there
// is no memory for the commands themselves. Returns the exit code.
int run_tool(Commands (*commands)(), int argc, char** argv) noexcept;

}  // namespace shm::converters
