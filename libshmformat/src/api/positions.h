// Where each number stands in an order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace shm {

/// positions[number] = where `number` stands in `order`; empty when `order` is not all numbers from
/// 0 on, each once.
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
