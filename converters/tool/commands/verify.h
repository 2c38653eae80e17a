// shm verify: decodes a .shm file completely to find damage. With --against, also checks that it
// contains the same mesh as its source.
#pragma once

#include <string>

#include "base/failure.h"
#include "tool/running/command.h"

namespace shm::converters {

struct VerifyCommand final : FileCommand {
  std::string against, cell_order;

  CLI::App* add_to(CLI::App& tool) override;
  bool is_for(const Format* format) const override;
  bool names_repair() const override { return true; }
  ExitCode run() override;

 private:
  ExitCode verify_archive();
  [[noreturn]] void fail_with_damage(const Failure& failure, const std::string& path) const;
};

}  // namespace shm::converters
