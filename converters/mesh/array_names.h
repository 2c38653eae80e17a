// Selects arrays by name, as options such as --array do.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

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

// Returns the position of the last colon in `text` that no backslash precedes, or npos.
std::size_t last_colon(const std::string& text);

}  // namespace shm::converters
