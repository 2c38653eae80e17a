// A command of the tool shm. To add one, write a struct with its options and run() in a unit of its
// own in tool/commands, and add it to the list in shm_tool.cpp.
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
  // Returns the files that the command reads and writes with the given options, so that no input is
  // overwritten. Throws Failure.
  virtual Places places() { return {}; }
  // Returns true if the command itself explains how to repair a damaged file.
  virtual bool names_repair() const { return false; }
  // Runs the command; called once, after places(). Throws Failure.
  virtual ExitCode run() = 0;
};

// A command that takes any number of files and handles each on its own; if there are several, each
// in its own process. When run() is called, `input` is one of the files, and `output` is the result
// of output_beside() or the output that the user chose.
struct FileCommand : Command {
  std::vector<std::string> files;
  bool recursive = false;             // take the files in folders
  bool to_stdout = false;             // -c
  bool remove = false, keep = false;  // --rm; -k, which excludes it
  bool json = false;
  bool is_one_of_many = false;  // report a single line
  unsigned threads = 0;         // 0: one per core

  // Returns true if the command takes files of this format from a folder. Null: unknown format.
  virtual bool is_for(const Format* format) const { return format != nullptr; }
  // Returns true if the report states the sizes of input and output.
  virtual bool changes_size() const { return false; }
  // Returns the reason for skipping an input; empty if it is not skipped.
  virtual std::string why_passed_over(const std::string& /*path*/) const { return {}; }
  // Returns the output for an input if the user names none; empty if nothing is written. Throws
  // Failure.
  virtual std::string output_beside(const std::string& /*path*/) const { return {}; }
};

}  // namespace shm::converters
