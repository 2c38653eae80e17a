// Node layouts: the positions of the mid nodes in second-order cells. A mid node is in the middle
// of an edge, of a quadrilateral face, or of the cell. The nodes are in the order of VTK.
// spec: "Mid nodes"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "shm/schema.h"

namespace shm {

/// Largest number of nodes of a cell with a layout. Frozen: part of the format.
inline constexpr std::uint32_t kMostLayoutNodes = 27;

/// A mid node: the node in the middle of an edge, of a face, or of a cell. All numbers in this
/// struct are positions of nodes in the stored cell.
struct MidNode {
  enum Kind : std::uint8_t { edge, face, body };
  static constexpr std::uint32_t kKinds = 3;

  Kind kind = edge;
  /// Nodes around the mid node. Edge node: the two ends of the edge. Face node: the corners of the
  /// face, in the order around the face. Body node: the nodes in the middle of four edges, in the
  /// order around the body node.
  std::array<std::uint8_t, 4> corner{};
  /// Nodes between the nodes in `corner`: middle[i] is between corner[i] and the next corner. Face
  /// node: the nodes of the face's edges. Body node: the nodes of four faces. Valid only if
  /// has_middle is set.
  std::array<std::uint8_t, 4> middle{};
  bool has_middle = false;
  /// Nodes of parallel edges or faces. Edge node: for each adjacent quadrilateral, the node of the
  /// opposite edge; then, in a hexahedron, the node of the diagonally opposite edge. Face node: the
  /// node of the cell's opposite face.
  std::array<std::uint8_t, 3> parallel{};
  std::array<std::uint8_t, 3> beside{};  ///< for each entry of `parallel`: the corner that
                                         ///< corresponds to corner[0] of this mid node
  std::uint8_t parallels = 0;
  /// Edge node: the two faces of the cell that meet at the edge, as indices in NodeLayout::sides.
  /// Valid only if has_sides is set.
  std::array<std::uint8_t, 2> side{};
  bool has_sides = false;
};

struct NodeLayout {
  std::uint8_t corners = 0;
  std::uint8_t nodes = 0;                       ///< number of nodes of a cell, including the
                                                ///< corners
  std::array<MidNode, kMostLayoutNodes> mid{};  ///< mid nodes, by position

  /// Corners of the faces of a three-dimensional cell. If a face has three corners, its last entry
  /// repeats the first corner.
  std::array<std::array<std::uint8_t, 4>, 6> sides{};
  std::uint8_t side_count = 0;

  const MidNode* at(std::size_t position) const {
    return position >= corners && position < nodes ? &mid[position] : nullptr;
  }
};

/// Returns the layout of cells with this shape and `nodes` nodes. Returns null if the layout is
/// unknown or if all nodes are corners.
const NodeLayout* node_layout(CellShape shape, std::uint32_t nodes);

}  // namespace shm
