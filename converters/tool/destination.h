// Checks where a command may write. An existing file is overwritten only if the user agrees. An
// input of the command is never overwritten, even if the paths of input and output are different
// names of the same file. Both rules are checked before the command starts its work.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace shm::converters {

// The files that a command reads and writes.
struct Places {
  std::vector<std::string> inputs;  // paths; "-" and "" are ignored

  // Path of the output. If the output is not known yet, or if the command changes its input in
  // place, `output` is empty.
  std::optional<std::string> output;
  bool compressed = false;  // true if the output is binary and must not go to a terminal

  // The files that already exist, if the output is the name of a series of files.
  std::vector<std::string> series = {};
};

// Returns "-" if `path` is a name in /dev or /proc for standard input (if `descriptor` is 0) or
// standard output (if it is 1). Otherwise returns `path`.
std::string standard_or(std::string path, int descriptor);

// Checks an output: a file to be written, a device, a pipe, or "-". Call this before reading
// anything. Throws Failure (output) in these cases:
// - the output, or a file of its series, is also an input, even if the paths differ and even with
//   --force;
// - the output exists, and neither --force nor the user's answer on the terminal allows replacing
//   it;
// - the output cannot be created;
// - the output is a terminal, but the command writes compressed data.
void check_places(const Places& places, bool force);

}  // namespace shm::converters
