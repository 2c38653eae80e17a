// shm info: lists the contents of a mesh, and the size of each stream of a .shm file.
#pragma once

#include "compression/decompress.h"
#include "tool/info_report.h"
#include "tool/running/command.h"

namespace shm::converters {

class ProgressLine;
class ToolInput;

struct InfoCommand final : FileCommand {
  bool verbose = false, ranges = false;

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;

 private:
  bool is_small(const MeshInfo& info) const;
  InfoExtent extent_of_small(ToolInput& in, const FileSummary& summary, ProgressLine& line) const;
  std::string of_mesh(ToolInput& in, ProgressLine& line);
};

}  // namespace shm::converters
