// shm append: adds time steps of the same mesh to a .shm file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "archive/append.h"

#include "tool/running/command.h"

namespace shm::converters {

struct AppendCommand final : Command {
  std::string source, level = "default", cell_order;
  std::vector<std::string> steps;  // steps to append, in the form that steps_named() parses
  std::optional<double> time;
  std::uint32_t key_steps = 0;  // largest distance between key steps; 0: as in the file
  unsigned threads = 0;         // number of threads; 0: one per core
  bool all = false, strict = false, json = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  ExitCode run() override;

 private:
  AppendHow how(const MeshInfo& info, const Progress& progress) const;
  std::string json_of(const AppendOutcome& outcome) const;
  std::string text_of(const AppendOutcome& outcome) const;
  ExitCode report_differences(const AppendOutcome& outcome) const;
};

}  // namespace shm::converters
