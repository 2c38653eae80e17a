#include "mesh/node_layout.h"

#include <algorithm>
#include <span>

#include "mesh/hexahedron.h"
#include "shm/cell_nodes.h"

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
  layout.corners = solid.corners;
  layout.nodes = solid.corners;
  layout.mid.resize(solid.corners + (edges ? solid.edges.size() : 0) + faces +
                    (body == one ? 1 : 0));
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

// --- grids

[[gnu::cold]] NodeGrid grid_of(std::uint8_t order) {
  const std::uint32_t side = order + 1u;
  NodeGrid grid;
  grid.order = order;
  grid.places = node_places(CellShape::hexahedron, NodeScheme::lagrange, order);
  grid.positions.resize(grid.places.size());
  const auto index = [&](const NodeGrid::Place& place) {
    return place[0] + side * (place[1] + side * place[2]);
  };
  for (std::uint16_t p = 0; p < grid.places.size(); ++p) grid.positions[index(grid.places[p])] = p;
  for (std::uint32_t reversed = 0; reversed < 8; ++reversed) {
    std::vector<std::uint16_t>& row = grid.rows[reversed];
    row.resize(grid.places.size());
    std::size_t rank = 0;
    for (std::uint16_t c = 0; c < 8; ++c) row[rank++] = c;
    // In the order of `positions`, a row along the first axis follows another.
    for (std::uint32_t i = 0; i < grid.places.size(); ++i) {
      NodeGrid::Place place = grid.places[grid.positions[i]];
      for (std::uint32_t a = 0; a < 3; ++a)
        if ((reversed >> a & 1) != 0) place[a] = static_cast<std::uint8_t>(order - place[a]);
      const std::uint16_t position = grid.positions[index(place)];
      if (position >= 8) row[rank++] = position;
    }
  }
  return grid;
}

/// Returns the node at a place of a grid. The first corner of its edge or face is the one with the
/// lowest coordinates; the second corner of a face is on its first axis.
[[gnu::cold]] MidNode grid_node(const NodeGrid& grid, const NodeGrid::Place& place) {
  const auto order = static_cast<std::uint8_t>(grid.order);
  MidNode node;
  node.order = order;
  std::array<std::uint32_t, 3> inner{};  // axes along which the node is not at an end
  std::uint32_t count = 0;
  for (std::uint32_t a = 0; a < 3; ++a)
    if (place[a] != 0 && place[a] != order) inner[count++] = a;
  node.kind = count == 1 ? MidNode::edge : count == 2 ? MidNode::face : MidNode::body;
  if (node.kind == MidNode::body) return node;
  const auto corner = [&](bool first_end, bool second_end) {
    NodeGrid::Place end = place;
    end[inner[0]] = first_end ? order : 0;
    if (count == 2) end[inner[1]] = second_end ? order : 0;
    return static_cast<std::uint8_t>(grid.position(end));
  };
  for (std::uint32_t i = 0; i < count; ++i) node.step[i] = place[inner[i]];
  node.corner = {corner(false, false), corner(true, false)};
  if (node.kind == MidNode::face) {
    node.corner[2] = corner(true, true);
    node.corner[3] = corner(false, true);
    return node;
  }
  std::uint8_t sides = 0;
  for (std::uint8_t f = 0; f < kHexahedronFaces.size(); ++f)
    for (std::size_t i = 0; i < 4; ++i)
      if (joins({node.corner[0], node.corner[1]}, kHexahedronFaces[f][i],
                kHexahedronFaces[f][(i + 1) % 4]))
        node.side[sides++] = f;
  node.has_sides = true;
  return node;
}

[[gnu::cold]] NodeLayout layout_of_grid(std::uint8_t order) {
  NodeLayout layout = layout_of(kHexahedron, false, 0, none);
  layout.grid = grid_of(order);
  layout.nodes = static_cast<std::uint16_t>(layout.grid.places.size());
  layout.mid.resize(layout.nodes);
  for (std::size_t p = 8; p < layout.nodes; ++p) {
    layout.mid[p] = grid_node(layout.grid, layout.grid.places[p]);
    layout.mid[p].continues = p > 8 && layout.mid[p].corner == layout.mid[p - 1].corner;
  }
  return layout;
}

template <std::uint8_t order>
const NodeLayout* grid_layout() {
  static const NodeLayout kLayout = layout_of_grid(order);
  return &kLayout;
}

const NodeLayout* grid_layout_of(std::uint32_t nodes) {
  switch (nodes) {
    case 64: return grid_layout<3>();
    case 125: return grid_layout<4>();
    case 216: return grid_layout<5>();
    case 343: return grid_layout<6>();
    case 512: return grid_layout<7>();
    case 729: return grid_layout<8>();
    case 1000: return grid_layout<9>();
    case 1331: return grid_layout<10>();
    default: return nullptr;
  }
}

/// A kind of second-order cells.
struct Kind {
  CellShape shape;
  std::uint8_t nodes;
  const Solid* solid;
  bool edges;
  std::uint8_t faces;
  Body body;
};
constexpr std::array<Kind, 16> kKinds = {
    {{CellShape::line, 3, &kLine, true, 0, none},
     {CellShape::triangle, 6, &kTriangle, true, 0, none},
     {CellShape::triangle, 7, &kTriangle, true, 0, one},
     {CellShape::quad, 8, &kQuad, true, 0, none},
     {CellShape::quad, 9, &kQuad, true, 1, none},
     {CellShape::tetrahedron, 10, &kTetrahedron, true, 0, none},
     {CellShape::pyramid, 13, &kPyramid, true, 0, none},
     {CellShape::pyramid, 14, &kPyramid, true, 1, none},
     {CellShape::wedge, 15, &kWedge, true, 0, none},
     {CellShape::wedge, 18, &kWedge, true, 3, none},
     {CellShape::hexahedron, 9, &kHexahedron, false, 0, one},
     {CellShape::hexahedron, 20, &kHexahedron, true, 0, none},
     {CellShape::hexahedron, 21, &kHexahedron, true, 0, one},
     {CellShape::hexahedron, 24, &kHexahedron, true, 4, none},
     {CellShape::hexahedron, 26, &kHexahedron, true, 6, none},
     {CellShape::hexahedron, 27, &kHexahedron, true, 6, one}}};

[[gnu::cold]] std::array<NodeLayout, kKinds.size()> second_order_layouts() {
  std::array<NodeLayout, kKinds.size()> layouts;
  for (std::size_t i = 0; i < kKinds.size(); ++i)
    layouts[i] = layout_of(*kKinds[i].solid, kKinds[i].edges, kKinds[i].faces, kKinds[i].body);
  return layouts;
}

}  // namespace

const NodeLayout* node_layout(CellShape shape, std::uint32_t nodes) {
  for (std::size_t i = 0; i < kKinds.size(); ++i) {
    if (kKinds[i].shape != shape || kKinds[i].nodes != nodes) continue;
    static const std::array<NodeLayout, kKinds.size()> kLayouts = second_order_layouts();
    return &kLayouts[i];
  }
  if (shape != CellShape::hexahedron || nodes <= 20) return nullptr;
  // The first twelve mid nodes of a hexahedron with another number of nodes are those of the edges.
  const NodeLayout* const grid = grid_layout_of(nodes);
  return grid != nullptr ? grid : node_layout(shape, 20);
}

}  // namespace shm
