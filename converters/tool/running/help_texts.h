// shm completion and shm manual: print texts that are generated from the options and the help of
// all commands.
#pragma once

#include <string>

#include "tool/running/command.h"

namespace shm::converters {

struct CompletionCommand final : Command {
  std::string shell;
  const CLI::App* all = nullptr;  // the whole tool, with all its commands

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

struct ManualCommand final : Command {
  // Name of the command whose page is printed; if empty, the page of the whole tool.
  std::string one;
  const CLI::App* all = nullptr;

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

}  // namespace shm::converters
