// Difference choice: which factors predict the values of a group best. Encoder only.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shifts/differences.h"

namespace shm {

/// The values of a group, and what came before it.
struct GroupIndices {
  std::span<const std::uint64_t> numbers;              ///< of the elements
  std::span<const std::vector<std::uint64_t>> values;  ///< by component; signed, by their bits
  std::span<const std::uint64_t> ring;                 ///< by number and component
  std::size_t ring_stride = 0;                         ///< from one number to the next

  std::int64_t index(std::size_t component, std::size_t element) const {
    return static_cast<std::int64_t>(values[component][element]);
  }
};

/// Of products of differences along these lags; none where nothing helps. `known` before the group.
std::vector<Factor> choose_factors(ScalarType type, DomainKind kind, const GroupIndices& group,
                                   const KnownNumbers& known, std::span<const std::uint32_t> lags);

}  // namespace shm
