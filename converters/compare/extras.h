// Differences between the extras of two meshes of the same format.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/stored_value.h"
#include "compare/diff.h"
#include "mesh/coding_order.h"

namespace shm::converters {

// Returns the extras sorted by key. Extras with the same key stay in their order; any other order
// of extras has no meaning. Borrows the extras.
std::vector<const Extra*> sorted_by_key(const std::vector<Extra>& extras);

// Returns a description of type, shape and references, such as "[3 x 2] int32 vertices".
std::string kind_text(const Extra& extra);

struct ExtrasComparison {
  std::function<bool(const std::string& key)> is_ignored;
  Renumbering to_b;  // numbers that A's vertices and cells have in B; empty: the same numbers
  bool in_any_order = false;  // true: members of sets, with their data, may be in any order
  Accuracy accuracy;  // tolerance of floating-point values; if relative, relative to the range of
                      // the extra in A
  std::uint64_t limit = 3;
};
std::vector<Finding> diff_extras(const std::vector<Extra>& a, const std::vector<Extra>& b,
                                 const ExtrasComparison& how);

}  // namespace shm::converters
