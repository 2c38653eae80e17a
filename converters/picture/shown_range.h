// The range of values that colours represent.
#pragma once

#include <optional>
#include <span>

namespace shm::converters {

struct ShownRange {
  double least = 0, greatest = 0;  // finite
};

// Range of the finite values. Nothing if there are none.
std::optional<ShownRange> range_of(std::span<const double> values);

// Returns 0 for the least value, 1 for the greatest, and NaN for values that are not finite. If all
// values are equal, returns 0.5.
double share_of(double value, const std::optional<ShownRange>& range);

}  // namespace shm::converters
