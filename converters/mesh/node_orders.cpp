#include "mesh/node_orders.h"

#include <map>
#include <span>

namespace shm::converters {
namespace {

using Ends = std::array<std::uint8_t, 2>;  // the corners at the ends of an edge

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
void add_edges(std::span<const NodePosition> corners, std::span<const Ends> edges,
               NodePositions& out) {
  for (const auto& [from, to] : edges) add_edge(corners[from], corners[to], out);
}
void add_edges_around(std::span<const NodePosition> corners, NodePositions& out) {
  for (std::size_t i = 0; i < corners.size(); ++i)
    add_edge(corners[i], corners[(i + 1) % corners.size()], out);
}

// Appends the positions of a square, in Gmsh's order: its corners, its edges, then the square
// inside it. `corners`: the corners of the square, around it.
void add_gmsh_square(std::array<NodePosition, 4> corners, NodePositions& out) {
  while (true) {
    if (corners[0] == corners[2]) return out.push_back(corners[0]);
    out.insert(out.end(), corners.begin(), corners.end());
    add_edges_around(corners, out);
    const std::array<NodePosition, 4> outer = corners;
    if (towards(outer[0], outer[2]) == outer[2]) return;  // nothing is inside
    for (std::size_t i = 0; i < 4; ++i) corners[i] = towards(outer[i], outer[(i + 2) % 4]);
  }
}
// Appends the positions inside a square.
void add_inside_gmsh_square(const std::array<NodePosition, 4>& corners, NodePositions& out) {
  if (towards(corners[0], corners[2]) == corners[2]) return;
  add_gmsh_square({towards(corners[0], corners[2]), towards(corners[1], corners[3]),
                   towards(corners[2], corners[0]), towards(corners[3], corners[1])},
                  out);
}

// Moves each corner of a triangle or tetrahedron by one step towards each other corner. Returns the
// corners of the triangle or tetrahedron inside.
template <std::size_t kCorners>
std::array<NodePosition, kCorners> inner(const std::array<NodePosition, kCorners>& corners) {
  std::array<NodePosition, kCorners> inside = corners;
  for (std::size_t i = 0; i < kCorners; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      int moved = corners[i][axis];
      for (const NodePosition& other : corners)
        moved +=
            (other[axis] > corners[i][axis] ? 1 : 0) - (other[axis] < corners[i][axis] ? 1 : 0);
      inside[i][axis] = static_cast<std::uint8_t>(moved);
    }
  return inside;
}

// Appends the positions of a triangle of order `order`: its corners, its edges, then the triangle
// inside it. VTK and Gmsh have this order.
void add_triangle(std::array<NodePosition, 3> corners, std::uint32_t order, NodePositions& out) {
  for (; order > 0; order -= 3) {
    out.insert(out.end(), corners.begin(), corners.end());
    add_edges_around(corners, out);
    if (order < 3) return;
    corners = inner(corners);
  }
  out.push_back(corners[0]);
}

// The edges and faces of a tetrahedron, in the order of a format.
struct Tetrahedron {
  std::array<Ends, 6> edges;
  std::array<std::array<std::uint8_t, 3>, 4> faces;
};
constexpr Tetrahedron kVtkTetrahedron{{{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}},
                                      {{{0, 1, 3}, {2, 3, 1}, {0, 3, 2}, {0, 2, 1}}}};
constexpr Tetrahedron kGmshTetrahedron{{{{0, 1}, {1, 2}, {2, 0}, {3, 0}, {3, 2}, {3, 1}}},
                                       {{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {3, 1, 2}}}};

// Returns the positions of a tetrahedron: its corners, its edges, its faces, then the tetrahedron
// inside it.
NodePositions tetrahedron(const Tetrahedron& format, std::uint32_t order) {
  const auto p = static_cast<std::uint8_t>(order);
  std::array<NodePosition, 4> corners{{{0, 0, 0}, {p, 0, 0}, {0, p, 0}, {0, 0, p}}};
  NodePositions out;
  for (; order > 0; order -= 4) {
    out.insert(out.end(), corners.begin(), corners.end());
    add_edges(corners, format.edges, out);
    if (order >= 3)
      for (const auto& face : format.faces)
        add_triangle(inner(std::array{corners[face[0]], corners[face[1]], corners[face[2]]}),
                     order - 3, out);
    if (order < 4) return out;
    corners = inner(corners);
  }
  out.push_back(corners[0]);
  return out;
}

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

// Edges of a hexahedron in VTK's order. They run along the axes: around the bottom, around the top,
// then from the bottom to the top.
constexpr std::array<Ends, 12> kVtkEdges{{{0, 1},
                                          {1, 2},
                                          {3, 2},
                                          {0, 3},
                                          {4, 5},
                                          {5, 6},
                                          {7, 6},
                                          {4, 7},
                                          {0, 4},
                                          {1, 5},
                                          {2, 6},
                                          {3, 7}}};

NodePositions vtk_quad(std::uint8_t p) {
  const Corners corners = corners_between(0, p);
  NodePositions out(corners.begin(), corners.begin() + 4);
  add_edges(corners, std::span(kVtkEdges).first(4), out);
  for (std::uint8_t j = 1; j < p; ++j)
    for (std::uint8_t i = 1; i < p; ++i) out.push_back({i, j, 0});
  return out;
}

NodePositions vtk_hexahedron(std::uint8_t p) {
  const Corners corners = corners_between(0, p);
  NodePositions out(corners.begin(), corners.end());
  add_edges(corners, kVtkEdges, out);
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
  constexpr std::array<Ends, 12> kEdges{{{0, 1},
                                         {0, 3},
                                         {0, 4},
                                         {1, 2},
                                         {1, 5},
                                         {2, 3},
                                         {2, 6},
                                         {3, 7},
                                         {4, 5},
                                         {4, 7},
                                         {5, 6},
                                         {6, 7}}};
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
    add_edges(corners, kEdges, out);
    for (const auto& face : kFaces)
      add_inside_gmsh_square(
          {corners[face[0]], corners[face[1]], corners[face[2]], corners[face[3]]}, out);
  }
  return out;
}

NodePositions line(std::uint8_t p) {
  constexpr NodePosition kFirst{0, 0, 0};
  const NodePosition last{p, 0, 0};
  NodePositions out{kFirst, last};
  add_edge(kFirst, last, out);
  return out;
}

}  // namespace

std::uint32_t order_of_cell(CellShape shape, std::uint64_t nodes) {
  for (std::uint64_t p = 1; p <= kMostOrder; ++p) {
    std::uint64_t count = 0;
    switch (shape) {
      case CellShape::line: count = p + 1; break;
      case CellShape::triangle: count = (p + 1) * (p + 2) / 2; break;
      case CellShape::quad: count = (p + 1) * (p + 1); break;
      case CellShape::tetrahedron: count = (p + 1) * (p + 2) * (p + 3) / 6; break;
      case CellShape::wedge: count = (p + 1) * (p + 1) * (p + 2) / 2; break;
      case CellShape::hexahedron: count = (p + 1) * (p + 1) * (p + 1); break;
      default: return 0;
    }
    if (count == nodes) return static_cast<std::uint32_t>(p);
  }
  return 0;
}

std::uint32_t polynomial_order(CellShape shape, std::uint64_t nodes) {
  struct Kind {
    CellShape shape;
    std::uint64_t nodes;
  };
  using enum CellShape;
  constexpr std::array<Kind, 11> kSecondOrder = {{{triangle, 7},
                                                  {quad, 8},
                                                  {tetrahedron, 15},
                                                  {pyramid, 13},
                                                  {pyramid, 14},
                                                  {pyramid, 19},
                                                  {wedge, 15},
                                                  {wedge, 21},
                                                  {hexahedron, 20},
                                                  {hexahedron, 24},
                                                  {hexahedron, 26}}};
  for (const Kind& kind : kSecondOrder)
    if (kind.shape == shape && kind.nodes == nodes) return 2;
  return shape == pyramid && nodes == 5 ? 1 : order_of_cell(shape, nodes);
}

NodePositions vtk_positions(CellShape shape, std::uint32_t order) {
  const auto p = static_cast<std::uint8_t>(order);
  NodePositions out;
  switch (shape) {
    case CellShape::line: return line(p);
    case CellShape::triangle: add_triangle({{{0, 0, 0}, {p, 0, 0}, {0, p, 0}}}, order, out); break;
    case CellShape::quad: return vtk_quad(p);
    case CellShape::tetrahedron: return tetrahedron(kVtkTetrahedron, order);
    case CellShape::hexahedron: return vtk_hexahedron(p);
    default: break;
  }
  return out;
}

NodePositions gmsh_positions(CellShape shape, std::uint32_t order) {
  const auto p = static_cast<std::uint8_t>(order);
  NodePositions out;
  switch (shape) {
    case CellShape::quad:
      add_gmsh_square({{{0, 0, 0}, {p, 0, 0}, {p, p, 0}, {0, p, 0}}}, out);
      break;
    case CellShape::tetrahedron: return tetrahedron(kGmshTetrahedron, order);
    case CellShape::hexahedron: return gmsh_hexahedron(order);
    default: return vtk_positions(shape, order);  // lines and triangles
  }
  return out;
}

NodePositions exodus_hex64() {
  const Corners corners = corners_between(0, 3);
  NodePositions out(corners.begin(), corners.end());
  // Appends the node of a face that is nearest to `corner`. `opposite`: the opposite corner of the
  // face.
  const auto add_near = [&](std::size_t corner, std::size_t opposite) {
    out.push_back(towards(corners[corner], corners[opposite]));
  };
  add_edges_around(std::span(corners).first(4), out);
  for (std::uint8_t k = 1; k < 3; ++k)  // the vertical edges, one level after the other
    for (std::size_t i = 0; i < 4; ++i) out.push_back({corners[i][0], corners[i][1], k});
  add_edges_around(std::span(corners).last(4), out);
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
