#include "picture/shown_range.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace shm::converters {

std::optional<ShownRange> range_of(std::span<const double> values) {
  ShownRange range{std::numeric_limits<double>::infinity(),
                   -std::numeric_limits<double>::infinity()};
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    range.least = std::min(range.least, value);
    range.greatest = std::max(range.greatest, value);
  }
  if (!(range.least <= range.greatest)) return std::nullopt;
  return range;
}

double share_of(double value, const std::optional<ShownRange>& range) {
  if (!range || !std::isfinite(value)) return std::numeric_limits<double>::quiet_NaN();
  // The difference of two very large numbers may be infinite. Only in this case, halve the numbers
  // first, because half of a very small number may be 0.
  const double whole = range->greatest - range->least;
  if (std::isfinite(whole)) return whole == 0 ? .5 : (value - range->least) / whole;
  return (value / 2 - range->least / 2) / (range->greatest / 2 - range->least / 2);
}

}  // namespace shm::converters
