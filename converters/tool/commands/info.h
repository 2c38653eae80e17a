// shm info: what a mesh holds, and where the bytes of a .shm file go.
#pragma once

#include "tool/commands/command.h"

namespace shm::converters {

struct InfoCommand final : Command {
  bool json = false;

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

}  // namespace shm::converters
