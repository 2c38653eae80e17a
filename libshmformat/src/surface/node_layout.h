// Node layouts: where the mid nodes of second-order cells stand, which are no corners: in the
// middle of an edge, of a quadrilateral face, or of the cell. Node orders are VTK's. spec: "Mid
// nodes"
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
  /// Of an edge its two ends; of a face its corners, around it; of a body the nodes in the middle
  /// of four edges, around it.
  std::array<std::uint8_t, 4> corner{};
  /// Of a face the nodes of its edges: middle[i] between corner[i] and the next; of a body those of
  /// four faces likewise. Where has_middle.
  std::array<std::uint8_t, 4> middle{};
  bool has_middle = false;
  /// Nodes that lie opposite in a quadrilateral, then opposite to both of these; of a face: the one
  /// across the cell.
  std::array<std::uint8_t, 3> parallel{};
  std::array<std::uint8_t, 3> beside{};  ///< of each, the corner that is to it as corner[0] to this
  std::uint8_t parallels = 0;
  /// Of an edge, the two faces of its cell that meet there, in NodeLayout::sides. Where has_sides.
  std::array<std::uint8_t, 2> side{};
  bool has_sides = false;
};

struct NodeLayout {
  std::uint8_t corners = 0;
  std::uint8_t nodes = 0;                       ///< corners, and those in `mid`
  std::array<MidNode, kMostLayoutNodes> mid{};  ///< by position
  /// Corners of the faces of a solid; three of them where the last is the first.
  std::array<std::array<std::uint8_t, 4>, 6> sides{};
  std::uint8_t side_count = 0;

  const MidNode* at(std::size_t position) const {
    return position >= corners && position < nodes ? &mid[position] : nullptr;
  }
};

/// The layout of cells of this shape with so many nodes; null where nothing is known of it, or
/// where all are corners.
const NodeLayout* node_layout(CellShape shape, std::uint32_t nodes);

}  // namespace shm
