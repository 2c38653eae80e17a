// shm surface: writes the boundary surface of a mesh as a PLY, STL or OBJ file.
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
