#include "tool/help/completion.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <vector>

namespace shm::converters {
namespace {

struct CompletedOption {
  std::vector<std::string> names;  // names of the option, with their dashes
  std::vector<std::string> words;  // possible values of the option; if empty, any value
  bool has_value = false;
  std::string help;  // first line of the help text
};

struct CompletedCommand {
  std::string name, help;
  std::vector<CompletedOption> options;
  // Possible operands of the command; if empty, the operands are files.
  std::vector<std::string> words;
};

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

// Splits the type of an option in the help, such as "keep|stream|free", into words. Returns no
// words if the type is not a list.
std::vector<std::string> words_of_type(const std::string& type) {
  std::vector<std::string> words;
  if (type.find('|') == std::string::npos) return words;
  for (std::size_t begin = 0; begin <= type.size();) {
    const std::size_t end = std::min(type.find('|', begin), type.size());
    words.push_back(type.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

CompletedCommand completed(const CLI::App& command) {
  CompletedCommand entry{command.get_name(), first_line(command.get_description()), {}, {}};
  for (const CLI::Option* option : command.get_options()) {
    const auto words = words_of_type(option->get_type_name());
    if (option->get_positional()) {
      entry.words.insert(entry.words.end(), words.begin(), words.end());
      continue;
    }
    CompletedOption made;
    for (const std::string& name : option->get_snames()) made.names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) made.names.push_back("--" + name);
    made.words = words;
    made.has_value = option->get_expected_max() > 0;
    made.help = first_line(option->get_description());
    entry.options.push_back(std::move(made));
  }
  return entry;
}

std::vector<CompletedCommand> completed_commands(const CLI::App& tool) {
  std::vector<CompletedCommand> commands;
  for (const CLI::App* command : tool.get_subcommands([](const CLI::App*) { return true; }))
    commands.push_back(completed(*command));
  return commands;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

std::string all_names(const CompletedCommand& command) {
  std::vector<std::string> names;
  for (const CompletedOption& option : command.options)
    names.insert(names.end(), option.names.begin(), option.names.end());
  return joined(names, " ");
}

std::string for_bash(const CompletedCommand& itself,
                     const std::vector<CompletedCommand>& commands) {
  std::vector<std::string> names;
  for (const CompletedCommand& command : commands) names.push_back(command.name);
  const std::string all = joined(names, " ");
  std::string text =
      "# Completion of shm for bash, written by: shm completion bash\n"
      "_shm() {\n"
      "  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} words=\n"
      "  COMPREPLY=()\n"
      "  if [[ $current == = ]]; then current=; fi  # --option=word is three words here\n"
      "  if [[ $before == = ]]; then before=${COMP_WORDS[COMP_CWORD - 2]}; fi\n"
      "  if ((COMP_CWORD == 1)); then\n"
      "    words=\"help version " +
      all + " " + all_names(itself) +
      "\"\n"
      "  else\n"
      "    case ${COMP_WORDS[1]}:$before in\n"
      "      help:help) words=\"" +
      all + "\" ;;\n";
  for (const CompletedCommand& command : commands) {
    for (const CompletedOption& option : command.options) {
      if (!option.has_value) continue;
      std::vector<std::string> places;
      for (const std::string& name : option.names) places.push_back(command.name + ":" + name);
      text += "      " + joined(places, " | ") + ") " +
              (option.words.empty() ? "return" : "words=\"" + joined(option.words, " ") + "\"") +
              " ;;\n";
    }
    text += "      " + command.name + ":*)\n        ";
    if (command.words.empty())
      text += "[[ $current == -* ]] || return\n        words=\"" + all_names(command) + "\" ;;\n";
    else
      text += "words=\"" + joined(command.words, " ") + " " + all_names(command) + "\" ;;\n";
  }
  return text +
         "    esac\n"
         "  fi\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
         "}\n"
         "complete -o default -F _shm shm\n";
}

// Escapes help text for a zsh script. Single quotes are escaped because the script encloses the
// text in single quotes. Colons and brackets are escaped because the zsh functions _arguments and
// _describe would split the text at them.
std::string for_zsh(const std::string& help) {
  std::string text;
  for (const char c : help)
    if (c == '\'')
      text += "'\\''";
    else if (c == ':' || c == '[' || c == ']' || c == '\\')
      text += std::string("\\") + c;
    else
      text += c;
  return text;
}

std::string argument_for_zsh(const CompletedOption& option) {
  const std::string value = !option.has_value      ? ""
                            : option.words.empty() ? ":value:_files"
                                                   : ":value:(" + joined(option.words, " ") + ")";
  const std::string rest = "[" + for_zsh(option.help) + "]" + value + "'";
  if (option.names.size() == 1) return "'" + option.names[0] + rest;
  const std::string names = joined(option.names, ",");
  return "'(" + joined(option.names, " ") + ")'{" + names + "}'" + rest;
}

std::string for_zsh(const std::vector<CompletedCommand>& commands) {
  std::string text =
      "#compdef shm\n"
      "# Completion of shm for zsh, written by: shm completion zsh\n"
      "_shm() {\n"
      "  local -a commands=(\n"
      "    'help:The options of shm, or of a command'\n"
      "    'version:The version of shm'\n";
  for (const CompletedCommand& command : commands)
    text += "    '" + command.name + ":" + for_zsh(command.help) + "'\n";
  text +=
      "  )\n"
      "  if ((CURRENT == 2)); then\n"
      "    _describe command commands\n"
      "    return\n"
      "  fi\n"
      "  shift words\n"
      "  ((CURRENT--))\n"
      "  case ${words[1]} in\n"
      "    help) _describe command commands ;;\n";
  for (const CompletedCommand& command : commands) {
    text += "    " + command.name + ")\n      _arguments";
    for (const CompletedOption& option : command.options)
      text += " \\\n        " + argument_for_zsh(option);
    text += std::string(" \\\n        ") +
            (command.words.empty() ? "'*:file:_files'"
                                   : "'*:word:(" + joined(command.words, " ") + ")'") +
            " ;;\n";
  }
  return text +
         "  esac\n"
         "}\n"
         "_shm \"$@\"\n";
}

}  // namespace

std::string bash_completion(const CLI::App& tool) {
  return for_bash(completed(tool), completed_commands(tool));
}

std::string zsh_completion(const CLI::App& tool) { return for_zsh(completed_commands(tool)); }

}  // namespace shm::converters
