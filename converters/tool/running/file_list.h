// The files that a command handles one by one, and the output of each.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "interface/format.h"
#include "shm/result.h"

namespace shm::converters {

struct FileTask {
  std::string input, output;  // output: empty if nothing is written
  std::uint64_t bytes = 0;    // of the input
  std::string passed_over;    // the reason; empty: not passed over
  Result<void> refusal;       // reason for not starting it, found before any work
  int code = 0;               // exit code
};

struct FileList {
  std::vector<FileTask> tasks;
  std::uint64_t others = 0;  // files in folders that the command is not for
};

// The way in which a command handles files.
struct FilePurpose {
  bool recursive = false;
  std::string folder;  // folder for all outputs; empty: next to each input
  // Returns true if the command takes files of this format from a folder. Null: unknown format.
  std::function<bool(const Format*)> is_for;
  // Returns the reason for passing over a named file; empty: none. May throw Failure.
  std::function<std::string(const std::string& input)> why_passed_over;
  // Returns the output next to an input; empty: none. May throw Failure.
  std::function<std::string(const std::string& input)> output_beside;
};

// Lists the files of `paths` in their order; the files of a folder are sorted by name. A task is
// refused if its path is a folder and --recursive is not given, if its path cannot be read, or if
// another task has the same output.
FileList list_files(const std::vector<std::string>& paths, const FilePurpose& purpose);

}  // namespace shm::converters
