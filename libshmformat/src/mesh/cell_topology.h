// StoredCell and CellTopology: one cell before and after its connectivity is coded.
// - StoredCell: input of the encoder. The nodes are in the order in which the caller stores them.
// - CellTopology: result of the connectivity coder, when encoding and when decoding. The coders of
// vertex numbers, coordinates and arrays read it. The corners of a hexahedron are in the coder's
// own order (sorted along the coder's three axes); all other nodes are in stored order.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/active_surface.h"
#include "mesh/cell_shapes.h"
#include "mesh/hexahedron.h"
#include "mesh/node_layout.h"
#include "mesh/open_faces.h"
#include "shm/schema.h"

namespace shm {

/// Largest number of corners of a cell whose last use can be marked. The marks are the bits of a
/// 64-bit mask.
inline constexpr std::uint32_t kMaxLastUse = 64;

/// Returns true if the cells of the block are coded and counted as hexahedra.
inline bool is_hexahedral(const BlockInfo& block) {
  return block.shape == CellShape::hexahedron && block.nodes_per_cell >= 8;
}

/// A cell to be encoded. Its nodes are in stored order.
struct StoredCell {
  std::uint32_t block = 0;
  /// Slots of the vertices. The slot is kNone if the vertex is new to the active surface.
  std::vector<std::uint32_t> slots;
  /// Vertex numbers by node. Two numbers are equal if and only if the vertices are the same.
  std::vector<std::uint64_t> numbers;
  /// For each node: 1 if this cell finalizes the vertex, otherwise 0.
  std::vector<std::uint8_t> last_use;
  /// Vertex numbers in the source mesh, for the corners of a hexahedron. They are set only with
  /// Order::keep, and only if the coder codes these numbers.
  std::array<std::uint64_t, 8> original{};
};

/// The topology of a cell. The *position* of a node is its index in the coder's order. For the
/// corners of a hexahedron, the coder has its own order; for all other nodes, the position is the
/// index in stored order.
struct CellTopology {
  std::uint32_t block = 0;
  /// True if the nodes at positions 0 to 7 are the corners of a hexahedron, in the coder's order.
  bool hexahedral = false;

  /// `shape`, `corners` and `behind` describe the sides of the cell. `corners`: the number of
  /// corners, which with `shape` determines the sides (mesh/cell_shapes.h). `behind`: for each
  /// side, the number of the cell across it (OpenFaces). The sides are those of the corners in
  /// stored order. The members are set only in meshes that also have cells other than hexahedra;
  /// otherwise `corners` is 0. If a polyhedron is stored as a list of faces, `corners` is 0, and
  /// the first entries of `behind` are the cells with which it shares faces.
  CellShape shape = CellShape::hexahedron;
  std::uint32_t corners = 0;
  std::array<std::uint64_t, OpenFaces::kMost> behind{};

  /// Vertex slots, by position.
  std::vector<std::uint32_t> slots;
  /// For each position: 1 if this cell finalizes the vertex, otherwise 0. If a vertex occurs at
  /// several positions, only the first of them can have a 1.
  std::vector<std::uint8_t> last_use;
  /// Positions of the new vertices, in the order in which the vertices are introduced.
  std::vector<std::uint32_t> new_positions;
  /// Vertex numbers in the source mesh, for the corners of a hexahedron. They are set only with
  /// Order::keep, and only if the coder codes these numbers.
  std::array<std::uint64_t, 8> original{};
  /// For each position (index in the coder's order): the index of the corner in stored order.
  std::array<std::uint8_t, 8> stored_corner{0, 1, 2, 3, 4, 5, 6, 7};

  /// Layout of the nodes that are not corners; null if the layout is unknown.
  const NodeLayout* layout = nullptr;
  /// For each corner in stored order: its position (index in the coder's order). Set only if there
  /// is a layout.
  std::array<std::uint8_t, 8> framed{0, 1, 2, 3, 4, 5, 6, 7};
  /// Cells whose nodes form a grid: the axes along which the rows of nodes are coded in reverse
  /// (bit a for axis a), and the positions of all nodes in the order of coding. Null for all other
  /// cells. See begin_grid().
  std::uint32_t reversed = 0;
  const std::vector<std::uint16_t>* rows = nullptr;

  /// True if the cell is a polyhedron that is stored as a list of faces, in which each face ends
  /// with its first vertex.
  bool by_faces = false;
  std::uint32_t cell_slot = kNone;
  /// Bit mask of the faces that were active before this cell: bit k is set for face k. The replay
  /// codec does not set the mask.
  std::uint8_t face_mask = 0;

  std::uint32_t stored_position(std::uint32_t position) const {
    return hexahedral && position < 8 ? stored_corner[position] : position;
  }
  /// Returns the position of the node that is coded as number `rank` of the cell.
  std::uint32_t ranked_position(std::uint32_t rank) const {
    return rows != nullptr ? (*rows)[rank] : rank;
  }
  /// Determines in which order the nodes of a grid are coded. Along each axis of a hexahedron, the
  /// rows begin at the end with fewer new corners. So they lead from known nodes to new ones.
  /// Precondition: the corners of a hexahedron are known, and new_positions contains the new ones.
  void begin_grid() {
    std::array<int, 3> new_at_end{};  // new corners at the high end, minus those at the low end
    if (hexahedral)
      for (const std::uint32_t position : new_positions)
        for (std::uint32_t a = 0; a < 3; ++a)
          new_at_end[a] += (kCornerBits[stored_corner[position]] >> a & 1) != 0 ? 1 : -1;
    reversed = 0;
    for (std::uint32_t a = 0; a < 3; ++a)
      if (new_at_end[a] < 0) reversed |= 1u << a;
    rows = &layout->grid.rows[reversed];
  }
  /// Returns the position (index in the coder's order) of the corner that has index `stored` in
  /// stored order.
  std::uint32_t framed_position(std::uint32_t stored) const {
    for (std::uint32_t i = 0; i < 8; ++i)
      if (stored_corner[i] == stored) return i;
    return stored;
  }
};

}  // namespace shm
