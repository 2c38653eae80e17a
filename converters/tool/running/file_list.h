// Lists the files that a command processes one by one, and the output of each file.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "interface/format.h"
#include "shm/result.h"

namespace shm::converters {

struct FileTask {
  std::string input, output;  // paths of the files; `output` is empty if no output is written
  std::uint64_t bytes = 0;    // size of the input in bytes
  std::string passed_over;    // reason for skipping the input; empty if it is not skipped
  Result<void> refusal;       // error if the task is refused before work starts
  int code = 0;               // exit code of the task
};

struct FileList {
  std::vector<FileTask> tasks;
  // Number of files that were found in folders and are ignored because of their format.
  std::uint64_t others = 0;
};

// The rules by which a command chooses its input files and the paths of its outputs.
struct FilePurpose {
  bool recursive = false;
  std::string folder;  // folder for all outputs; if empty, each output is written next to its input

  // Returns true if the command processes files of this format when they are found in a folder. The
  // format is null if it is unknown.
  std::function<bool(const Format*)> is_for;
  // Returns the reason why a file is skipped, or an empty string if it is not skipped. May throw
  // Failure.
  std::function<std::string(const std::string& input)> why_passed_over;
  // Returns the default path of the output for an input, or an empty string if the command writes
  // no output. May throw Failure.
  std::function<std::string(const std::string& input)> output_beside;
};

// Returns one task per file. Tasks are in the order of `paths`; the files of a folder are sorted by
// name. A task is refused if its path is a folder and --recursive is not given, if its path cannot
// be read, or if another task has the same output.
FileList list_files(const std::vector<std::string>& paths, const FilePurpose& purpose);

}  // namespace shm::converters
