// What shells complete of command lines of a tool, made of the options that there are.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace shm::converters {

// Scripts that define what bash and zsh offer for the next word.
std::string bash_completion(const CLI::App& tool);
std::string zsh_completion(const CLI::App& tool);

}  // namespace shm::converters
