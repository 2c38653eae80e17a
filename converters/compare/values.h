// What differs between two runs of numbers: how many, by how much, and where.
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

// Reads `count` elements from `first`.
using FetchValues = std::function<void(std::uint64_t first, std::uint64_t count, std::byte* out)>;

// Collects the differences of one thing into a Finding.
class ValueScan {
 public:
  // Elements have `components` numbers of these types.
  ValueScan(Finding& finding, std::uint32_t components, ScalarType type_a, ScalarType type_b,
            const Likeness& likeness, std::uint64_t limit)
      : finding_(&finding),
        components_(components),
        type_a_(type_a),
        type_b_(type_b),
        likeness_(likeness),
        limit_(limit) {}

  // The numbers are places in a list, which is borrowed: its strings are shown instead.
  void show_strings(const CommonStrings& strings) { strings_ = &strings; }

  // Compares `count` elements. `place(i)` is where element i is; asked only where they differ.
  using PlaceOf = std::function<DiffPlace(std::uint64_t i)>;
  void compare(const std::byte* a, const std::byte* b, std::uint64_t count, const PlaceOf& place);
  // Elements of which one side has no values: those of the other must be what stands for none, NaN
  // or zero.
  void compare_with_none(const std::byte* values, bool of_a, std::uint64_t count,
                         const PlaceOf& place);
  // Puts the largest difference in front.
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
  std::uint64_t largest_rank_ = 0;  // which of the different ones it is
};

// Smallest and largest finite value of each component.
class ValueRange {
 public:
  explicit ValueRange(std::uint32_t components);
  void add(const std::byte* values, std::uint64_t count, ScalarType type);
  double overall() const;       // over all components; 0 where there are no values
  double largest_side() const;  // of any component

 private:
  std::vector<double> minimum_, maximum_;
};

}  // namespace shm::converters
