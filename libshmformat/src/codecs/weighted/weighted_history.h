// WeightedHistory: predicts the values of a group from values of earlier steps. The reader knows
// all values of an earlier step. Therefore, the prediction can use more neighbours than predictions
// from values of the same step, which use only elements that come first in the stream.
// spec: "Weighted values"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/weighted/weighted_classes.h"

namespace shm {

class WeightedHistory {
 public:
  static constexpr std::size_t kNeighbours = 10, kMostTerms = 2 * kNeighbours + 1;
  /// Denominator of coded weights, and the largest magnitude of a coded weight. Frozen: part of the
  /// format.
  static constexpr std::int32_t kUnit = 1 << 20, kMostCoded = 1 << 26;

  /// Finds the neighbours of the covered elements of a group. `slots`: number of slots.
  [[gnu::cold]] void find_neighbours(const WeightedClasses& classes, const TiledItems& elements,
                                     std::size_t slots);
  /// Sets the values of one component at an earlier step, by element, and their trend. `trend` is
  /// empty if the group does not refer to the trend. All values are finite.
  void set_values(std::vector<double> last, std::span<const double> trend);

  using Terms = std::array<double, kMostTerms>;
  /// Returns the number of terms.
  std::size_t terms() const { return changes_.empty() ? kNeighbours : kMostTerms; }
  /// Returns the terms of an element: the differences between the values of its neighbours and its
  /// own value. With a trend, its own change follows, and the differences between the changes of
  /// its neighbours and its own change. The difference to a neighbour that does not exist is 0.
  Terms terms_of(std::size_t element) const;
  /// Returns the value of an element at the earlier step.
  double last(std::size_t element) const { return last_[element]; }
  /// Predicts all elements: the value at the earlier step, plus the sum of the terms times their
  /// weights. A prediction that is not finite becomes the value at the earlier step.
  std::vector<double> predict(std::span<const double> weights) const;

 private:
  // Of each element: the elements at terms 0 to 6, and the later elements of which this element is
  // near element 0, 1 or 2. The element itself, if the group has no such element.
  std::vector<std::array<std::uint32_t, kNeighbours>> neighbours_;
  std::vector<double> last_, changes_;
};

}  // namespace shm
