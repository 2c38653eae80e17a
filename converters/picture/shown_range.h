// The range of values that colours represent.
#pragma once

#include <optional>
#include <span>

namespace shm::converters {

struct ShownRange {
  double least = 0, greatest = 0;  // limits of the range; both are finite
};

// Returns the range of the finite values, or nothing if no value is finite.
std::optional<ShownRange> range_of(std::span<const double> values);

// Returns the relative position of a value in the range: 0 for the least value, 1 for the greatest
// value. Returns 0.5 if the least and the greatest value are equal, and NaN if the value is not
// finite.
double share_of(double value, const std::optional<ShownRange>& range);

}  // namespace shm::converters
