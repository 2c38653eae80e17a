// CellTopology: one cell, as passed between coders. Connectivity fills it; geometry and data read
// it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/active_surface.h"
#include "mesh/cell_shapes.h"
#include "mesh/node_layout.h"
#include "mesh/open_faces.h"
#include "shm/schema.h"

namespace shm {

/// Corners of a cell that can be marked as last use: the bits of a 64-bit mask.
inline constexpr std::uint32_t kMaxLastUse = 64;

/// Returns true if the cells of a block are coded, and counted, as hexahedra.
inline bool is_hexahedral(const BlockInfo& block) {
  return block.shape == CellShape::hexahedron && block.nodes_per_cell >= 8;
}

struct CellTopology {
  std::uint32_t block = 0;
  bool hexahedral = false;  ///< positions 0..7 are a hexahedron's corners in the coder's frame
  /// In meshes with cells other than hexahedra: the shape, the number of nodes that are corners
  /// with sides (mesh/cell_shapes.h), and across each side, of the corners as stored, the number
  /// of the cell with the same face (OpenFaces). Otherwise 0 corners. Polyhedra given by their
  /// faces have 0 corners, and here the first cells that had their faces.
  CellShape shape = CellShape::hexahedron;
  std::uint32_t corners = 0;
  std::array<std::uint64_t, OpenFaces::kMost> behind{};

  /// By position: vertex slot. Encoding: kNone marks a new vertex on input.
  std::vector<std::uint32_t> slots;
  /// By position, when encoding: equal if and only if the vertex is the same.
  std::vector<std::uint64_t> numbers;
  /// By position: 1 if this cell finalizes the vertex (first occurrence only).
  std::vector<std::uint8_t> last_use;
  /// Positions of new vertices, in the order in which they were introduced.
  std::vector<std::uint32_t> new_positions;
  /// Order::keep, for coders that code them: the source's numbers of a hexahedron's corners.
  std::array<std::uint64_t, 8> original{};
  /// Position in the coder's frame -> corner as stored.
  std::array<std::uint8_t, 8> stored_corner{0, 1, 2, 3, 4, 5, 6, 7};

  /// Places of the nodes that are not corners; null if nothing is known of them.
  const NodeLayout* layout = nullptr;
  /// Corner as stored -> position. Set if there is a layout.
  std::array<std::uint8_t, 8> framed{0, 1, 2, 3, 4, 5, 6, 7};

  bool by_faces =
      false;  ///< true: a polyhedron given face by face, each face closed by its first vertex
  std::uint32_t cell_slot = kNone;
  std::uint8_t face_mask = 0;  ///< bit k: face k was active before this cell (not with replay)

  std::uint32_t stored_position(std::uint32_t position) const {
    return hexahedral && position < 8 ? stored_corner[position] : position;
  }
  /// Returns the position in the coder's frame of the corner that is stored as `stored`.
  std::uint32_t framed_position(std::uint32_t stored) const {
    for (std::uint32_t i = 0; i < 8; ++i)
      if (stored_corner[i] == stored) return i;
    return stored;
  }
};

}  // namespace shm
