// Corners, edges and faces of a cell of any order, as spec "Nodes of cells of higher order" lists
// them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "shm/cell_nodes.h"

namespace shm {

/// The places of the nodes of a cell of order p follow from its frame. The row of nodes on an edge
/// leads from its first corner to its second one. A face is given by the corner from which the
/// steps on it count, and by the corners at the ends of its two axes.
struct CellFrame {
  using Ends = std::array<std::uint8_t, 2>;
  using Face = std::array<std::uint8_t, 3>;

  std::span<const NodePlace> corners;  ///< of a cell of order 1
  std::span<const Ends> edges;
  std::span<const Face> triangles, quads;
};

/// Returns the frame of a shape. Returns an empty frame if cells of this shape have no order.
CellFrame frame_of(CellShape shape);

}  // namespace shm
