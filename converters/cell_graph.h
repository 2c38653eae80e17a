// CellGraph: which hexahedra share a face, and how directions are carried across it.
// Memory: 24 bytes a cell; while it is built up to 72 more for each of 2^18 hexahedra, or for an
// eighth of them where that is more, and half a byte a vertex.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "cell_table.h"
#include "progress.h"

namespace shm::converters {

// Faces by direction: 0 and 1 lie at the ends of the first axis, 2 and 3, 4 and 5 of the others;
// `face ^ 1` is opposite.
inline constexpr std::array<std::array<std::uint8_t, 4>, 6> kFacesByDirection = {
    {{0, 3, 7, 4}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 2, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}}};

// A face of a cell; none: no cell.
struct CellFace {
  std::uint32_t code = ~std::uint32_t{0};
  CellFace() = default;
  CellFace(std::uint32_t cell, std::uint32_t face) : code(cell << 3 | face) {}
  explicit operator bool() const { return code != ~std::uint32_t{0}; }
  std::uint32_t cell() const { return code >> 3; }
  std::uint32_t face() const { return code & 7; }
};

// Three faces of a hexahedron: its neighbours there are ahead, beside and above.
using Frame = std::array<std::uint8_t, 3>;

class CellGraph {
 public:
  // Borrows the table.
  explicit CellGraph(const CellTable& cells, const Progress& progress = {});

  const CellTable& cells() const { return *cells_; }
  // From now on no face is shared by cells of different blocks.
  void cut_between_blocks();

  // The same face as its neighbour knows it.
  CellFace across(std::uint32_t cell, std::uint32_t face) const {
    return neighbours_[6 * std::uint64_t{cell} + face];
  }
  // The frame of the neighbour across `face`, with every direction straight on or beside the same.
  Frame carried(std::uint32_t cell, const Frame& frame, std::uint32_t face, CellFace to) const;
  int degree(std::uint32_t cell) const;

 private:
  // A face while it looks for its like, with the vertex diagonally opposite its lowest one and a
  // hash of the other two.
  struct Candidate {
    std::uint32_t opposite, others;
    CellFace face;
  };
  CellFace& neighbour(CellFace of) { return neighbours_[6 * std::uint64_t{of.cell()} + of.face()]; }
  void join_slice(std::uint64_t begin, std::uint64_t end);
  void join(std::span<const Candidate> faces);
  void join_many(std::span<const Candidate> faces);
  // The face of `cell`, other than `not_this`, at the edge between two vertices; 6: none.
  std::uint32_t face_at_edge(std::uint32_t cell, std::uint32_t a, std::uint32_t b,
                             std::uint32_t not_this) const;

  const CellTable* cells_;
  std::vector<CellFace> neighbours_;
};

}  // namespace shm::converters
