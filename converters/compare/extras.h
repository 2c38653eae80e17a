// Differences between the extras of two meshes of the same format.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/stored_value.h"
#include "compare/diff.h"
#include "mesh/coding_order.h"

namespace shm::converters {

// Returns the extras sorted by key. The order of extras has no meaning, except among those with the
// same key. Borrows the extras.
std::vector<const Extra*> sorted_by_key(const std::vector<Extra>& extras);

// Returns a description such as "[3 x 2] int32 vertices".
std::string kind_text(const Extra& extra);

struct ExtrasComparison {
  std::function<bool(const std::string& key)> is_ignored;
  Renumbering to_b;           // numbers of A's vertices and cells in B; empty: the same
  bool in_any_order = false;  // of the members of sets, with their data
  Accuracy accuracy;          // of floating-point values; relative to the range of the extra in A
  std::uint64_t limit = 3;
};
std::vector<Finding> diff_extras(const std::vector<Extra>& a, const std::vector<Extra>& b,
                                 const ExtrasComparison& how);

}  // namespace shm::converters
