// shm layout: a picture of how coherently a mesh is stored.
#pragma once

#include "tool/commands/command.h"

namespace shm::converters {

struct LayoutCommand final : Command {
  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  ExitCode run() override;
};

}  // namespace shm::converters
