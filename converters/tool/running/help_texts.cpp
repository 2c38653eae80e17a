#include "tool/running/help_texts.h"

#include <CLI/CLI.hpp>

#include "tool/help/completion.h"
#include "tool/help/manual.h"
#include "tool/running/options.h"

namespace shm::converters {

CLI::App* CompletionCommand::add_to(CLI::App& tool) {
  all = &tool;
  CLI::App* command =
      tool.add_subcommand("completion", "Print the completion script of shm for a shell");
  command->footer(
      "Examples:\n"
      "  shm completion bash > ~/.local/share/bash-completion/completions/shm\n"
      "  shm completion zsh > _shm                in a folder of $fpath");
  command->add_option("SHELL", shell, "bash or zsh")
      ->required()
      ->check(one_of({"bash", "zsh"}))
      ->type_name("bash|zsh");
  return command;
}

ExitCode CompletionCommand::run() {
  print(*this, shell == "bash" ? bash_completion(*all) : zsh_completion(*all));
  return kDone;
}

CLI::App* ManualCommand::add_to(CLI::App& tool) {
  all = &tool;
  CLI::App* command =
      tool.add_subcommand("manual", "Print the manual page of shm, or of one of its commands");
  command->footer(
      "Examples:\n"
      "  shm manual | man -l -\n"
      "  shm manual compress | man -l -           the page of one command, as man shm-compress");
  // `tool` already contains all commands, because this command is added last.
  std::vector<std::string> names;
  std::string type;
  for (const CLI::App* other : tool.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(other->get_name());
    type += (type.empty() ? "" : "|") + names.back();
  }
  command->add_option("COMMAND", one, "Print the page of this command only")
      ->check(one_of(names))
      ->type_name(type);
  return command;
}

ExitCode ManualCommand::run() {
  print(*this, one.empty() ? manual_page(*all) : manual_page(*all, *all->get_subcommand(one)));
  return kDone;
}

}  // namespace shm::converters
