// The pages that man shows of a tool: one made of the help of all its commands, and one of each.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace shm::converters {

// In roff, with the macros of man.
std::string manual_page(const CLI::App& tool);
std::string manual_page(const CLI::App& tool, const CLI::App& command);

}  // namespace shm::converters
