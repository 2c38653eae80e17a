// Node layouts: describe the positions of the mid nodes of second-order cells. A mid node is in the
// middle of an edge, of a quadrilateral face, or of the cell. The order of the nodes is that of
// VTK.
// spec: "Mid nodes"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "shm/schema.h"

namespace shm {

/// Largest number of nodes of a cell with a layout. Frozen: part of the format.
inline constexpr std::uint32_t kMostLayoutNodes = 27;

/// Node in the middle of an edge, of a face or of a second-order cell. All numbers are positions of
/// nodes in the cell as stored.
struct MidNode {
  enum Kind : std::uint8_t { edge, face, body };
  static constexpr std::uint32_t kKinds = 3;

  Kind kind = edge;
  /// Nodes around the mid node. For an edge node: the two ends of the edge. For a face node: the
  /// corners of the face, in order around the face. For a body node: the nodes in the middle of
  /// four edges, in order around the body node.
  std::array<std::uint8_t, 4> corner{};
  /// Nodes between the nodes in `corner`. For a face node: the nodes of the face's edges; middle[i]
  /// is between corner[i] and the next corner. For a body node: the nodes of four faces in the same
  /// way. Valid if has_middle is set.
  std::array<std::uint8_t, 4> middle{};
  bool has_middle = false;
  /// Nodes of parallel edges or faces. For an edge node: the nodes of the edges that are opposite
  /// in the adjacent quadrilaterals, then the node of the edge that is opposite to both of these
  /// edges. For a face node: the node of the opposite face of the cell.
  std::array<std::uint8_t, 3> parallel{};
  std::array<std::uint8_t, 3> beside{};  ///< the corner that corresponds to corner[0] of this node,
                                         ///< for each entry of `parallel`
  std::uint8_t parallels = 0;
  /// The two faces of the cell that meet at the edge, for an edge node, as indices of
  /// NodeLayout::sides. Valid if has_sides is set.
  std::array<std::uint8_t, 2> side{};
  bool has_sides = false;
};

struct NodeLayout {
  std::uint8_t corners = 0;
  std::uint8_t nodes = 0;                       ///< number of nodes of a cell, corners included
  std::array<MidNode, kMostLayoutNodes> mid{};  ///< mid nodes, by position

  /// Corners of the faces of a three-dimensional cell. In a face with three corners, the last entry
  /// equals the first.
  std::array<std::array<std::uint8_t, 4>, 6> sides{};
  std::uint8_t side_count = 0;

  const MidNode* at(std::size_t position) const {
    return position >= corners && position < nodes ? &mid[position] : nullptr;
  }
};

/// Returns the layout of cells of this shape with `nodes` nodes. Returns null if the layout is
/// unknown or all nodes are corners.
const NodeLayout* node_layout(CellShape shape, std::uint32_t nodes);

}  // namespace shm
