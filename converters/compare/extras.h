// Finds the differences between the extras of two meshes of the same format.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/stored_value.h"
#include "compare/diff.h"
#include "mesh/coding_order.h"

namespace shm::converters {

// Returns pointers to the extras, sorted by key. Extras with equal keys keep their order,
// because the order of extras is significant only among equal keys.
std::vector<const Extra*> sorted_by_key(const std::vector<Extra>& extras);

// Returns a description of the shape, type and references of an extra, such as "[3 x 2] int32
// vertices".
std::string kind_text(const Extra& extra);

struct ExtrasComparison {
  std::function<bool(const std::string& key)> is_ignored;
  // maps vertex and cell numbers of A to those of B; empty if both meshes use the same numbers
  Renumbering to_b;
  bool in_any_order = false;  // true: ignore the order of members of sets
  Accuracy accuracy;  // tolerance of floating-point values; a relative tolerance is multiplied by
                      // the range of A's values in the extra
  std::uint64_t limit = 3;
};
std::vector<Finding> diff_extras(const std::vector<Extra>& a, const std::vector<Extra>& b,
                                 const ExtrasComparison& how);

}  // namespace shm::converters
