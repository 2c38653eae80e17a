// A command of the tool shm. To add one: a struct in a unit of its own in tool/commands, with its
// options and how it runs, and its line in the list of shm_tool.cpp.
#pragma once

#include <string>
#include <vector>

#include "tool/destination.h"
#include "tool/support.h"
#include "transfer/format.h"

namespace CLI {
class App;
}

namespace shm::converters {

struct Command : CommonOptions {
  virtual ~Command() = default;
  // Adds the command with its options to `tool`, which this must outlive.
  virtual CLI::App* add_to(CLI::App& tool) = 0;
  // What it reads and writes with the options given, of which nothing may be lost. Throws Failure.
  virtual Places places() { return {}; }
  // Whether it says itself what can be done about a damaged file.
  virtual bool names_repair() const { return false; }
  // Once, behind places(). Throws Failure.
  virtual ExitCode run() = 0;
};

// A command that takes any number of files and works on each by itself; of several, in a process of
// its own. run() then has one of them as `input`, and as `output` what output_beside() makes of it,
// or what the user wants instead.
struct FileCommand : Command {
  std::vector<std::string> files;
  bool recursive = false;             // folders, too
  bool to_stdout = false;             // -c
  bool remove = false, keep = false;  // --rm; -k, which excludes it
  bool json = false;
  bool is_one_of_many = false;  // a line is enough
  unsigned threads = 0;         // one for each core

  // Whether a file of a folder is for it; null: of no known format.
  virtual bool is_for(const Format* format) const { return format != nullptr; }
  // Whether it matters how many bytes become how many.
  virtual bool changes_size() const { return false; }
  // Why an input is left alone; empty: it is not.
  virtual std::string why_passed_over(const std::string& /*path*/) const { return {}; }
  // What is written of an input where the user names nothing; empty: nothing is written. Throws
  // Failure.
  virtual std::string output_beside(const std::string& /*path*/) const { return {}; }
};

}  // namespace shm::converters
