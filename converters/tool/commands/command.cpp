#include "tool/commands/command.h"

#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/failure.h"

#ifndef SHM_VERSION
#define SHM_VERSION "0.9.0"
#endif

namespace shm::converters {
namespace {

int parse_and_run(std::span<const std::unique_ptr<Command>> commands, int argc, char** argv,
                  const Command*& chosen) {
  CLI::App app{"shm compresses hexahedral meshes with their data and gives them back."};
  app.name("shm");
  app.set_version_flag("--version", "shm " SHM_VERSION);
  app.require_subcommand(1);
  app.footer(
      "shm COMMAND --help explains its options and gives examples.\n"
      "Exit codes: 0 done, 1 a difference was found, 2 wrong use, 3 bad or unreadable input,\n"
      "4 output could not be written, 5 a limit was exceeded, 6 the output would lack something\n"
      "of the mesh (--strict), 7 repair salvaged what is whole, and something is missing.");
  std::vector<std::pair<CLI::App*, Command*>> added;
  for (const auto& command : commands) added.emplace_back(command->add_to(app), command.get());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // help, version
    std::fprintf(stderr, "shm: %s (see shm --help)\n", error.what());
    return kWrongUse;
  }
  for (const auto& [parsed, command] : added)
    if (parsed->parsed()) {
      chosen = command;
      command->input = standard_or(command->input, STDIN_FILENO);
      command->output = standard_or(command->output, STDOUT_FILENO);
      check_places(command->places(), command->force);
      return command->run();
    }
  return kWrongUse;
}

// Whether standard output is a pipe that nobody reads any more: `shm info x | head` is no mistake.
bool nobody_listens() {
  struct pollfd out = {STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&out, 1, 0) > 0 && (out.revents & POLLERR) != 0;
}

int complain(int code, const std::string& sentence) {
  if (code == kBadOutput && nobody_listens()) return code;
  std::fprintf(stderr, "shm: %s\n", sentence.c_str());
  return code;
}

}  // namespace

int run_tool(std::span<const std::unique_ptr<Command>> commands, int argc, char** argv) {
  const Command* chosen = nullptr;
  const auto input = [&] { return chosen != nullptr ? chosen->input : std::string(); };
  try {
    const int code = parse_and_run(commands, argc, argv, chosen);
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    return complain(kBadOutput, "standard output cannot be written");
  } catch (const Failure& failure) {
    Error error = failure.error();
    if (chosen != nullptr && !chosen->spooled.empty() && error.file == chosen->spooled)
      error.file = chosen->spooled_from;
    if (error.file.empty() && error.code != ErrorCode::misuse) error.file = input();
    return complain(exit_code(error.code), error.message());
  } catch (const std::bad_alloc&) {
    return complain(kLimit, input() + ": needs more memory than there is");
  } catch (const std::length_error&) {
    return complain(kLimit, input() + ": needs more memory than there is");
  } catch (const std::exception& error) {
    return complain(kBadInput, input() + ": " + error.what());
  }
}

}  // namespace shm::converters
