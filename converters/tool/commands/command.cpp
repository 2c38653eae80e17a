#include "tool/commands/command.h"

#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "tool/help/words.h"

#ifndef SHM_VERSION
#define SHM_VERSION "0.9.0"
#endif

namespace shm::converters {
namespace {

std::string meant(const std::string& nearest) {
  return nearest.empty() ? "" : "; did you mean " + nearest + "?";
}

// What is wrong with the words, and where to read more: an option that there is not is named before
// all that follows from it.
std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
  const auto chosen = app.get_subcommands();
  const CLI::App& command = chosen.empty() ? app : *chosen.front();
  const std::string name = chosen.empty() ? "shm" : "shm " + command.get_name();
  std::string wrong = error.what();
  for (const std::string& word : command.remaining()) {
    if (word.size() < 2 || word.front() != '-') continue;
    std::vector<std::string> known;
    for (const CLI::Option* option : command.get_options())
      for (const std::string& letters : option->get_lnames()) known.push_back("--" + letters);
    const std::string option = word.substr(0, word.find('='));
    wrong = "there is no option " + option + meant(nearest_word(option, known));
    break;
  }
  return wrong + " (see " + name + " --help)";
}

// The words behind "shm", as CLI11 takes them: the last one first. `help` and `version` are what
// --help and --version are.
std::vector<std::string> words_of(int argc, char** argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (words.empty() || words[0] == "version")
    words = {words.empty() ? "--help" : "--version"};
  else if (words[0] == "help" && words.size() < 3)
    words = words.size() == 1 ? std::vector<std::string>{"--help"}
                              : std::vector<std::string>{words[1], "--help"};
  std::reverse(words.begin(), words.end());
  return words;
}

int parse_and_run(std::span<const std::unique_ptr<Command>> commands, int argc, char** argv,
                  const Command*& chosen) {
  CLI::App app{"shm compresses hexahedral meshes with their data and gives them back."};
  app.name("shm");
  app.set_version_flag("-V,--version", "shm " SHM_VERSION);
  app.require_subcommand(1);
  app.footer(
      "shm COMMAND --help explains its options and gives examples.\n"
      "Exit codes: 0 done, 1 a difference was found, 2 wrong use, 3 bad or unreadable input,\n"
      "4 output could not be written, 5 a limit was exceeded, 6 the output would lack something\n"
      "of the mesh (--strict), 7 repair salvaged what is whole, and something is missing.");
  std::vector<std::pair<CLI::App*, Command*>> added;
  std::vector<std::string> names = {"help", "version"};
  for (const auto& command : commands) {
    added.emplace_back(command->add_to(app), command.get());
    names.push_back(added.back().first->get_name());
  }
  std::vector<std::string> words = words_of(argc, argv);
  const std::string& first = words.back();
  if (!first.starts_with('-') && std::find(names.begin(), names.end(), first) == names.end()) {
    std::fprintf(stderr, "shm: there is no command %s%s (see shm --help)\n", first.c_str(),
                 meant(nearest_word(first, names)).c_str());
    return kWrongUse;
  }
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    const bool asked = error.get_exit_code() == 0;  // help, version
    if (asked) app.exit(error, argc == 1 ? std::cerr : std::cout);
    if (!asked) std::fprintf(stderr, "shm: %s\n", complaint(app, error).c_str());
    return asked && argc > 1 ? kDone : kWrongUse;
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

// Whether `path` is a file, and a .shm file by its beginning.
bool is_shm_file(const std::string& path) {
  std::error_code none;
  try {
    return std::filesystem::is_regular_file(path, none) && is_shm(path);
  } catch (const Failure&) {
    return false;
  }
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
    const bool damaged = error.code == ErrorCode::corrupt || error.code == ErrorCode::truncated;
    if (damaged && chosen != nullptr && !chosen->names_repair() && is_shm_file(error.file))
      error.detail += "; shm verify lists what is damaged, shm repair -o OUT.shm writes the rest";
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
