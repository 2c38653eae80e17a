// Finds the word that the user probably meant when a word on the command line is mistyped.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace shm::converters {

// Returns the word of `known` that differs from `word` by the fewest typing errors: a letter added,
// missing or replaced, or two letters exchanged. If several words have the same number of errors,
// returns the first of them. Returns an empty string if even the best word has more than one error
// per three letters.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

}  // namespace shm::converters
