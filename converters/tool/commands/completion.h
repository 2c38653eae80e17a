// shm completion: what a shell completes of shm's command lines, made of the options that there
// are.
#pragma once

#include <string>

#include "tool/commands/command.h"

namespace shm::converters {

struct CompletionCommand final : Command {
  std::string shell;
  const CLI::App* all = nullptr;  // of which this is a command

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

}  // namespace shm::converters
