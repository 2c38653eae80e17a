// Where a command may write. Nothing that is there is written over unasked, and what the command
// reads is never written over: that is found before any work, by asking the operating system which
// file a path leads to.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace shm::converters {

// What a command reads, and what it is to write.
struct Places {
  std::vector<std::string> inputs;  // paths; "-" and "" are passed over
  std::optional<std::string>
      output;               // nothing: what is written is known later, or changed in place
  bool compressed = false;  // .shm
  // Where the output is a name for many files: those of them that are there.
  std::vector<std::string> series = {};
};

// "-" where `path` is a name of standard input (descriptor 0) or output (1) in /dev.
std::string standard_or(std::string path, int descriptor);

// Call before anything is read; an output is a file to be, a device, a pipe, or "-". Throws Failure
// (output) where it, or one of its series, is an input (under whatever name, even with --force);
// where a file is there, and neither --force nor an answer on the terminal lets it go; where none
// can be made; where compressed bytes would go to a terminal.
void check_places(const Places& places, bool force);

}  // namespace shm::converters
