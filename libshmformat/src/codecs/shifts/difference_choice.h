// Difference choice: chooses the factors that predict the values of a group best. Only the encoder
// uses it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codecs/shifts/differences.h"

namespace shm {

/// The values of a group, and the state before the group.
struct GroupIndices {
  std::span<const std::uint64_t> numbers;  ///< vertex or cell number of each element

  /// Indices as unsigned words, by component and element
  std::span<const std::vector<std::uint64_t>> values;
  std::span<const std::uint64_t> ring;  ///< states before the group, by number and component
  std::size_t ring_stride = 0;  ///< distance between the states of consecutive numbers, in words

  std::int64_t index(std::size_t component, std::size_t element) const {
    return static_cast<std::int64_t>(values[component][element]);
  }
};

/// Returns factors along lags from `lags`. Returns no factors if no combination improves the
/// prediction. `known`: numbers known before the group.
std::vector<Factor> choose_factors(ScalarType type, DomainKind kind, const GroupIndices& group,
                                   const KnownNumbers& known, std::span<const std::uint32_t> lags);

}  // namespace shm
