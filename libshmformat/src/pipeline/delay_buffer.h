// DelayBuffer: holds cells back so that a cell adjacent to the last one can be coded first.
// SpiralReorderer chooses the cell.
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
  /// Returns true if more cells wait than the capacity allows.
  bool is_overfull() const { return order_.waiting() > capacity_; }
  /// Adds a cell. `corners`: the vertex numbers of the corners, if the cell is a hexahedron.
  /// Entries would not do: an entry may soon be reused for another vertex, which would look like a
  /// neighbour.
  void push(std::uint64_t number, std::uint32_t block, std::span<const std::uint32_t> entries,
            std::span<const std::byte> data, const std::optional<Corners>& corners);
  /// Removes the cell that comes next. The result is valid until the next call of push(). Must
  /// hold: the buffer is not empty.
  const Cell& pop();
  /// Forgets the last cell. Call it between segments. Must hold: the buffer is empty.
  void begin_segment() { order_ = {}; }

 private:
  std::size_t capacity_;
  SpiralReorderer order_;  // its handles are indices of cells_
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> free_;
};

}  // namespace shm
