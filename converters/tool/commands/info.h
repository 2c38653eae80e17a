// shm info: what a mesh holds, and where the bytes of a .shm file go.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

class ProgressLine;
class ToolInput;

struct InfoCommand final : FileCommand {
  bool verbose = false, ranges = false;

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;

 private:
  std::string of_mesh(ToolInput& in, ProgressLine& line);
};

}  // namespace shm::converters
