// shm join: puts several meshes into one .shm file, as an archive or merged into one mesh.
#pragma once

#include <string>
#include <vector>

#include "compression/compress.h"
#include "tool/progress_line.h"
#include "tool/running/command.h"

namespace shm::converters {

struct JoinCommand final : Command {
  std::vector<std::string> inputs;
  std::string order = "keep", level = "default";
  unsigned threads = 0;  // number of threads; 0 means one per core
  bool merge = false;
  bool json = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  ExitCode run() override;

 private:
  ExitCode write_merged(const CompressOptions& how, ProgressLine& line);
};

}  // namespace shm::converters
