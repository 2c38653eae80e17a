// Completion scripts for shells, generated from the options of the tool.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace shm::converters {

// bash_completion() and zsh_completion() return the script that the shell needs to complete command
// lines of the tool.
std::string bash_completion(const CLI::App& tool);
std::string zsh_completion(const CLI::App& tool);

}  // namespace shm::converters
