// shm manual: the page that `man shm` shows, made of the help of all commands.
#pragma once

#include "tool/commands/command.h"

namespace shm::converters {

struct ManualCommand final : Command {
  const CLI::App* all = nullptr;  // of which this is a command

  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

}  // namespace shm::converters
