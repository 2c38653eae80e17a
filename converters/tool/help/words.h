// Words of the command line that nobody knows, and which ones may have been meant.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace shm::converters {

// The one of `known` that `word` turns into by the fewest slips of the hand (a letter too many, too
// few, another one, or two exchanged), the first of equals; empty where that takes more than one
// for each three letters.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

}  // namespace shm::converters
