// The range of values that colours represent.
#pragma once

#include <optional>
#include <span>

namespace shm::converters {

struct ShownRange {
  double least = 0, greatest = 0;  // limits of the range; both are finite
};

// Returns the range of the finite values. Returns nothing if no finite values exist.
std::optional<ShownRange> range_of(std::span<const double> values);

// Returns the share of a value: 0 for the least value, 1 for the greatest, 0.5 if all values are
// equal, and NaN for a value that is not finite.
double share_of(double value, const std::optional<ShownRange>& range);

}  // namespace shm::converters
