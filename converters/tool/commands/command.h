// A command of the tool shm. To add one: a struct of its own in a pair of files here, with its
// options and how it runs, and its line in the list of shm_tool.cpp.
#pragma once

#include <memory>
#include <span>

#include "tool/destination.h"
#include "tool/support.h"

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

// Runs the one that the arguments name, and reports on standard error what goes wrong. Gives the
// exit code.
int run_tool(std::span<const std::unique_ptr<Command>> commands, int argc, char** argv);

}  // namespace shm::converters
