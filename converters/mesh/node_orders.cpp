#include "mesh/node_orders.h"

#include <map>
#include <span>

namespace shm::converters {
namespace {

using Ends = std::array<std::uint8_t, 2>;  // the corners at the ends of an edge

// Moves a place by one step towards another place, along each axis.
NodePlace towards(const NodePlace& from, const NodePlace& to) {
  NodePlace moved = from;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (moved[axis] < to[axis]) ++moved[axis];
    if (moved[axis] > to[axis]) --moved[axis];
  }
  return moved;
}

// Appends the places between the ends of an edge, beginning next to `from`.
void add_edge(NodePlace from, const NodePlace& to, NodePlaces& out) {
  for (from = towards(from, to); from != to; from = towards(from, to)) out.push_back(from);
}
void add_edges(std::span<const NodePlace> corners, std::span<const Ends> edges, NodePlaces& out) {
  for (const auto& [from, to] : edges) add_edge(corners[from], corners[to], out);
}
void add_edges_around(std::span<const NodePlace> corners, NodePlaces& out) {
  for (std::size_t i = 0; i < corners.size(); ++i)
    add_edge(corners[i], corners[(i + 1) % corners.size()], out);
}

// Appends the places of a square, in Gmsh's order: its corners, its edges, then the square
// inside it. `corners`: the corners of the square, around it.
void add_gmsh_square(std::array<NodePlace, 4> corners, NodePlaces& out) {
  while (true) {
    if (corners[0] == corners[2]) return out.push_back(corners[0]);
    out.insert(out.end(), corners.begin(), corners.end());
    add_edges_around(corners, out);
    const std::array<NodePlace, 4> outer = corners;
    if (towards(outer[0], outer[2]) == outer[2]) return;  // nothing is inside
    for (std::size_t i = 0; i < 4; ++i) corners[i] = towards(outer[i], outer[(i + 2) % 4]);
  }
}
// Appends the places inside a square.
void add_inside_gmsh_square(const std::array<NodePlace, 4>& corners, NodePlaces& out) {
  if (towards(corners[0], corners[2]) == corners[2]) return;
  add_gmsh_square({towards(corners[0], corners[2]), towards(corners[1], corners[3]),
                   towards(corners[2], corners[0]), towards(corners[3], corners[1])},
                  out);
}

// Moves each corner of a triangle or tetrahedron by one step towards each other corner. Returns the
// corners of the triangle or tetrahedron inside.
template <std::size_t kCorners>
std::array<NodePlace, kCorners> inner(const std::array<NodePlace, kCorners>& corners) {
  std::array<NodePlace, kCorners> inside = corners;
  for (std::size_t i = 0; i < kCorners; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      int moved = corners[i][axis];
      for (const NodePlace& other : corners)
        moved +=
            (other[axis] > corners[i][axis] ? 1 : 0) - (other[axis] < corners[i][axis] ? 1 : 0);
      inside[i][axis] = static_cast<std::uint8_t>(moved);
    }
  return inside;
}

// Appends the places of a triangle of order `order`: its corners, its edges, then the triangle
// inside it.
void add_triangle(std::array<NodePlace, 3> corners, std::uint32_t order, NodePlaces& out) {
  for (; order > 0; order -= 3) {
    out.insert(out.end(), corners.begin(), corners.end());
    add_edges_around(corners, out);
    if (order < 3) return;
    corners = inner(corners);
  }
  out.push_back(corners[0]);
}

NodePlaces gmsh_tetrahedron(std::uint32_t order) {
  constexpr std::array<Ends, 6> kEdges{{{0, 1}, {1, 2}, {2, 0}, {3, 0}, {3, 2}, {3, 1}}};
  constexpr std::uint8_t kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {3, 1, 2}};
  const auto p = static_cast<std::uint8_t>(order);
  std::array<NodePlace, 4> corners{{{0, 0, 0}, {p, 0, 0}, {0, p, 0}, {0, 0, p}}};
  NodePlaces out;
  // The nodes inside are those of a tetrahedron whose order is lower by four.
  for (; order > 0; order -= 4) {
    out.insert(out.end(), corners.begin(), corners.end());
    add_edges(corners, kEdges, out);
    if (order >= 3)
      for (const auto& face : kFaces)
        add_triangle(inner(std::array{corners[face[0]], corners[face[1]], corners[face[2]]}),
                     order - 3, out);
    if (order < 4) return out;
    corners = inner(corners);
  }
  out.push_back(corners[0]);
  return out;
}

using Corners = std::array<NodePlace, 8>;

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

NodePlaces gmsh_hexahedron(std::uint32_t order) {
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
  NodePlaces out;
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

NodePlaces gmsh_wedge(std::uint8_t p) {
  const std::array<NodePlace, 6> corners{
      {{0, 0, 0}, {p, 0, 0}, {0, p, 0}, {0, 0, p}, {p, 0, p}, {0, p, p}}};
  constexpr std::array<Ends, 9> kEdges{
      {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 4}, {2, 5}, {3, 4}, {3, 5}, {4, 5}}};
  NodePlaces out(corners.begin(), corners.end());
  add_edges(corners, kEdges, out);
  const auto add_inside_triangle = [&](std::size_t a, std::size_t b, std::size_t c,
                                       NodePlaces& list) {
    if (p >= 3) add_triangle(inner(std::array{corners[a], corners[b], corners[c]}), p - 3u, list);
  };
  add_inside_triangle(0, 2, 1, out);
  add_inside_triangle(3, 4, 5, out);
  add_inside_gmsh_square({corners[0], corners[1], corners[4], corners[3]}, out);
  add_inside_gmsh_square({corners[0], corners[3], corners[5], corners[2]}, out);
  add_inside_gmsh_square({corners[1], corners[2], corners[5], corners[4]}, out);
  // The nodes inside: for each node of a triangle, the line above it, ends first.
  NodePlaces triangle;
  add_inside_triangle(0, 1, 2, triangle);
  for (NodePlace place : triangle) {
    const auto add_at = [&](std::uint8_t height) {
      place[2] = height;
      out.push_back(place);
    };
    add_at(1);
    if (p > 2) add_at(static_cast<std::uint8_t>(p - 1));
    for (std::uint8_t k = 2; k + 1 < p; ++k) add_at(k);
  }
  return out;
}

NodePlaces gmsh_pyramid(std::uint32_t order) {
  constexpr std::array<Ends, 8> kEdges{
      {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 4}, {2, 3}, {2, 4}, {3, 4}}};
  constexpr std::uint8_t kTriangles[4][3] = {{0, 1, 4}, {3, 0, 4}, {1, 2, 4}, {2, 3, 4}};
  NodePlaces out;
  // The nodes inside are those of a pyramid whose order is lower by three.
  for (std::uint8_t in = 0; 3u * in <= order; ++in) {
    const auto p = static_cast<std::uint8_t>(order - 3u * in);
    const auto far = static_cast<std::uint8_t>(in + p);
    if (p == 0) {
      out.push_back({in, in, in});
      break;
    }
    const std::array<NodePlace, 5> corners{
        {{in, in, in}, {far, in, in}, {far, far, in}, {in, far, in}, {in, in, far}}};
    out.insert(out.end(), corners.begin(), corners.end());
    add_edges(corners, kEdges, out);
    for (const auto& face : kTriangles)
      if (p >= 3)
        add_triangle(inner(std::array{corners[face[0]], corners[face[1]], corners[face[2]]}),
                     p - 3u, out);
    add_inside_gmsh_square({corners[0], corners[3], corners[2], corners[1]}, out);
  }
  return out;
}

}  // namespace

NodePlaces gmsh_places(CellShape shape, NodeScheme scheme, std::uint32_t order) {
  const auto p = static_cast<std::uint8_t>(order);
  NodePlaces out;
  switch (shape) {
    case CellShape::quad:
      add_gmsh_square({{{0, 0, 0}, {p, 0, 0}, {p, p, 0}, {0, p, 0}}}, out);
      break;
    case CellShape::tetrahedron: out = gmsh_tetrahedron(order); break;
    case CellShape::pyramid: out = gmsh_pyramid(order); break;
    case CellShape::wedge: out = gmsh_wedge(p); break;
    case CellShape::hexahedron: out = gmsh_hexahedron(order); break;
    default: return node_places(shape, scheme, order);  // lines and triangles
  }
  // Serendipity cells have the corners and the nodes on the edges. They come first in all cells.
  if (scheme == NodeScheme::serendipity) out.resize(node_places(shape, scheme, order).size());
  return out;
}

NodePlaces exodus_cubic(CellShape shape, NodeScheme scheme) {
  // QUAD16 has the order of Gmsh. The nodes of lines and triangles have the order of the model.
  if (shape == CellShape::quad) return gmsh_places(shape, scheme, 3);
  if (shape == CellShape::line || shape == CellShape::triangle)
    return node_places(shape, scheme, 3);
  // Three-dimensional cells: the corners, the edges of the bottom, the edges that lead upwards, one
  // level after the other, and the edges of the top.
  NodePlaces out = node_places(shape, scheme, 3);
  const bool is_tetrahedron = shape == CellShape::tetrahedron;
  out.resize(node_places(shape, scheme, 1).size());
  const NodePlaces corners = out;
  const std::size_t below = is_tetrahedron ? 3 : corners.size() / 2;
  add_edges_around(std::span(corners).first(below), out);
  for (std::size_t level = 1; level < 3; ++level)
    for (std::size_t i = 0; i < below; ++i) {
      const NodePlace& above = corners[is_tetrahedron ? 3 : below + i];
      const NodePlace first = towards(corners[i], above);
      out.push_back(level == 1 ? first : towards(first, above));
    }
  if (!is_tetrahedron) add_edges_around(std::span(corners).last(below), out);
  if (scheme == NodeScheme::serendipity) return out;

  // HEX64. Appends the node of a face that is nearest to `corner`. `opposite`: the opposite corner
  // of the face.
  const auto add_near = [&](std::size_t corner, std::size_t opposite) {
    out.push_back(towards(corners[corner], corners[opposite]));
  };
  for (std::size_t i = 0; i < 4; ++i) add_near(i, (i + 2) % 4);
  for (const std::size_t at : {0u, 4u}) {
    // On each level: the nodes of the four vertical faces, then the nodes inside
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t next = (i + 1) % 4, other = 4 - at;
      add_near(at + i, other + next);
      add_near(at + next, other + i);
    }
    for (std::size_t i = 0; i < 4; ++i) add_near(at + i, 4 - at + (i + 2) % 4);
  }
  for (std::size_t i = 0; i < 4; ++i) add_near(4 + i, 4 + (i + 2) % 4);
  return out;
}

std::vector<std::uint16_t> node_permutation(const NodePlaces& from, const NodePlaces& to) {
  std::map<NodePlace, std::uint16_t> at;
  for (std::size_t i = 0; i < from.size(); ++i) at[from[i]] = static_cast<std::uint16_t>(i);
  std::vector<std::uint16_t> permutation;
  permutation.reserve(to.size());
  for (const NodePlace& place : to) permutation.push_back(at.at(place));
  return permutation;
}

}  // namespace shm::converters
