// Difference choice: chooses the factors that predict the values of a group best. Encoder only.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codecs/shifts/differences.h"

namespace shm {

/// The values of a group, and the state before the group.
struct GroupIndices {
  std::span<const std::uint64_t> numbers;              ///< of the elements
  std::span<const std::vector<std::uint64_t>> values;  ///< by component: indices, as unsigned words
  std::span<const std::uint64_t> ring;                 ///< states, by number and component
  std::size_t ring_stride = 0;                         ///< words from one number to the next

  std::int64_t index(std::size_t component, std::size_t element) const {
    return static_cast<std::int64_t>(values[component][element]);
  }
};

/// Returns factors along these lags; none if no combination helps. `known`: the numbers known
/// before the group.
std::vector<Factor> choose_factors(ScalarType type, DomainKind kind, const GroupIndices& group,
                                   const KnownNumbers& known, std::span<const std::uint32_t> lags);

}  // namespace shm
