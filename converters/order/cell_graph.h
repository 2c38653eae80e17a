// CellGraph: stores which hexahedra share a face, and converts directions in a hexahedron to
// directions in the neighbouring hexahedron across a face. Needs 24 bytes of memory per cell. While
// the graph is built, it needs additional memory: half a byte per vertex, and up to 96 bytes for
// each of 2^18 hexahedra (or for an eighth of all hexahedra, if that is more). All tables may be in
// a spool (temporary storage, on disk if large). In that case, neighbouring cells should have close
// numbers, so that access is fast.
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

// The corners of each face, by direction. Faces 0 and 1 are at the ends of the first axis, 2 and 3
// of the second, 4 and 5 of the third. `face ^ 1` is the opposite face.
inline constexpr std::array<std::array<std::uint8_t, 4>, 6> kFacesByDirection = {
    {{0, 3, 7, 4}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 2, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}}};

// A face of a cell, or no face (`code` 0). Fits into 32 bits because cell numbers are below 2^29.
struct CellFace {
  std::uint32_t code = 0;
  CellFace() = default;
  CellFace(std::uint32_t cell, std::uint32_t face) : code((cell << 3 | face) + 1) {}
  explicit operator bool() const { return code != 0; }
  std::uint32_t cell() const { return (code - 1) >> 3; }
  std::uint32_t face() const { return (code - 1) & 7; }
};

// A local coordinate system of a hexahedron: the three faces in the directions ahead, beside and
// above.
using Frame = std::array<std::uint8_t, 3>;

class CellGraph {
 public:
  // Borrows the cells and the spool. If `spool` is null, all tables are in memory. Otherwise,
  // `sort_bytes` is the memory limit for sorting the faces.
  explicit CellGraph(const Cells& cells, const Progress& progress = {}, Spool* spool = nullptr,
                     std::size_t sort_bytes = 0);

  const Cells& cells() const { return *cells_; }
  // Removes the links between neighbouring cells of different blocks.
  void cut_between_blocks();

  // Returns the neighbouring cell across a face, and the index of the shared face within this
  // neighbour. Returns an empty CellFace if `face` has no neighbour.
  CellFace across(std::uint32_t cell, std::uint32_t face) const {
    return neighbours_[6 * std::uint64_t{cell} + face];
  }
  // Converts `frame`, a local coordinate system of `cell`, to a local coordinate system of `to`,
  // the neighbouring cell across `face`. The direction that crosses `face` continues straight ahead
  // in the neighbour. Each of the other two directions points at a face of `cell` that shares an
  // edge with `face`. In the neighbour, this direction points at the face that contains the same
  // edge.
  Frame carried(std::uint32_t cell, const Frame& frame, std::uint32_t face, CellFace to) const;
  int degree(std::uint32_t cell) const;

 private:
  // A face that may occur in two cells. Its lowest vertex, which is stored elsewhere, and the three
  // vertices stored here identify it: `opposite` is diagonally opposite the lowest vertex, and
  // `low` and `high` are the other two vertices, in ascending order.
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
