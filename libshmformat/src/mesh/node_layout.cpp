#include "mesh/node_layout.h"

#include <algorithm>
#include <span>

#include "mesh/hexahedron.h"

namespace shm {
namespace {

using Edge = std::array<std::uint8_t, 2>;
using Face = std::array<std::uint8_t, 4>;

/// Corners, edges and faces of a cell shape. If a face has three corners, its last entry repeats
/// the first corner.
struct Solid {
  std::uint8_t corners;
  std::span<const Edge> edges;
  std::span<const Face>
      faces;           ///< faces in the order of their mid nodes; quadrilaterals come first
  std::uint8_t quads;  ///< number of quadrilaterals
  /// True if the shape has no volume: polygons and lines.
  bool is_flat = false;
};

constexpr std::array<Face, 6> kHexahedronFaces = {kFaceCorners[1], kFaceCorners[3],
                                                  kFaceCorners[2], kFaceCorners[4],
                                                  kFaceCorners[0], kFaceCorners[5]};
constexpr std::array<Edge, 9> kWedgeEdges = {
    {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}}};
constexpr std::array<Face, 5> kWedgeFaces = {
    {{0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}, {0, 2, 1, 0}, {3, 4, 5, 3}}};
constexpr std::array<Edge, 8> kPyramidEdges = {
    {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}}};
constexpr std::array<Face, 5> kPyramidFaces = {
    {{0, 3, 2, 1}, {0, 1, 4, 0}, {1, 2, 4, 1}, {2, 3, 4, 2}, {3, 0, 4, 3}}};
constexpr std::array<Edge, 6> kTetrahedronEdges = {
    {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
constexpr std::array<Face, 4> kTetrahedronFaces = {
    {{0, 1, 3, 0}, {1, 2, 3, 1}, {2, 0, 3, 2}, {0, 2, 1, 0}}};
constexpr std::array<Edge, 4> kQuadEdges = {{{0, 1}, {1, 2}, {2, 3}, {3, 0}}};
constexpr std::array<Face, 1> kQuadFaces = {{{0, 1, 2, 3}}};
constexpr std::array<Edge, 3> kTriangleEdges = {{{0, 1}, {1, 2}, {2, 0}}};
constexpr std::array<Edge, 1> kLineEdges = {{{0, 1}}};

constexpr Solid kHexahedron = {8, kEdgeCorners, kHexahedronFaces, 6};
constexpr Solid kWedge = {6, kWedgeEdges, kWedgeFaces, 3};
constexpr Solid kPyramid = {5, kPyramidEdges, kPyramidFaces, 1};
constexpr Solid kTetrahedron = {4, kTetrahedronEdges, kTetrahedronFaces, 0};
constexpr Solid kQuad = {4, kQuadEdges, kQuadFaces, 1, true};
constexpr Solid kTriangle = {3, kTriangleEdges, {}, 0, true};
constexpr Solid kLine = {2, kLineEdges, {}, 0, true};

bool joins(const Edge& edge, std::uint8_t a, std::uint8_t b) {
  return (edge[0] == a && edge[1] == b) || (edge[0] == b && edge[1] == a);
}

/// Returns the position of the mid node of the edge between two corners.
std::uint8_t middle_of(const Solid& solid, std::uint8_t a, std::uint8_t b) {
  std::uint8_t e = 0;
  while (!joins(solid.edges[e], a, b)) ++e;
  return static_cast<std::uint8_t>(solid.corners + e);
}

void add_parallel(MidNode& node, std::uint8_t position, std::uint8_t beside) {
  const auto end = node.parallel.begin() + node.parallels;
  if (node.parallels == 3 || std::find(node.parallel.begin(), end, position) != end) return;
  node.parallel[node.parallels] = position;
  node.beside[node.parallels++] = beside;
}

MidNode edge_node(const Solid& solid, std::size_t e) {
  MidNode node;
  const Edge& edge = solid.edges[e];
  node.corner = {edge[0], edge[1]};
  std::uint8_t sides = 0;
  for (std::size_t f = 0; f < solid.faces.size(); ++f) {
    const Face& face = solid.faces[f];
    for (std::size_t i = 0; i < 4; ++i) {
      if (!joins(edge, face[i], face[(i + 1) % 4])) continue;
      if (sides < 2) node.side[sides++] = static_cast<std::uint8_t>(f);
      const std::uint8_t after = face[(i + 2) % 4], before = face[(i + 3) % 4];
      if (f < solid.quads)
        add_parallel(node, middle_of(solid, after, before), edge[0] == face[i] ? before : after);
    }
  }
  node.has_sides = !solid.is_flat;
  return node;
}

/// For each edge of a hexahedron, adds the diagonally opposite edge to the edge's list of parallel
/// edges.
void add_opposite_edges(NodeLayout& layout) {
  for (std::uint8_t p = 8; p < 20; ++p) {
    MidNode& node = layout.mid[p];
    const MidNode& next = layout.mid[node.parallel[0]];
    for (std::size_t i = 0; i < next.parallels; ++i) {
      const std::uint8_t other = next.parallel[i];
      const auto& ends = layout.mid[other].corner;
      const std::uint8_t across = next.beside[i] == ends[0] ? ends[1] : ends[0];
      if (other != p)
        add_parallel(node, other, node.beside[0] == next.corner[0] ? next.beside[i] : across);
    }
  }
}

MidNode face_node(const Solid& solid, std::size_t f) {
  MidNode node;
  node.kind = MidNode::face;
  node.corner = solid.faces[f];
  for (std::size_t i = 0; i < 4; ++i)
    node.middle[i] = middle_of(solid, node.corner[i], node.corner[(i + 1) % 4]);
  node.has_middle = true;
  return node;
}

/// Returns the node in the middle of a hexahedron. If the faces have nodes, the body node refers to
/// four edge nodes and four face nodes. These eight nodes are in the plane halfway between the
/// bottom and the top of the hexahedron.
MidNode body_node(bool has_faces) {
  MidNode node;
  node.kind = MidNode::body;
  node.has_middle = has_faces;
  if (has_faces) {
    node.corner = {16, 17, 18, 19};
    node.middle = {22, 21, 23, 20};
  }
  return node;
}

enum Body : std::uint8_t { none, one };

[[gnu::cold]] NodeLayout layout_of(const Solid& solid, bool edges, std::uint8_t faces, Body body) {
  NodeLayout layout;
  layout.corners = layout.nodes = solid.corners;
  if (edges)
    for (std::size_t e = 0; e < solid.edges.size(); ++e)
      layout.mid[layout.nodes++] = edge_node(solid, e);
  if (edges && solid.corners == 8) add_opposite_edges(layout);
  for (std::uint8_t f = 0; f < faces; ++f) {
    layout.mid[layout.nodes] = face_node(solid, f);
    // In the list of faces of a hexahedron, opposite faces are next to each other.
    if (solid.corners == 8)
      add_parallel(layout.mid[layout.nodes], static_cast<std::uint8_t>(20 + (f ^ 1)),
                   solid.faces[f ^ 1u][0]);
    ++layout.nodes;
  }
  if (body == one) layout.mid[layout.nodes++] = body_node(faces == 6);
  if (!solid.is_flat)
    for (const Face& face : solid.faces) layout.sides[layout.side_count++] = face;
  return layout;
}

}  // namespace

const NodeLayout* node_layout(CellShape shape, std::uint32_t nodes) {
  static const NodeLayout line3 = layout_of(kLine, true, 0, none);
  static const NodeLayout triangle6 = layout_of(kTriangle, true, 0, none);
  static const NodeLayout triangle7 = layout_of(kTriangle, true, 0, one);
  static const NodeLayout quad8 = layout_of(kQuad, true, 0, none);
  static const NodeLayout quad9 = layout_of(kQuad, true, 1, none);
  static const NodeLayout tetrahedron10 = layout_of(kTetrahedron, true, 0, none);
  static const NodeLayout pyramid13 = layout_of(kPyramid, true, 0, none);
  static const NodeLayout pyramid14 = layout_of(kPyramid, true, 1, none);
  static const NodeLayout wedge15 = layout_of(kWedge, true, 0, none);
  static const NodeLayout wedge18 = layout_of(kWedge, true, 3, none);
  static const NodeLayout hexahedron9 = layout_of(kHexahedron, false, 0, one);
  static const NodeLayout hexahedron20 = layout_of(kHexahedron, true, 0, none);
  static const NodeLayout hexahedron21 = layout_of(kHexahedron, true, 0, one);
  static const NodeLayout hexahedron24 = layout_of(kHexahedron, true, 4, none);
  static const NodeLayout hexahedron26 = layout_of(kHexahedron, true, 6, none);
  static const NodeLayout hexahedron27 = layout_of(kHexahedron, true, 6, one);
  switch (shape) {
    case CellShape::line: return nodes == 3 ? &line3 : nullptr;
    case CellShape::triangle: return nodes == 6 ? &triangle6 : nodes == 7 ? &triangle7 : nullptr;
    case CellShape::quad: return nodes == 8 ? &quad8 : nodes == 9 ? &quad9 : nullptr;
    case CellShape::tetrahedron: return nodes == 10 ? &tetrahedron10 : nullptr;
    case CellShape::pyramid: return nodes == 13 ? &pyramid13 : nodes == 14 ? &pyramid14 : nullptr;
    case CellShape::wedge: return nodes == 15 ? &wedge15 : nodes == 18 ? &wedge18 : nullptr;
    case CellShape::hexahedron:
      switch (nodes) {
        case 9: return &hexahedron9;
        case 21: return &hexahedron21;
        case 24: return &hexahedron24;
        case 26: return &hexahedron26;
        case 27: return &hexahedron27;
        default: return nodes >= 20 ? &hexahedron20 : nullptr;
      }
    default: return nullptr;
  }
}

}  // namespace shm
