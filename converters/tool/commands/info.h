// shm info: what a mesh holds, and where the bytes of a .shm file go.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

struct InfoCommand final : FileCommand {
  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

}  // namespace shm::converters
