// Difference choice: chooses the factors (pairs of a lag and an order) that predict the values of a
// group best. Only the encoder uses this code.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codecs/shifts/differences.h"

namespace shm {

/// The values of a group as indices in their domains, and the states that remain from earlier
/// groups.
struct GroupIndices {
  std::span<const std::uint64_t> numbers;  ///< vertex or cell number of each element

  /// Indices as unsigned words: one vector for each component, with one index for each element
  std::span<const std::vector<std::uint64_t>> values;
  /// States of elements of earlier groups, indexed by element number and component.
  std::span<const std::uint64_t> ring;
  std::size_t ring_stride = 0;  ///< number of words in `ring` per element number

  std::int64_t index(std::size_t component, std::size_t element) const {
    return static_cast<std::int64_t>(values[component][element]);
  }
};

/// Returns the factors that predict the values best. The lag of each factor is one of `lags`.
/// Returns no factors if no combination improves the prediction. `known`: the numbers of the
/// elements of earlier groups whose states are known.
std::vector<Factor> choose_factors(ScalarType type, DomainKind kind, const GroupIndices& group,
                                   const KnownNumbers& known, std::span<const std::uint32_t> lags);

}  // namespace shm
