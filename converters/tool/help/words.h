// Finds known words that resemble a mistyped word of the command line.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace shm::converters {

// Returns the word of `known` that has the fewest typing errors compared with `word` (a letter
// added, missing or replaced, or two letters exchanged); the first one if several have equally few.
// Returns an empty string if there is more than one error per three letters.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

}  // namespace shm::converters
