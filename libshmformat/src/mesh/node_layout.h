// Node layouts: the positions of the nodes that are not corners. In a second-order cell, such a mid
// node is in the middle of an edge, of a quadrilateral face, or of the cell. The nodes of a cell of
// order 3 to 10 form a grid; here, each of them that is not a corner counts as a mid node of its
// edge, of its face, or of the cell. The nodes are in the order of VTK.
// spec: "Mid nodes", "Grid nodes"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "shm/cell_nodes.h"
#include "shm/schema.h"

namespace shm {

/// Orders of the cells whose nodes form a grid. Frozen: part of the format.
inline constexpr std::uint32_t kLeastGridOrder = 3, kMostGridOrder = 10;

/// A mid node: a node on an edge, on a face, or inside a cell. All numbers in this struct are
/// positions of nodes in the stored cell, unless stated otherwise.
struct MidNode {
  enum Kind : std::uint8_t { edge, face, body };
  static constexpr std::uint32_t kKinds = 3;

  Kind kind = edge;
  /// Nodes around the mid node. Edge node: the two ends of the edge. Face node: the corners of the
  /// face, in the order around the face; the last entry for a triangle repeats the first corner.
  /// Body node: the nodes in the middle of four edges, in the order around the body node.
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
  bool is_on_triangle = false;  ///< face node of a grid: true if the face has three corners
  /// Steps along the grid, from corner[0] towards corner[1] and, on a face, towards corner[3] (on a
  /// triangle, corner[2]). The whole way has `order` steps: 2 in a second-order cell, in which each
  /// node is one step away.
  std::array<std::uint8_t, 2> step{1, 1};
  std::uint8_t order = 2;
  /// True if the previous node is on the same edge or face, or inside the cell like this one.
  bool continues = false;
};

/// The nodes of a cell of order 3 to 10, as a grid.
struct NodeGrid {
  using Place = NodePlace;
  static constexpr std::uint16_t kNowhere = 0xffff;

  std::uint32_t order = 0;
  std::vector<Place> places;             ///< place of each node, by position
  std::vector<std::uint16_t> positions;  ///< position of the node at each place, x fastest, or
                                         ///< kNowhere
  /// For each set of reversed axes: the positions of all nodes in the order in which they are
  /// coded. The corners come first, in stored order. The other nodes follow row by row: along the
  /// first axis, then along the second one, then along the third one. Bit a of the index states
  /// that axis a is reversed. Only hexahedra have reversed axes.
  std::array<std::vector<std::uint16_t>, 8> rows;

  /// Returns the position of the node at a place, or kNowhere. Coordinates may exceed the order.
  std::uint16_t position(const Place& place) const {
    if (place[0] > order || place[1] > order || place[2] > order) return kNowhere;
    const std::uint32_t side = order + 1;
    return positions[place[0] + side * (place[1] + side * place[2])];
  }
};

struct NodeLayout {
  std::uint8_t corners = 0;
  std::uint16_t nodes = 0;   ///< number of nodes of a cell, including the corners
  std::vector<MidNode> mid;  ///< mid nodes, by position
  NodeGrid grid;             ///< of order 0 unless the nodes form a grid

  /// Corners of the faces of a three-dimensional cell. If a face has three corners, its last entry
  /// repeats the first corner.
  std::array<std::array<std::uint8_t, 4>, 6> sides{};
  std::uint8_t side_count = 0;

  const MidNode* at(std::size_t position) const {
    return position >= corners && position < nodes ? &mid[position] : nullptr;
  }
  bool is_grid() const { return grid.order != 0; }
};

/// Returns true if the nodes of the cells of a block form a grid.
bool has_grid(const BlockInfo& block);

/// Returns the layout of the cells of a block. Returns null if the layout is unknown or if all
/// nodes are corners. Thread-safe.
std::unique_ptr<const NodeLayout> node_layout(const BlockInfo& block);

/// The layout of the cells of a block. It is made when it is first needed.
class LayoutOfBlock {
 public:
  /// Returns the layout, or null, as node_layout() does. `block` must be the same in all calls.
  const NodeLayout* get(const BlockInfo& block) {
    if (!is_made_) layout_ = node_layout(block);
    is_made_ = true;
    return layout_.get();
  }

 private:
  std::unique_ptr<const NodeLayout> layout_;
  bool is_made_ = false;
};

}  // namespace shm
