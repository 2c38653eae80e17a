// shm extract: writes a piece of a .shm file as a separate mesh in any format.
#pragma once

#include <string>
#include <vector>

#include "tool/running/command.h"
#include "tool/step_choice.h"

namespace shm::converters {

struct ExtractCommand final : Command {
  std::string format;  // output format; if empty, it is derived from the output name
  std::string cells, box, set, part;
  std::vector<std::string> blocks, arrays;
  StepChoice steps;
  bool strict = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  ExitCode run() override;
};

}  // namespace shm::converters
