// shm join: several meshes into one .shm file.
#pragma once

#include <string>
#include <vector>

#include "tool/running/command.h"

namespace shm::converters {

struct JoinCommand final : Command {
  std::vector<std::string> inputs;
  std::string order = "keep", level = "default";
  unsigned threads = 0;  // one for each core
  bool json = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  ExitCode run() override;
};

}  // namespace shm::converters
