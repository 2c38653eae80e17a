// The page that man shows of a tool, made of the help of all its commands.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace shm::converters {

// In roff, with the macros of man.
std::string manual_page(const CLI::App& tool);

}  // namespace shm::converters
