// CellGraph: which hexahedra share a face, and how directions are carried across it.
// Memory: 24 bytes a cell; while it is built up to 96 more for each of 2^18 hexahedra, or for an
// eighth of them where that is more, and half a byte a vertex. All of it may be in a spool: then
// cells that are neighbours should have near numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/big_array.h"
#include "base/progress.h"
#include "mesh/cells.h"

namespace shm::converters {

// Faces by direction: 0 and 1 lie at the ends of the first axis, 2 and 3, 4 and 5 of the others;
// `face ^ 1` is opposite.
inline constexpr std::array<std::array<std::uint8_t, 4>, 6> kFacesByDirection = {
    {{0, 3, 7, 4}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 2, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}}};

// A face of a cell; none: no cell. Fits 32 bits: cells are below 2^29.
struct CellFace {
  std::uint32_t code = 0;
  CellFace() = default;
  CellFace(std::uint32_t cell, std::uint32_t face) : code((cell << 3 | face) + 1) {}
  explicit operator bool() const { return code != 0; }
  std::uint32_t cell() const { return (code - 1) >> 3; }
  std::uint32_t face() const { return (code - 1) & 7; }
};

// Three faces of a hexahedron: its neighbours there are ahead, beside and above.
using Frame = std::array<std::uint8_t, 3>;

class CellGraph {
 public:
  // Borrows the cells and the spool; without one all is in memory. `sort_bytes`: memory for a sort
  // of all faces, with a spool.
  explicit CellGraph(const Cells& cells, const Progress& progress = {}, Spool* spool = nullptr,
                     std::size_t sort_bytes = 0);

  const Cells& cells() const { return *cells_; }
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
  // A face while it looks for its like: the vertex diagonally opposite its lowest one, and the
  // other two, the lower one first. With the lowest one they are unique to the face.
  struct Candidate {
    std::uint32_t opposite, low, high;
    CellFace face;
    auto others() const { return std::array{opposite, low, high}; }
  };
  CellFace neighbour(CellFace of) const { return across(of.cell(), of.face()); }
  void set_neighbour(CellFace of, CellFace to) {
    neighbours_.set(6 * std::uint64_t{of.cell()} + of.face(), to);
  }
  template <class Visit>
  void for_each_face(Visit&& visit) const;
  void join_slice(std::uint64_t begin, std::uint64_t end);
  void join_sorted(const Spool& spool, std::size_t sort_bytes, const Progress& progress);
  void join(std::span<Candidate> faces);
  void join_many(std::span<Candidate> faces);
  void join_same(std::span<CellFace> faces);

  const Cells* cells_;
  BigArray<CellFace> neighbours_;
};

}  // namespace shm::converters
