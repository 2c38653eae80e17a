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
  std::string input, output;  // paths; `output` is empty if nothing is written
  std::uint64_t bytes = 0;    // size of the input in bytes
  std::string passed_over;    // reason for passing over the input; empty: not passed over
  Result<void> refusal;       // reason for refusing this task, found before any work
  int code = 0;               // exit code of the task
};

struct FileList {
  std::vector<FileTask> tasks;
  std::uint64_t others = 0;  // number of files in folders whose format the command does not handle
};

// The way in which a command handles files.
struct FilePurpose {
  bool recursive = false;
  std::string folder;  // folder for all outputs; empty: each output is next to its input

  // Returns true if the command handles files of this format in folders. The format is null if it
  // is unknown.
  std::function<bool(const Format*)> is_for;
  // Returns the reason for passing over a file that the user named; empty: none. May throw Failure.
  std::function<std::string(const std::string& input)> why_passed_over;
  // Returns the path of the output next to an input; empty if nothing is written. May throw
  // Failure.
  std::function<std::string(const std::string& input)> output_beside;
};

// Lists the files of `paths` in their order. The files of a folder are sorted by name. A task is
// refused if its path is a folder and --recursive is not given, if its path cannot be read, or if
// another task has the same output.
FileList list_files(const std::vector<std::string>& paths, const FilePurpose& purpose);

}  // namespace shm::converters
