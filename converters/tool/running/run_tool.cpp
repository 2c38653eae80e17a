#include "tool/running/run_tool.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "tool/help/words.h"
#include "tool/running/failures.h"
#include "tool/running/many_files.h"

#ifndef SHM_VERSION
#define SHM_VERSION "0.10.0"
#endif

namespace shm::converters {
namespace {

std::string meant(const std::string& nearest) {
  return nearest.empty() ? "" : "; did you mean " + nearest + "?";
}

// Returns a message that describes the mistake in the arguments and mentions the help. An unknown
// option is reported before any other mistake, because it may be the cause of the others.
std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
  const auto chosen = app.get_subcommands();
  const CLI::App& command = chosen.empty() ? app : *chosen.front();
  const std::string name = chosen.empty() ? "shm" : "shm " + command.get_name();
  std::string wrong = error.what();
  constexpr std::string_view kNoNumber = "Could not convert: ";
  if (wrong.starts_with(kNoNumber)) wrong = wrong.substr(kNoNumber.size()) + " is not a number";
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

// Replaces options that users know from gzip, xz and zstd with the words that shm expects, e.g. -d
// with the command decompress. Replaces -1 to -9, --fast and --best with --level and its value.
void follow_habits(std::vector<std::string>& words, const CLI::App& app) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kCommands = {
      {{"-z", "compress"},
       {"--compress", "compress"},
       {"-d", "decompress"},
       {"--decompress", "decompress"},
       {"-t", "verify"},
       {"--test", "verify"},
       {"-l", "info"},
       {"--list", "info"}}};
  for (const auto& [option, command] : kCommands)
    if (words[0] == option) words[0] = command;
  if (words[0] != "compress" && words[0] != "join") return;
  const CLI::App* const command = app.get_subcommand(words[0]);
  bool is_value = false;  // true if the next word is the value of an option
  for (std::string& word : words) {
    if (word == "--") return;
    if (std::exchange(is_value, false)) continue;
    // This loop is used instead of get_option_no_throw(), which would end the program if memory ran
    // out.
    for (const CLI::Option* const option : command->get_options())
      if (word.starts_with('-') && option->check_name(word))
        is_value = option->get_expected_max() > 0;
    if (word == "--fast" || word == "--best") word = "--level=" + word.substr(2);
    if (word.size() == 2 && word[0] == '-' && word[1] >= '1' && word[1] <= '9')
      word = std::string("--level=") + (word[1] <= '3'   ? "fast"
                                        : word[1] <= '6' ? "default"
                                                         : "best");
  }
}

// Returns the arguments after "shm" in reverse order, as CLI11 expects. Replaces the words `help`
// and `version` with --help and --version.
std::vector<std::string> words_of(int argc, char** argv, const CLI::App& app) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (words.empty()) words = {"--help"};
  if (words[0] == "version") words = {"--version"};
  if (words[0] == "help" && words.size() < 3)
    words = words.size() == 1 ? std::vector<std::string>{"--help"}
                              : std::vector<std::string>{words[1], "--help"};
  follow_habits(words, app);
  std::reverse(words.begin(), words.end());
  return words;
}

// Returns true if `word`, which should be the name of a command, is the name of a file.
bool is_file(const std::string& word) {
  std::error_code none;
  return std::filesystem::is_regular_file(word, none);
}

int parse_and_run(const Commands& commands, int argc, char** argv, Command*& chosen) {
  CLI::App app{"shm compresses hexahedral meshes with their data, and restores them."};
  app.name("shm");
  app.set_version_flag("-V,--version", "shm " SHM_VERSION);
  app.require_subcommand(1);
  app.footer(
      "shm COMMAND --help explains the options of a command and gives examples.\n"
      "Exit codes: 0 done, 1 a difference was found, 2 usage error, 3 bad or unreadable input,\n"
      "4 output could not be written, 5 a limit was exceeded, 6 the output would lack data of the\n"
      "mesh (--strict), 7 repair salvaged the undamaged parts, and some data is missing.");
  std::vector<std::pair<CLI::App*, Command*>> added;
  std::vector<std::string> names = {"help", "version"};
  for (const auto& command : commands) {
    added.emplace_back(command->add_to(app), command.get());
    names.push_back(added.back().first->get_name());
  }
  std::vector<std::string> words = words_of(argc, argv, app);
  const std::string& first = words.back();
  if (!first.starts_with('-') && std::find(names.begin(), names.end(), first) == names.end()) {
    const std::string instead = is_file(first) ? "; did you mean shm compress " + first + "?"
                                               : meant(nearest_word(first, names));
    std::fprintf(stderr, "shm: there is no command %s%s (see shm --help)\n", first.c_str(),
                 instead.c_str());
    return kWrongUse;
  }
  try {
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    // True if the user asked for help or the version.
    const bool asked = error.get_exit_code() == 0;
    if (asked) app.exit(error, argc == 1 ? std::cerr : std::cout);
    if (!asked) std::fprintf(stderr, "shm: %s\n", complaint(app, error).c_str());
    return asked && argc > 1 ? kDone : kWrongUse;
  }
  for (const auto& [parsed, command] : added)
    if (parsed->parsed()) {
      chosen = command;
      auto* const of_files = dynamic_cast<FileCommand*>(command);
      if (of_files != nullptr && !of_files->files.empty()) return run_on_files(*of_files);
      command->input = standard_or(command->input, STDIN_FILENO);
      command->output = standard_or(command->output, STDOUT_FILENO);
      check_places(command->places(), command->force);
      return command->run();
    }
  return kWrongUse;
}

}  // namespace

int run_tool(Commands (*commands)(), int argc, char** argv) noexcept {
  Commands all;
  Command* chosen = nullptr;
  return reported(chosen, [&] {
    all = commands();
    const int code = parse_and_run(all, argc, argv, chosen);
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      throw Failure(ErrorCode::output, "cannot be written", "standard output");
    return code;
  });
}

}  // namespace shm::converters
