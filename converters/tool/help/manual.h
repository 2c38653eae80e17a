// Manual pages of a tool: one with the help of all its commands, and one for each command.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace shm::converters {

// Return a page as roff source that uses the man macros.
std::string manual_page(const CLI::App& tool);
std::string manual_page(const CLI::App& tool, const CLI::App& command);

}  // namespace shm::converters
