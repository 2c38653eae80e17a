// Base classes of the commands of the tool shm. To add a command, write a struct derived from
// Command in a new source file in tool/commands, and add it to the list in shm_tool.cpp.
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
  // Adds the command and its options to `tool`. `tool` stores references to this object, which must
  // outlive `tool`.
  virtual CLI::App* add_to(CLI::App& tool) = 0;
  // Returns the files that the command reads and writes with the options that the user chose. The
  // caller checks that no input is overwritten. Throws Failure.
  virtual Places places() { return {}; }
  // Returns true if the command's own error messages explain how to repair a damaged file.
  // Otherwise the caller adds a hint that mentions shm repair.
  virtual bool names_repair() const { return false; }
  // Runs the command. Called only once, after places(). Throws Failure.
  virtual ExitCode run() = 0;
};

// A command that accepts any number of files. If there are several files, each file is processed in
// a separate process. When run() is called, `input` is one of the files. `output` is the output
// that the user chose, or the result of output_beside().
struct FileCommand : Command {
  std::vector<std::string> files;
  bool recursive = false;             // also process the files in folders (--recursive)
  bool to_stdout = false;             // -c: write to standard output
  bool remove = false, keep = false;  // remove the input (--rm), or keep it (-k)
  bool json = false;
  // True if the command processes several files; the report about each file is then a single line.
  bool is_one_of_many = false;
  unsigned threads = 0;  // number of threads; 0 means one per core

  // Returns true if the command processes files of this format when they are found in a folder.
  // `format` is null if the format is unknown.
  virtual bool is_for(const Format* format) const { return format != nullptr; }
  // Returns true if the report about several files contains the sizes of inputs and outputs.
  virtual bool changes_size() const { return false; }
  // Returns the reason why an input is skipped, or an empty string if it is not skipped.
  virtual std::string why_passed_over(const std::string& /*path*/) const { return {}; }
  // Returns the default output path for an input, or an empty string if the command writes no
  // output. Throws Failure.
  virtual std::string output_beside(const std::string& /*path*/) const { return {}; }
};

}  // namespace shm::converters
