// DelayBuffer: holds cells back, so that a cell adjacent to the most recently coded cell can be
// coded next. SpiralReorderer decides which waiting cell comes next.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/spiral_reorderer.h"

namespace shm {

class DelayBuffer {
 public:
  struct Cell {
    std::uint64_t number = 0;
    std::uint32_t block = 0;
    std::vector<std::uint32_t> entries;  // entries in the vertex table
    std::vector<std::byte> data;
  };
  using Corners = SpiralReorderer::Corners;

  explicit DelayBuffer(std::size_t capacity) : capacity_(capacity) {}

  bool empty() const { return order_.waiting() == 0; }
  /// Returns true if the number of waiting cells exceeds the capacity.
  bool is_overfull() const { return order_.waiting() > capacity_; }
  /// Adds a cell. `corners`: if the cell is a hexahedron, the vertex numbers of its corners. They
  /// are needed in addition to `entries`: an entry of the vertex table may be reused for another
  /// vertex, so two cells with the same entry may have different vertices.
  void push(std::uint64_t number, std::uint32_t block, std::span<const std::uint32_t> entries,
            std::span<const std::byte> data, const std::optional<Corners>& corners);
  /// Removes and returns the next cell in coding order. The result is valid until the next call to
  /// push(). Precondition: the buffer is not empty.
  const Cell& pop();
  /// Forgets which cell was returned most recently. Call it between segments. Precondition: the
  /// buffer is empty.
  void begin_segment() { order_ = {}; }

 private:
  std::size_t capacity_;
  SpiralReorderer order_;  // its handles are indices of cells_
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> free_;
};

}  // namespace shm
