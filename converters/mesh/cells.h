// Cells: all cells of a mesh, for algorithms that access cells in any order. An implementation may
// renumber cells and vertices so that neighbours have nearby numbers.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

class Cells {
 public:
  // Exclusive limits: all cell numbers must be below kMostCells, and all vertex numbers below
  // kMostVertices.
  static constexpr std::uint64_t kMostCells = std::uint64_t{1} << 29;
  static constexpr std::uint64_t kMostVertices = ~std::uint32_t{0};

  virtual ~Cells() = default;
  virtual std::uint32_t size() const = 0;
  virtual std::uint64_t vertices() const = 0;
  virtual std::uint32_t block(std::uint32_t cell) const = 0;
  virtual bool one_block() const = 0;
  // Returns true if the cell is a hexahedron. Its first eight nodes are then its corners.
  virtual bool is_hexahedron(std::uint32_t cell) const = 0;
  virtual bool all_hexahedra() const = 0;
  // Returns the eight corners of a hexahedron. Precondition: is_hexahedron(cell) is true.
  virtual std::array<std::uint32_t, 8> hexahedron(std::uint32_t cell) const = 0;
  // Returns all nodes of a cell. The result is valid until the next call.
  virtual std::span<const std::uint32_t> cell(std::uint32_t cell) const = 0;
  // number_of() converts a cell number of this class to the number of the same cell in the mesh.
  // with_number() is the inverse function.
  virtual std::uint32_t number_of(std::uint32_t cell) const = 0;
  virtual std::uint32_t with_number(std::uint32_t number) const = 0;
};

// Returns true if is_hexahedron() is true for all cells of the block.
inline bool holds_hexahedra(const BlockInfo& block) {
  return block.shape == CellShape::hexahedron && block.nodes_per_cell >= 8;
}

}  // namespace shm::converters
