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
  std::vector<std::string> steps;  // values of --step: steps to append; parsed by steps_named()
  std::optional<double> time;
  // Maximum distance between key steps, i.e. time steps that are coded independently of other
  // steps. 0 means the same distance as in the file.
  std::uint32_t key_steps = 0;
  unsigned threads = 0;  // number of threads; 0 means one per core
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
