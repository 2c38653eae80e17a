// shm preview: draws a picture of a mesh.
#pragma once

#include <string>

#include "tool/running/command.h"

namespace shm::converters {

struct PreviewCommand final : FileCommand {
  std::string size, view, up, array, clip;
  bool edges = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  std::string output_beside(const std::string& path) const override;
  ExitCode run() override;
};

}  // namespace shm::converters
