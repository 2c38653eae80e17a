#include "tool/help/manual.h"

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace shm::converters {
namespace {

// As roff shows it literally: lines that begin with a dot or a quote are no requests.
std::string literal(const std::string& text) {
  std::string roff;
  char before = '\n';
  for (const char c : text) {
    if (before == '\n' && (c == '.' || c == '\'')) roff += "\\&";
    if (c == '\\')
      roff += "\\e";
    else if (c == '-')
      roff += "\\-";
    else if (c == '\'')
      roff += "\\(aq";
    else
      roff += c;
    before = c;
  }
  return roff;
}

std::string bold(const std::string& text) { return "\\fB" + literal(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + literal(text) + "\\fR"; }

// Lines as they stand.
std::string block(const std::string& lines) { return ".PP\n.nf\n" + literal(lines) + "\n.fi\n"; }

std::string option_text(const CLI::Option& option) {
  std::string names;
  for (const std::string& name : option.get_snames())
    names += (names.empty() ? "" : ", ") + bold("-" + name);
  for (const std::string& name : option.get_lnames())
    names += (names.empty() ? "" : ", ") + bold("--" + name);
  if (option.get_positional()) names = italic(option.get_name());
  const std::string type = option.get_type_name();
  if (!option.get_positional() && option.get_expected_max() > 0 && !type.empty())
    names += " " + italic(type);
  return ".TP\n" + names + "\n" + literal(option.get_description()) + "\n";
}

// The operands of a command: those in brackets may be left out.
std::string synopsis(const CLI::App& command) {
  std::string line = bold("shm " + command.get_name()) + " [" + italic("OPTIONS") + "]";
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional()) continue;
    const bool many = option->get_expected_max() > 1;
    const std::string name = italic(option->get_name()) + (many ? "..." : "");
    line += option->get_required() ? " " + name : " [" + name + "]";
  }
  return line;
}

std::string command_text(const CLI::App& command) {
  const std::string description = command.get_description();
  std::string text = ".SS " + command.get_name() + "\n" + synopsis(command) + "\n.PP\n" +
                     literal(description) + (description.ends_with('.') ? "\n" : ".\n");
  for (const CLI::Option* option : command.get_options()) text += option_text(*option);
  return text + block(command.get_footer());
}

}  // namespace

std::string manual_page(const CLI::App& tool) {
  const auto commands = tool.get_subcommands([](const CLI::App*) { return true; });
  std::string text = ".TH SHM 1 \"\" \"" + tool.version() +
                     "\" \"User commands\"\n.SH NAME\nshm \\- hexahedral meshes with "
                     "their data, several times smaller\n.SH SYNOPSIS\n";
  for (const CLI::App* command : commands) text += synopsis(*command) + "\n.br\n";
  text += bold("shm --help") + " | " + bold("shm --version") + "\n.SH COMMANDS\n";
  for (const CLI::App* command : commands) text += command_text(*command);
  text += ".SH EXIT CODES\n" + literal(tool.get_footer()) + "\n.SH SEE ALSO\n" +
          "docs/tool.md and spec/shm_format.md, which are installed with the library.\n";
  return text;
}

}  // namespace shm::converters
