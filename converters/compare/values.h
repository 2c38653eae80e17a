// Finds the differences between two sequences of values: how many, how large and where.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/stored_value.h"
#include "compare/diff.h"
#include "compare/strings.h"

namespace shm::converters {

// Reads `count` elements, starting with element `first`.
using FetchValues = std::function<void(std::uint64_t first, std::uint64_t count, std::byte* out)>;

// Compares the values of one item and collects the differences in a Finding.
class ValueScan {
 public:
  // Each element has `components` values. The type of the values is `type_a` in mesh A, and
  // `type_b` in mesh B.
  ValueScan(Finding& finding, std::uint32_t components, ScalarType type_a, ScalarType type_b,
            const Likeness& likeness, std::uint64_t limit)
      : finding_(&finding),
        components_(components),
        type_a_(type_a),
        type_b_(type_b),
        likeness_(likeness),
        limit_(limit) {}

  // Declares that the values are indices into the list `strings`, which is borrowed. Findings then
  // contain the strings instead of the indices.
  void show_strings(const CommonStrings& strings) { strings_ = &strings; }

  // Compares `count` elements. `place(i)` returns the place of element i; it is called only for
  // elements that differ.
  using PlaceOf = std::function<DiffPlace(std::uint64_t i)>;
  void compare(const std::byte* a, const std::byte* b, std::uint64_t count, const PlaceOf& place);
  // Checks the values of elements that have no value in the other mesh. Each value other than NaN
  // and zero counts as a difference.
  void compare_with_none(const std::byte* values, bool of_a, std::uint64_t count,
                         const PlaceOf& place);
  // Moves the place of the largest difference to the front of the Finding's places. Call it after
  // the last comparison.
  void finish();

 private:
  void note(const PlaceOf& place, std::uint64_t element, std::uint32_t component, double distance,
            std::string value_a, std::string value_b);

  Finding* finding_;
  std::uint32_t components_;
  ScalarType type_a_, type_b_;
  Likeness likeness_;
  std::uint64_t limit_;
  const CommonStrings* strings_ = nullptr;
  std::optional<DiffPlace> largest_;
  std::uint64_t largest_rank_ = 0;  // index of the largest difference among all differences found
};

// Range of the finite values of each component.
class ValueRange {
 public:
  explicit ValueRange(std::uint32_t components);
  void add(const std::byte* values, std::uint64_t count, ScalarType type);
  double overall() const;       // range over all components; 0 if no values exist
  double largest_side() const;  // largest of the ranges of the components

 private:
  std::vector<double> minimum_, maximum_;
};

}  // namespace shm::converters
