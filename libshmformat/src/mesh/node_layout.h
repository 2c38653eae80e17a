// Node layouts: the places of the mid nodes of second-order cells, which are not corners: the
// middle of an edge, of a quadrilateral face, or of the cell. Node orders are VTK's.
// spec: "Mid nodes"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "shm/schema.h"

namespace shm {

/// Frozen: part of the format.
inline constexpr std::uint32_t kMostLayoutNodes = 27;

/// A node of a second-order cell in the middle of an edge, of a face or of the cell. All numbers
/// are positions as stored.
struct MidNode {
  enum Kind : std::uint8_t { edge, face, body };
  static constexpr std::uint32_t kKinds = 3;

  Kind kind = edge;
  /// Edge: its two ends. Face: its corners, in order around it. Body: the nodes in the middle of
  /// four edges, in order around it.
  std::array<std::uint8_t, 4> corner{};
  /// Face: the nodes of its edges, middle[i] between corner[i] and the next corner. Body: the nodes
  /// of four faces in the same way. Valid if has_middle is set.
  std::array<std::uint8_t, 4> middle{};
  bool has_middle = false;
  /// Edge: nodes of the opposite edges in its quadrilaterals, then of the edge opposite to both of
  /// these. Face: the node of the opposite face of the cell.
  std::array<std::uint8_t, 3> parallel{};
  std::array<std::uint8_t, 3>
      beside{};  ///< for each parallel node, the corner that corresponds to corner[0] here
  std::uint8_t parallels = 0;
  /// Edge: the two faces of its cell that meet there, as indices of NodeLayout::sides. Valid if
  /// has_sides is set.
  std::array<std::uint8_t, 2> side{};
  bool has_sides = false;
};

struct NodeLayout {
  std::uint8_t corners = 0;
  std::uint8_t nodes = 0;                       ///< number of corners and of nodes in `mid`
  std::array<MidNode, kMostLayoutNodes> mid{};  ///< mid nodes by position
  /// Corners of the faces of a solid. A face has three corners if the last is the first.
  std::array<std::array<std::uint8_t, 4>, 6> sides{};
  std::uint8_t side_count = 0;

  const MidNode* at(std::size_t position) const {
    return position >= corners && position < nodes ? &mid[position] : nullptr;
  }
};

/// Returns the layout of cells of this shape with `nodes` nodes; null if it is unknown, or if all
/// nodes are corners.
const NodeLayout* node_layout(CellShape shape, std::uint32_t nodes);

}  // namespace shm
