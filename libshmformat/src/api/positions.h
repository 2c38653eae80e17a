// Function that inverts a permutation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace shm {

/// Returns the inverse permutation of `order`: positions[order[i]] == i. Returns an empty vector
/// unless `order` contains each number from 0 to order.size() - 1 exactly once.
inline std::vector<std::uint64_t> positions_in(const std::vector<std::uint64_t>& order) {
  constexpr std::uint64_t kUnset = ~std::uint64_t{0};
  std::vector<std::uint64_t> positions(order.size(), kUnset);
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (order[i] >= order.size()) return {};
    std::uint64_t& position = positions[static_cast<std::size_t>(order[i])];
    if (position != kUnset) return {};
    position = i;
  }
  return positions;
}

}  // namespace shm
