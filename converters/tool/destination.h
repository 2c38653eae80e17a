// Checks where a command may write. No existing file is overwritten unless the user agrees, and no
// input of the command is ever overwritten. Both are checked before any work, by asking the
// operating system which file a path leads to.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace shm::converters {

// The files that a command reads and writes.
struct Places {
  std::vector<std::string> inputs;  // paths; "-" and "" are ignored

  // Path of the output. Empty if the output is not known yet, or if the input is changed in place.
  std::optional<std::string> output;
  bool compressed = false;  // true: the output is binary, so a terminal is refused

  // Existing output files, if the output is a name for many files.
  std::vector<std::string> series = {};
};

// Returns "-" if `path` is a name in /dev or /proc for standard input (`descriptor` 0) or standard
// output (1). Otherwise returns `path`.
std::string standard_or(std::string path, int descriptor);

// Checks an output: a file to be written, a device, a pipe, or "-". Call this before reading
// anything. Throws Failure (output) in these cases:
// - the output, or a file of its series, is an input, under whatever name, even with --force;
// - a file exists, and neither --force nor an answer on the terminal allows replacing it;
// - the output cannot be created;
// - compressed bytes would go to a terminal.
void check_places(const Places& places, bool force);

}  // namespace shm::converters
