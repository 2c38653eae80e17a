// shm completion and shm manual: texts generated from the options and help of all commands.
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
  std::string one;  // name of the command whose page is printed; empty: all
  const CLI::App* all = nullptr;

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

}  // namespace shm::converters
