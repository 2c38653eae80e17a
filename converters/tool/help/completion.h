// Completion scripts for shells, generated from the options of the tool.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace shm::converters {

// Return scripts by which bash and zsh complete the next word of a command line.
std::string bash_completion(const CLI::App& tool);
std::string zsh_completion(const CLI::App& tool);

}  // namespace shm::converters
