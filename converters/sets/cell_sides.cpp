#include "sets/cell_sides.h"

#include <algorithm>
#include <array>

#include "shm/cell_nodes.h"

namespace shm::converters {
namespace {

using SideNodes = SideFinder::SideNodes;
using Corners = std::vector<std::uint8_t>;

// Corners of each side of a cell. The sides are numbered as in the Exodus manual.
const std::vector<Corners>& sides_of(CellShape shape, bool flat) {
  static const std::vector<Corners> none,
      triangle = {{0, 1}, {1, 2}, {2, 0}}, quad = {{0, 1}, {1, 2}, {2, 3}, {3, 0}},
      shell3 = {{0, 1, 2}, {0, 2, 1}, {0, 1}, {1, 2}, {2, 0}},
      shell4 = {{0, 1, 2, 3}, {0, 3, 2, 1}, {0, 1}, {1, 2}, {2, 3}, {3, 0}},
      tetrahedron = {{0, 1, 3}, {1, 2, 3}, {0, 3, 2}, {0, 2, 1}},
      pyramid = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {0, 3, 2, 1}},
      wedge = {{0, 1, 4, 3}, {1, 2, 5, 4}, {0, 3, 5, 2}, {0, 2, 1}, {3, 4, 5}},
      hexahedron = {{0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6},
                    {0, 4, 7, 3}, {0, 3, 2, 1}, {4, 5, 6, 7}};
  switch (shape) {
    case CellShape::triangle: return flat ? triangle : shell3;
    case CellShape::quad: return flat ? quad : shell4;
    case CellShape::tetrahedron: return tetrahedron;
    case CellShape::pyramid: return pyramid;
    case CellShape::wedge: return wedge;
    case CellShape::hexahedron: return hexahedron;
    default: return none;
  }
}

// Corners of the edges of a cell, in VTK's order. In second-order cells, each of these edges has a
// node at its midpoint.
const std::vector<Corners>& edges_of(CellShape shape) {
  static const std::vector<Corners> none,
      triangle = {{0, 1}, {1, 2}, {2, 0}}, quad = {{0, 1}, {1, 2}, {2, 3}, {3, 0}},
      tetrahedron = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}},
      pyramid = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}},
      wedge = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}},
      hexahedron = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                    {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  switch (shape) {
    case CellShape::triangle: return triangle;
    case CellShape::quad: return quad;
    case CellShape::tetrahedron: return tetrahedron;
    case CellShape::pyramid: return pyramid;
    case CellShape::wedge: return wedge;
    case CellShape::hexahedron: return hexahedron;
    default: return none;
  }
}

// Corners of each face that can have a node at its centre. In a cell's list of nodes, the nodes at
// face centres come after the nodes at edge midpoints.
const std::vector<Corners>& middles_of(CellShape shape) {
  static const std::vector<Corners> none, quad = {{0, 1, 2, 3}}, triangle = {{0, 1, 2}},
                                          pyramid = {{0, 1, 2, 3}},
                                          wedge = {{0, 1, 3, 4}, {1, 2, 4, 5}, {0, 2, 3, 5}},
                                          hexahedron = {{0, 3, 4, 7}, {1, 2, 5, 6}, {0, 1, 4, 5},
                                                        {2, 3, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}};
  switch (shape) {
    case CellShape::triangle: return triangle;
    case CellShape::quad: return quad;
    case CellShape::pyramid: return pyramid;
    case CellShape::wedge: return wedge;
    case CellShape::hexahedron: return hexahedron;
    default: return none;
  }
}

std::size_t corners_of(CellShape shape) {
  switch (shape) {
    case CellShape::triangle: return 3;
    case CellShape::quad:
    case CellShape::tetrahedron: return 4;
    case CellShape::pyramid: return 5;
    case CellShape::wedge: return 6;
    case CellShape::hexahedron: return 8;
    default: return 0;
  }
}

// Returns the nodes of a side of a cell of order 2: the corners, the middles of the edges and, if
// the cell has it, the centre.
SideNodes second_order_side(const CellKind& cell, const Corners& around) {
  SideNodes side;
  side.at.assign(around.begin(), around.end());
  const std::size_t first_edge = corners_of(cell.shape);
  const auto& edges = edges_of(cell.shape);
  const std::size_t count = around.size() == 2 ? 1 : around.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t a = around[i], b = around[(i + 1) % around.size()];
    const auto edge = std::find_if(edges.begin(), edges.end(), [&](const Corners& e) {
      return (e[0] == a && e[1] == b) || (e[0] == b && e[1] == a);
    });
    side.at.push_back(
        static_cast<std::uint16_t>(first_edge + static_cast<std::size_t>(edge - edges.begin())));
  }
  Corners sorted = around;
  std::sort(sorted.begin(), sorted.end());
  const auto& middles = middles_of(cell.shape);
  const auto middle = std::find(middles.begin(), middles.end(), sorted);
  // In wedges with 21 nodes, the centres of the triangles come first.
  const bool has_triangles = cell.shape == CellShape::wedge && cell.nodes == 21;
  const std::size_t place = first_edge + edges.size() + (has_triangles ? 2 : 0) +
                            static_cast<std::size_t>(middle - middles.begin());
  // The node at the centre is added only if the side is a quad, because no type of second-order
  // triangle with a node at its centre exists in both Gmsh and Exodus.
  if (middle != middles.end() && place < cell.nodes && around.size() == 4)
    side.at.push_back(static_cast<std::uint16_t>(place));
  return side;
}

// Returns the nodes of a side of a cell of order 3 or higher. The side has the same order.
SideNodes high_order_side(const CellKind& cell, const Corners& around, CellShape shape,
                          std::uint32_t order) {
  const std::vector<NodePlace> places = node_places(cell.shape, cell.scheme, order);
  SideNodes side;
  for (const NodePlace& on_side : node_places(shape, cell.scheme, order)) {
    NodePlace place{};
    for (std::size_t a = 0; a < 3; ++a) {
      // Corners are at the ends of the axes, so a step along a side is 0, 1 or -1 on each axis.
      const auto end = [&](std::uint8_t corner) { return int{places[corner][a]}; };
      const int p = static_cast<int>(order), from = end(around[0]);
      place[a] = static_cast<std::uint8_t>(from + (end(around[1]) - from) / p * on_side[0] +
                                           (end(around.back()) - from) / p * on_side[1]);
    }
    const auto found = std::find(places.begin(), places.end(), place);
    side.at.push_back(static_cast<std::uint16_t>(found - places.begin()));
  }
  return side;
}

SideNodes find_nodes(const CellKind& cell, const Corners& around) {
  const CellShape shape = around.size() == 2   ? CellShape::line
                          : around.size() == 3 ? CellShape::triangle
                                               : CellShape::quad;
  const std::uint32_t order = cell_order({0, {}, cell.shape, cell.nodes, cell.scheme});
  SideNodes side;
  if (order >= 3)
    side = high_order_side(cell, around, shape, order);
  else if (order == 2)
    side = second_order_side(cell, around);
  else  // order 1, or the places of the nodes after the corners are unknown
    side.at.assign(around.begin(), around.end());
  // No line is a serendipity cell, since all its nodes are on its edge.
  const bool is_lagrange = shape == CellShape::line && cell.scheme == NodeScheme::serendipity;
  side.kind = {shape, is_lagrange ? NodeScheme::lagrange : cell.scheme,
               static_cast<std::uint32_t>(side.at.size())};
  return side;
}

}  // namespace

const SideNodes& SideFinder::find(const CellKind& cell, std::uint64_t side, bool flat) {
  static const SideNodes none;
  const auto& sides = sides_of(cell.shape, flat);
  if (side < 1 || side > sides.size() || cell.nodes < corners_of(cell.shape)) return none;
  const auto [known, is_new] = known_.try_emplace({cell, side, flat});
  if (is_new) known->second = find_nodes(cell, sides[side - 1]);
  return known->second;
}

CellSide SideFinder::side_of_cell(const BlockInfo& block, std::span<const std::uint64_t> corners,
                                  std::uint64_t side, bool flat) {
  const SideNodes& found =
      find({block.shape, block.scheme, static_cast<std::uint32_t>(corners.size())}, side, flat);
  CellSide result{found.kind, {}};
  for (const std::uint16_t node : found.at) result.nodes.push_back(corners[node]);
  return result;
}

std::size_t SideFinder::nodes_of_side(const BlockInfo& block, std::uint64_t side, bool flat) {
  return find({block.shape, block.scheme, block.nodes_per_cell}, side, flat).at.size();
}

}  // namespace shm::converters
