// Finds known words that resemble a mistyped word of the command line.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace shm::converters {

// Returns the word of `known` that differs from `word` by the fewest typing errors: a letter added,
// missing or replaced, or two letters exchanged. If several words have equally few errors, returns
// the first of them. Returns an empty string if there is more than one error per three letters.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

}  // namespace shm::converters
