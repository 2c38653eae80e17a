#include "tool/help/manual.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <string>
#include <vector>

namespace shm::converters {
namespace {

// Escapes text so that roff shows it literally. In particular, roff would interpret a line that
// begins with a dot or a quote as a request.
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

// Returns roff source that prints lines as they are, without joining and wrapping them.
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

// Returns the synopsis of a command. Operands in brackets are optional.
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

std::string description_text(const CLI::App& command) {
  const std::string description = command.get_description();
  return literal(description) + (description.ends_with('.') ? "\n" : ".\n");
}

std::string options_text(const CLI::App& command) {
  std::string text;
  for (const CLI::Option* option : command.get_options()) text += option_text(*option);
  return text;
}

std::string command_text(const CLI::App& command) {
  return ".SS " + command.get_name() + "\n" + synopsis(command) + "\n.PP\n" +
         description_text(command) + options_text(command) + block(command.get_footer());
}

// Returns the short description for the NAME section, which the programs whatis and apropos show:
// the first clause of the command's description, in lower case and without a full stop.
std::string short_text(const CLI::App& command) {
  std::string text = command.get_description() + ". ";
  std::replace(text.begin(), text.end(), '\n', ' ');
  text.resize(std::min({text.find(". "), text.find("; "), text.find(": ")}));
  text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

// Returns the EXAMPLES and NOTES sections of a page. NOTES contains the text that follows the
// examples in the help of the command.
std::string footer_text(const std::string& footer) {
  const std::string heading = "Examples:\n";
  const std::size_t end = std::min(footer.find("\n\n"), footer.size());
  std::string text = ".SH EXAMPLES\n" + block(footer.substr(heading.size(), end - heading.size()));
  if (end < footer.size()) text += ".SH NOTES\n" + block(footer.substr(end + 2));
  return text;
}

std::string head(const CLI::App& tool, const std::string& name, const std::string& what) {
  std::string title = name;
  for (char& c : title) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return ".TH " + title + " 1 \"\" \"" + tool.version() + "\" \"User commands\"\n.SH NAME\n" +
         literal(name) + " \\- " + literal(what) + "\n.SH SYNOPSIS\n";
}

// Returns a reference to a manual page, such as "shm(1)".
std::string page(const std::string& name, int section) {
  return bold(name) + "(" + std::to_string(section) + ")";
}

}  // namespace

std::string manual_page(const CLI::App& tool) {
  const auto commands = tool.get_subcommands([](const CLI::App*) { return true; });
  std::string text = head(tool, "shm", "hexahedral meshes with their data, several times smaller");
  for (const CLI::App* command : commands) text += synopsis(*command) + "\n.br\n";
  text += bold("shm --help") + " | " + bold("shm --version") + "\n.SH COMMANDS\n";
  for (const CLI::App* command : commands) text += command_text(*command);
  text += ".SH EXIT CODES\n" + literal(tool.get_footer()) + "\n.SH SEE ALSO\n";
  for (const CLI::App* command : commands) text += page("shm-" + command->get_name(), 1) + ",\n";
  return text + page("shm", 5) +
         "; docs/tool.md and spec/shm_format.md, which are installed with the library.\n";
}

std::string manual_page(const CLI::App& tool, const CLI::App& command) {
  return head(tool, "shm-" + command.get_name(), short_text(command)) + synopsis(command) +
         "\n.SH DESCRIPTION\n" + description_text(command) + ".SH OPTIONS\n" +
         options_text(command) + footer_text(command.get_footer()) + ".SH EXIT CODES\n" +
         literal(tool.get_footer()) + "\n.SH SEE ALSO\n" + page("shm", 1) + ", " + page("shm", 5) +
         "\n";
}

}  // namespace shm::converters
