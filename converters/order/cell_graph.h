// CellGraph: stores which hexahedra share a face, and converts directions in a hexahedron to
// directions in the hexahedron across a face. Needs
// 24 bytes of memory per cell. While the graph is built, it needs up to 96 more bytes for each of
// 2^18 hexahedra (for an eighth of all hexahedra if that is more), and half a byte per vertex. All
// tables may be in a spool; neighbouring cells should then have close numbers.
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

// A face of a cell, or no face. Fits into 32 bits because cell numbers are below 2^29.
struct CellFace {
  std::uint32_t code = 0;
  CellFace() = default;
  CellFace(std::uint32_t cell, std::uint32_t face) : code((cell << 3 | face) + 1) {}
  explicit operator bool() const { return code != 0; }
  std::uint32_t cell() const { return (code - 1) >> 3; }
  std::uint32_t face() const { return (code - 1) & 7; }
};

// Three faces of a hexahedron. The neighbours across them are ahead, beside and above.
using Frame = std::array<std::uint8_t, 3>;

class CellGraph {
 public:
  // Borrows the cells and the spool. Without a spool, all tables are in memory. `sort_bytes`:
  // memory for a sort of all faces if there is a spool.
  explicit CellGraph(const Cells& cells, const Progress& progress = {}, Spool* spool = nullptr,
                     std::size_t sort_bytes = 0);

  const Cells& cells() const { return *cells_; }
  // Removes the connections between cells of different blocks.
  void cut_between_blocks();

  // Returns the same face as a face of the neighbouring cell.
  CellFace across(std::uint32_t cell, std::uint32_t face) const {
    return neighbours_[6 * std::uint64_t{cell} + face];
  }
  // Carries `frame` to the neighbour `to` across `face`. Each direction of the frame either
  // continues straight or stays on the same side.
  Frame carried(std::uint32_t cell, const Frame& frame, std::uint32_t face, CellFace to) const;
  int degree(std::uint32_t cell) const;

 private:
  // A face that is searched for in other cells, without its lowest vertex: the vertex diagonally
  // opposite the lowest vertex, and the other two, the lower one first. Together with the lowest
  // vertex they identify the face.
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
