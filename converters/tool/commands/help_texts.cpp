#include "tool/commands/help_texts.h"

#include <CLI/CLI.hpp>

#include "tool/commands/options.h"
#include "tool/help/completion.h"
#include "tool/help/manual.h"

namespace shm::converters {

CLI::App* CompletionCommand::add_to(CLI::App& tool) {
  all = &tool;
  CLI::App* command =
      tool.add_subcommand("completion", "Print what a shell completes of command lines of shm");
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
      tool.add_subcommand("manual", "Print what man shm shows: the help of all commands");
  command->footer("Examples:\n  shm manual | man -l -");
  return command;
}

ExitCode ManualCommand::run() {
  print(*this, manual_page(*all));
  return kDone;
}

}  // namespace shm::converters
