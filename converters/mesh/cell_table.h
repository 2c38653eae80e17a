// CellTable: all cells of a mesh in memory, with 32-bit numbers, for algorithms that access cells
// in any order. Needs 32 bytes per hexahedron, and 4 more if the mesh has more than one block.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "mesh/cells.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

class CellTable final : public Cells {
 public:
  CellTable() = default;
  explicit CellTable(const MeshInfo& info);
  // Reads all cells. Returns nothing if the mesh has too many cells or vertices for 32-bit numbers
  // (see Cells).
  static std::optional<CellTable> read(MeshSource& mesh, const Progress& progress = {});

  void append(std::uint32_t block, std::span<const std::uint32_t> corners);

  std::uint32_t size() const override { return size_; }
  std::uint64_t vertices() const override { return vertices_; }
  std::uint32_t block(std::uint32_t cell) const override {
    return blocks_.empty() ? 0 : blocks_[cell];
  }
  bool one_block() const override { return blocks_.empty(); }
  // Returns the nodes of a cell. The span is valid as long as the table exists.
  std::span<const std::uint32_t> cell(std::uint32_t cell) const override {
    const std::uint64_t begin = begin_.empty() ? cell * uniform_ : begin_[cell];
    const std::uint64_t end = begin_.empty() ? begin + uniform_ : begin_[cell + 1];
    return std::span(corners_).subspan(begin, end - begin);
  }
  bool is_hexahedron(std::uint32_t cell) const override { return hexahedral_[block(cell)]; }
  bool all_hexahedra() const override {
    return std::find(hexahedral_.begin(), hexahedral_.end(), false) == hexahedral_.end();
  }
  std::array<std::uint32_t, 8> hexahedron(std::uint32_t cell) const override {
    std::array<std::uint32_t, 8> corners;
    std::copy_n(this->cell(cell).begin(), 8, corners.begin());
    return corners;
  }
  // Cells have the same numbers in the table and in the mesh.
  std::uint32_t number_of(std::uint32_t cell) const override { return cell; }
  std::uint32_t with_number(std::uint32_t number) const override { return number; }

 private:
  std::uint64_t vertices_ = 0;
  std::uint32_t size_ = 0;
  std::vector<std::uint32_t> corners_;
  std::uint64_t uniform_ = 0;  // number of nodes of every cell, if it is the same for all cells
  // Offset of each cell in corners_, followed by the size of corners_. Empty if all cells have
  // uniform_ nodes.
  std::vector<std::uint64_t> begin_;
  std::vector<std::uint32_t> blocks_;  // block of each cell; empty if there is only one block
  std::vector<bool> hexahedral_;       // indexed by block
};

}  // namespace shm::converters
