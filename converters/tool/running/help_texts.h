// shm completion, shm manual: texts that are made of the options and the help of all commands.
#pragma once

#include <string>

#include "tool/running/command.h"

namespace shm::converters {

struct CompletionCommand final : Command {
  std::string shell;
  const CLI::App* all = nullptr;  // of which this is a command

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

struct ManualCommand final : Command {
  std::string one;  // of the commands; empty: all
  const CLI::App* all = nullptr;

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

}  // namespace shm::converters
