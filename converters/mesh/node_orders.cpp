#include "mesh/node_orders.h"

#include <algorithm>
#include <map>
#include <span>

namespace shm::converters {
namespace {

using Corners = std::array<NodePosition, 8>;

// Returns the corners of a hexahedron whose axes reach from `low` to `high`.
Corners corners_between(std::uint8_t low, std::uint8_t high) {
  return {{{low, low, low},
           {high, low, low},
           {high, high, low},
           {low, high, low},
           {low, low, high},
           {high, low, high},
           {high, high, high},
           {low, high, high}}};
}

// Moves a position by one step towards another position, along each axis.
NodePosition towards(const NodePosition& from, const NodePosition& to) {
  NodePosition moved = from;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (moved[axis] < to[axis]) ++moved[axis];
    if (moved[axis] > to[axis]) --moved[axis];
  }
  return moved;
}

// Appends the positions between the ends of an edge, beginning next to `from`.
void add_edge(NodePosition from, const NodePosition& to, NodePositions& out) {
  for (from = towards(from, to); from != to; from = towards(from, to)) out.push_back(from);
}

// Appends the positions inside a square, in Gmsh's order: the corners of the inner square, its
// edges, then what is inside it. `corners`: the corners of the square, around it.
void add_gmsh_square(std::array<NodePosition, 4> corners, NodePositions& out) {
  while (true) {
    const std::array<NodePosition, 4> outer = corners;
    if (towards(outer[0], outer[2]) == outer[2]) return;  // nothing is inside
    for (std::size_t i = 0; i < 4; ++i) corners[i] = towards(outer[i], outer[(i + 2) % 4]);
    if (corners[0] == corners[2]) {
      out.push_back(corners[0]);
      return;
    }
    out.insert(out.end(), corners.begin(), corners.end());
    for (std::size_t i = 0; i < 4; ++i) add_edge(corners[i], corners[(i + 1) % 4], out);
  }
}

}  // namespace

std::uint32_t order_of_hexahedron(std::uint64_t nodes) {
  for (std::uint32_t order = 1; order <= kMostOrder; ++order)
    if (nodes == std::uint64_t{order + 1} * (order + 1) * (order + 1)) return order;
  return 0;
}

NodePositions vtk_hexahedron(std::uint32_t order) {
  const auto p = static_cast<std::uint8_t>(order);
  const Corners corners = corners_between(0, p);
  NodePositions out(corners.begin(), corners.end());
  // Edges run along the axes: around the bottom, around the top, then from the bottom to the top.
  constexpr std::uint8_t kEdges[12][2] = {{0, 1}, {1, 2}, {3, 2}, {0, 3}, {4, 5}, {5, 6},
                                          {7, 6}, {4, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  for (const auto& edge : kEdges) add_edge(corners[edge[0]], corners[edge[1]], out);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t fast = axis == 0 ? 1 : 0, slow = axis == 2 ? 1 : 2;
    for (const std::uint8_t end : {std::uint8_t{0}, p})
      for (std::uint8_t v = 1; v < p; ++v)
        for (std::uint8_t u = 1; u < p; ++u) {
          NodePosition position{};
          position[axis] = end;
          position[fast] = u;
          position[slow] = v;
          out.push_back(position);
        }
  }
  for (std::uint8_t k = 1; k < p; ++k)
    for (std::uint8_t j = 1; j < p; ++j)
      for (std::uint8_t i = 1; i < p; ++i) out.push_back({i, j, k});
  return out;
}

NodePositions gmsh_hexahedron(std::uint32_t order) {
  constexpr std::uint8_t kEdges[12][2] = {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3},
                                          {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}};
  constexpr std::uint8_t kFaces[6][4] = {{0, 3, 2, 1}, {0, 1, 5, 4}, {0, 4, 7, 3},
                                         {1, 2, 6, 5}, {2, 3, 7, 6}, {4, 5, 6, 7}};
  NodePositions out;
  // The nodes inside are those of a hexahedron whose order is lower by two.
  for (std::uint8_t low = 0; 2u * low <= order; ++low) {
    const auto high = static_cast<std::uint8_t>(order - low);
    const Corners corners = corners_between(low, high);
    if (low == high) {
      out.push_back(corners[0]);
      break;
    }
    out.insert(out.end(), corners.begin(), corners.end());
    for (const auto& edge : kEdges) add_edge(corners[edge[0]], corners[edge[1]], out);
    for (const auto& face : kFaces)
      add_gmsh_square({corners[face[0]], corners[face[1]], corners[face[2]], corners[face[3]]},
                      out);
  }
  return out;
}

NodePositions exodus_hex64() {
  const Corners corners = corners_between(0, 3);
  NodePositions out(corners.begin(), corners.end());
  const auto around = [&](std::size_t first) {  // the edges around the bottom or the top
    for (std::size_t i = 0; i < 4; ++i)
      add_edge(corners[first + i], corners[first + (i + 1) % 4], out);
  };
  // Appends the node of a face that is nearest to `corner`. `opposite`: the opposite corner of the
  // face.
  const auto add_near = [&](std::size_t corner, std::size_t opposite) {
    out.push_back(towards(corners[corner], corners[opposite]));
  };
  around(0);
  for (const std::uint8_t k : {std::uint8_t{1}, std::uint8_t{2}})  // the vertical edges, one level after the other
    for (std::size_t i = 0; i < 4; ++i) out.push_back({corners[i][0], corners[i][1], k});
  around(4);
  for (std::size_t i = 0; i < 4; ++i) add_near(i, (i + 2) % 4);
  for (const std::size_t level : {0u, 4u}) {
    // On each level: the nodes of the four vertical faces, then the nodes inside
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t next = (i + 1) % 4, other = 4 - level;
      add_near(level + i, other + next);
      add_near(level + next, other + i);
    }
    for (std::size_t i = 0; i < 4; ++i) add_near(level + i, 4 - level + (i + 2) % 4);
  }
  for (std::size_t i = 0; i < 4; ++i) add_near(4 + i, 4 + (i + 2) % 4);
  return out;
}

std::vector<std::uint16_t> node_permutation(const NodePositions& from, const NodePositions& to) {
  std::map<NodePosition, std::uint16_t> place;
  for (std::size_t i = 0; i < from.size(); ++i) place[from[i]] = static_cast<std::uint16_t>(i);
  std::vector<std::uint16_t> permutation;
  permutation.reserve(to.size());
  for (const NodePosition& position : to) permutation.push_back(place.at(position));
  return permutation;
}

}  // namespace shm::converters
