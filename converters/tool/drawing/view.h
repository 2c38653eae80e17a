// shm view: writes a page that shows a mesh in a browser.
#pragma once

#include <string>

#include "tool/running/command.h"

namespace shm::converters {

struct ViewCommand final : FileCommand {
  std::string page, level = "default";

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  std::string output_beside(const std::string& path) const override;
  ExitCode run() override;

 private:
  // Returns the name to display: the name of the part if one was chosen, otherwise the name of the
  // file.
  std::string shown_name() const;
};

}  // namespace shm::converters
