// Generates the manual pages of a tool: one page with the help of all commands, and one page for
// each command.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace shm::converters {

// Both functions return a manual page as roff source that uses the man macros: the page of the
// whole tool, or the page of one command.
std::string manual_page(const CLI::App& tool);
std::string manual_page(const CLI::App& tool, const CLI::App& command);

}  // namespace shm::converters
