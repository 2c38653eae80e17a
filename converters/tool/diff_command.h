// The command `shm diff A B`: its options, and how it runs.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"

namespace shm::converters {

struct DiffCommand {
  std::string a, b;
  std::optional<std::string> abs, rel;
  std::vector<std::string> arrays, only, ignored;
  bool match = false, no_maps = false, no_extras = false, json = false;
  std::uint64_t limit = 3;

  void add_options(CLI::App& command);
  // What goes to standard output; `equal` tells the exit code. Throws Failure, naming the file.
  struct Outcome {
    bool equal;
    std::string text;
  };
  Outcome run(Spool& spool, const Progress& progress) const;
};

extern const char* const kDiffDescription;
extern const char* const kDiffExamples;

}  // namespace shm::converters
