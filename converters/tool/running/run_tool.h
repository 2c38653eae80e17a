// The tool shm, given its commands.
#pragma once

#include <memory>
#include <span>

#include "tool/running/command.h"

namespace shm::converters {

// Runs the one that the arguments name, and reports on standard error what goes wrong. Gives the
// exit code.
int run_tool(std::span<const std::unique_ptr<Command>> commands, int argc, char** argv);

}  // namespace shm::converters
