// From which to which value colours go.
#pragma once

#include <optional>
#include <span>

namespace shm::converters {

struct ShownRange {
  double least = 0, greatest = 0;  // finite
};

// Of the values that are finite; nothing where there are none.
std::optional<ShownRange> range_of(std::span<const double> values);

// 0 for the least value, 1 for the greatest; NaN for what is not finite. Of one value: the middle.
double share_of(double value, const std::optional<ShownRange>& range);

}  // namespace shm::converters
