// shm extract: a piece of a .shm file, in any format.
#pragma once

#include <string>
#include <vector>

#include "tool/running/command.h"
#include "tool/step_choice.h"

namespace shm::converters {

struct ExtractCommand final : Command {
  std::string format;  // format of the output; empty: chosen by the name of the output
  std::string cells, box, set, part;
  std::vector<std::string> blocks, arrays;
  StepChoice steps;
  bool strict = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  ExitCode run() override;
};

}  // namespace shm::converters
