// Runs the tool shm, given its commands.
#pragma once

#include <memory>
#include <vector>

#include "tool/running/command.h"

namespace shm::converters {

using Commands = std::vector<std::unique_ptr<Command>>;

// Runs the command that the arguments name and returns the exit code. Reports failures on standard
// error, even if memory runs out while the commands are created.
int run_tool(Commands (*commands)(), int argc, char** argv) noexcept;

}  // namespace shm::converters
