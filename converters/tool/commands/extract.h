// shm extract: a piece of a .shm file, in any format.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tool/running/command.h"

namespace shm::converters {

struct ExtractCommand final : Command {
  std::string format;  // empty: by name
  std::string cells, box, set, part;
  std::vector<std::string> blocks, arrays;
  std::optional<std::uint64_t> step;
  bool strict = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  ExitCode run() override;
};

}  // namespace shm::converters
