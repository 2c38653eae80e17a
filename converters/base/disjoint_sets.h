// DisjointSets: union-find. Partitions the numbers from 0 to size - 1 into disjoint sets, which can
// be merged.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace shm::converters {

class DisjointSets {
 public:
  // Creates one set for each number below `size`.
  explicit DisjointSets(std::size_t size = 0) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }

  // Returns the lowest number in the set of `x`.
  std::uint32_t first(std::uint32_t x) {
    while (parent_[x] != x) x = parent_[x] = parent_[parent_[x]];
    return x;
  }
  void unite(std::uint32_t x, std::uint32_t y) {
    x = first(x);
    y = first(y);
    parent_[std::max(x, y)] = std::min(x, y);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace shm::converters
