// A command of the tool shm. To add a command, write a struct with its options and run() in a new
// unit in tool/commands, and add it to the list in shm_tool.cpp.
#pragma once

#include <string>
#include <vector>

#include "interface/format.h"
#include "tool/destination.h"
#include "tool/support.h"

namespace CLI {
class App;
}

namespace shm::converters {

struct Command : CommonOptions {
  virtual ~Command() = default;
  // Adds the command with its options to `tool`. This object must outlive `tool`.
  virtual CLI::App* add_to(CLI::App& tool) = 0;
  // Returns the files that the command reads and writes with the given options. The caller checks
  // that no input would be overwritten. Throws Failure.
  virtual Places places() { return {}; }
  // Returns true if the command itself explains how to repair a damaged file.
  virtual bool names_repair() const { return false; }
  // Runs the command; called once, after places(). Throws Failure.
  virtual ExitCode run() = 0;
};

// A command that takes any number of files. If there are several files, each file is handled in a
// separate process. When run() is called, `input` is one of the files, and `output` is the output
// that the user chose or the result of output_beside().
struct FileCommand : Command {
  std::vector<std::string> files;
  bool recursive = false;             // true: also handle the files in folders
  bool to_stdout = false;             // -c: write to standard output
  bool remove = false, keep = false;  // remove the input (--rm), or keep it (-k)
  bool json = false;
  bool is_one_of_many = false;  // true: print a single line about this file
  unsigned threads = 0;         // number of threads; 0: one per core

  // Returns true if files of this format in a folder are handled. `format` is null if the format is
  // unknown.
  virtual bool is_for(const Format* format) const { return format != nullptr; }
  // Returns true if the report states the sizes of input and output.
  virtual bool changes_size() const { return false; }
  // Returns the reason for skipping an input; empty if it is not skipped.
  virtual std::string why_passed_over(const std::string& /*path*/) const { return {}; }
  // Returns the output path for an input if the user gave none. Returns an empty string if nothing
  // is written. Throws Failure.
  virtual std::string output_beside(const std::string& /*path*/) const { return {}; }
};

}  // namespace shm::converters
