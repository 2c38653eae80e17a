// Selects arrays by name, as options such as --array do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

// Formats a list of items, such as "1 'left', 2". If there are more than 40 items, only the first
// 40 are listed, followed by the total number of items.
template <class Items, class Name>
std::string listed(const Items& items, Name&& name) {
  constexpr std::size_t kMost = 40;
  std::string text;
  for (std::size_t i = 0; i < items.size() && i < kMost; ++i)
    text += (i > 0 ? ", " : "") + name(items[i]);
  if (items.size() > kMost) text += ", ... (" + std::to_string(items.size()) + ")";
  return text.empty() ? "none" : text;
}

// Returns "ID 'NAME'", or "ID" if the name is empty.
inline std::string with_name(std::int64_t id, const std::string& name) {
  return name.empty() ? std::to_string(id) : std::to_string(id) + " '" + name + "'";
}

// Returns "LOCATION/NAME", e.g. "point/NAME" (see location_name()).
std::string array_label(const ArrayInfo& array);

// Returns the path of each array: "LOCATION/NAME", with the suffix "#2", "#3", ... if several
// arrays at this location have the same name.
std::vector<std::string> paths_of(const Schema& schema);

// Arrays that a name selects.
struct CalledArrays {
  std::vector<std::size_t> arrays;
  bool is_pattern = false;  // true if the name contains wildcards
};

// Returns the arrays that `name` selects: the array with this path; otherwise the array with this
// name; otherwise all arrays whose path or name matches. In a pattern, `*` matches any
// characters, `?` one character, and a backslash before a character means that character. Throws
// Failure (misuse), with `option` in the message, if no array matches, or if several arrays have
// the name.
CalledArrays arrays_called(const Schema& schema, const std::string& name,
                           const std::string& option);

// Returns the indices of the blocks with this name, or with this id if no block has the name.
// Throws Failure (misuse), with `option` in the message, if no block matches.
std::vector<std::uint32_t> blocks_called(const std::vector<BlockInfo>& blocks,
                                         const std::string& name, const std::string& option);

// Returns the position of the last `character` in `text` that no backslash precedes, or npos.
std::size_t last_unescaped(const std::string& text, char character);

// Returns the text without the backslashes that precede other characters.
std::string unescaped(std::string_view text);

}  // namespace shm::converters
