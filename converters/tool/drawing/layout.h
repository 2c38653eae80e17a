// shm layout: draws a diagram that shows how coherently a mesh is stored.
#pragma once

#include "tool/running/command.h"

namespace shm::converters {

struct LayoutCommand final : FileCommand {
  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  std::string output_beside(const std::string& path) const override;
  ExitCode run() override;

 private:
  bool is_png() const;
};

}  // namespace shm::converters
