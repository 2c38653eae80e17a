// StoredCell and CellTopology: one cell before and after its connectivity is coded.
// - StoredCell: input of the encoder, in the order in which the caller stores the nodes.
// - CellTopology: result of the connectivity coder in both directions, in the order of the coder's
//   frame. The coders of numbers, geometry and data read it.
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

/// Largest number of corners of a cell whose last use can be marked, since a 64-bit mask has one
/// bit for each of them.
inline constexpr std::uint32_t kMaxLastUse = 64;

/// Returns true if the cells of a block are coded, and counted, as hexahedra.
inline bool is_hexahedral(const BlockInfo& block) {
  return block.shape == CellShape::hexahedron && block.nodes_per_cell >= 8;
}

/// A cell to encode. Its nodes are in stored order.
struct StoredCell {
  std::uint32_t block = 0;
  /// Slots of the vertices; kNone marks a vertex that is new to the active surface.
  std::vector<std::uint32_t> slots;
  /// Numbers that are equal if and only if the vertex is the same.
  std::vector<std::uint64_t> numbers;
  /// 1 if this cell finalizes the vertex, otherwise 0.
  std::vector<std::uint8_t> last_use;
  /// The source's numbers of a hexahedron's corners: only with Order::keep, for coders that code
  /// these numbers.
  std::array<std::uint64_t, 8> original{};
};

/// The topology of a cell. A *position* is the index of a node in the coder's frame; it differs
/// from the stored index only for the corners of a hexahedron.
struct CellTopology {
  std::uint32_t block = 0;
  /// True: positions 0..7 are the corners of a hexahedron in the coder's frame.
  bool hexahedral = false;

  /// Sides of the cell: its shape, the number of corners that have sides (mesh/cell_shapes.h), and
  /// for each side the number of the cell across it that has the same face (OpenFaces). Sides are
  /// those of the corners as stored. These members are set only in meshes that also have cells
  /// other than hexahedra; otherwise `corners` is 0. A polyhedron given by its faces has 0 corners;
  /// the first entries of its `behind` are the cells that share its faces.
  CellShape shape = CellShape::hexahedron;
  std::uint32_t corners = 0;
  std::array<std::uint64_t, OpenFaces::kMost> behind{};

  /// Vertex slots, by position.
  std::vector<std::uint32_t> slots;
  /// By position: 1 if this cell finalizes the vertex, otherwise 0. If a vertex occurs several
  /// times, only its first position has a 1.
  std::vector<std::uint8_t> last_use;
  /// Positions of new vertices, in the order in which they were introduced.
  std::vector<std::uint32_t> new_positions;
  /// The source's numbers of a hexahedron's corners: only with Order::keep, from coders that code
  /// these numbers.
  std::array<std::uint64_t, 8> original{};
  /// Corner number, as stored, of each position in the coder's frame.
  std::array<std::uint8_t, 8> stored_corner{0, 1, 2, 3, 4, 5, 6, 7};

  /// Positions of the nodes that are not corners; null if these positions are unknown.
  const NodeLayout* layout = nullptr;
  /// Position of each stored corner in the coder's frame. Set if there is a layout.
  std::array<std::uint8_t, 8> framed{0, 1, 2, 3, 4, 5, 6, 7};

  /// True for a polyhedron that is given face by face, each face closed by its first vertex.
  bool by_faces = false;
  std::uint32_t cell_slot = kNone;
  /// Faces that were active before this cell: bit k is set for face k. The replay codec does not
  /// set this mask.
  std::uint8_t face_mask = 0;

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
