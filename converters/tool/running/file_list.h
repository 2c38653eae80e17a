// The files that a command is to work on one by one, and where what it makes of each is to go.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "shm/result.h"
#include "transfer/format.h"

namespace shm::converters {

struct FileTask {
  std::string input, output;  // output: empty where nothing is written
  std::uint64_t bytes = 0;    // of the input
  std::string passed_over;    // why; empty: it is not
  Result<void> refusal;       // why it is not begun, found before any work
  int code = 0;               // how it ended
};

struct FileList {
  std::vector<FileTask> tasks;
  std::uint64_t others = 0;  // files in folders that the command is not for
};

// What the command does with files.
struct FilePurpose {
  bool recursive = false;
  std::string folder;  // where all that is written goes; empty: beside its input
  // Whether a file in a folder is one for the command; null: of no known format.
  std::function<bool(const Format*)> is_for;
  // Why one that was named is passed over; empty: it is not. May throw Failure.
  std::function<std::string(const std::string& input)> why_passed_over;
  // What is written beside an input; empty: nothing. May throw Failure.
  std::function<std::string(const std::string& input)> output_beside;
};

// `paths` in their order, the files of a folder by their names. Folders without --recursive,
// folders and files that cannot be read, and two outputs of one name are refusals of their tasks.
FileList list_files(const std::vector<std::string>& paths, const FilePurpose& purpose);

}  // namespace shm::converters
