// shm surface: writes the boundary of a mesh as a file for other programs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tool/running/command.h"

namespace shm::converters {

struct SurfaceCommand final : FileCommand {
  std::string array, format;
  std::optional<std::uint64_t> decimate;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  std::string output_beside(const std::string& path) const override;
  ExitCode run() override;
};

}  // namespace shm::converters
