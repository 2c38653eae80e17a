// shm split: restores the files of an archive, each in its own format.
#pragma once

#include <string>
#include <vector>

#include "archive/archive_files.h"

#include "tool/running/command.h"

namespace shm::converters {

struct SplitCommand final : Command {
  std::vector<std::string> members;  // names of the members to restore; if empty, all members
  std::string directory = ".";
  bool packed = false;
  unsigned threads = 0;  // number of threads; 0 means one per core

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;

 private:
  std::string path_of(const ArchiveMember& member) const;
};

}  // namespace shm::converters
