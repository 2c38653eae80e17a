// shm convert and shm decompress: a mesh in another format.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tool/commands/command.h"

namespace shm::converters {

class ToolInput;

struct ConvertCommand : Command {
  std::string format;  // empty: by name
  std::optional<std::uint64_t> step;
  unsigned threads = 0;  // one for each core
  bool strict = false;

  CLI::App* add_to(CLI::App& tool) override;
  Places places() override;
  ExitCode run() override;

 protected:
  ExitCode write(ToolInput& in);
};

struct DecompressCommand final : ConvertCommand {
  CLI::App* add_to(CLI::App& tool) override;
  ExitCode run() override;
};

}  // namespace shm::converters
