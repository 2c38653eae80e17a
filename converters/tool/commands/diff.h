// shm diff: reports the differences between any two meshes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tool/running/command.h"

namespace shm::converters {

struct DiffCommand final : Command {
  std::string b;  // path of the second mesh; `input` is the path of the first
  std::optional<std::string> abs, rel;
  std::vector<std::string> arrays, only, ignored;
  bool match = false, no_maps = false, no_extras = false, json = false;
  std::uint64_t limit = 3;

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

}  // namespace shm::converters
