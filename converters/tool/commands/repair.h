// shm repair: restores a damaged file, or salvages its undamaged parts.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

struct RepairCommand final : Command {
  bool json = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  bool names_repair() const override { return true; }
  ExitCode run() override;
};

}  // namespace shm::converters
