// Cells: all cells of a mesh, for those who must see them in any order. They count them in an order
// of their own, in which neighbours may have near numbers; so they may know vertices too.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

class Cells {
 public:
  // Cells and vertices must stay below this.
  static constexpr std::uint64_t kMostCells = std::uint64_t{1} << 29;
  static constexpr std::uint64_t kMostVertices = ~std::uint32_t{0};

  virtual ~Cells() = default;
  virtual std::uint32_t size() const = 0;
  virtual std::uint64_t vertices() const = 0;
  virtual std::uint32_t block(std::uint32_t cell) const = 0;
  virtual bool one_block() const = 0;
  // Has six faces between its first eight corners.
  virtual bool is_hexahedron(std::uint32_t cell) const = 0;
  virtual bool all_hexahedra() const = 0;
  // Those corners. Must hold: it is a hexahedron.
  virtual std::array<std::uint32_t, 8> hexahedron(std::uint32_t cell) const = 0;
  // All its nodes, valid until the next call.
  virtual std::span<const std::uint32_t> cell(std::uint32_t cell) const = 0;
  // What the mesh calls a cell, and back.
  virtual std::uint32_t number_of(std::uint32_t cell) const = 0;
  virtual std::uint32_t with_number(std::uint32_t number) const = 0;
};

// Whether cells of a block are hexahedra here.
inline bool holds_hexahedra(const BlockInfo& block) {
  return block.shape == CellShape::hexahedron && block.nodes_per_cell >= 8;
}

}  // namespace shm::converters
