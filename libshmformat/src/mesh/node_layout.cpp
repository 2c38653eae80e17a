#include "mesh/node_layout.h"

#include <algorithm>
#include <span>

#include "mesh/cell_frame.h"
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

const Solid* solid_of(CellShape shape) {
  switch (shape) {
    case CellShape::line: return &kLine;
    case CellShape::triangle: return &kTriangle;
    case CellShape::quad: return &kQuad;
    case CellShape::tetrahedron: return &kTetrahedron;
    case CellShape::pyramid: return &kPyramid;
    case CellShape::wedge: return &kWedge;
    case CellShape::hexahedron: return &kHexahedron;
    default: return nullptr;
  }
}

[[gnu::cold]] NodeGrid grid_of(CellShape shape, NodeScheme scheme, std::uint32_t order) {
  const std::uint32_t side = order + 1u;
  NodeGrid grid;
  grid.order = order;
  grid.places = node_places(shape, scheme, order);
  grid.positions.assign(std::size_t{side} * side * side, NodeGrid::kNowhere);
  const auto index = [&](const NodeGrid::Place& place) {
    return place[0] + side * (place[1] + side * place[2]);
  };
  for (std::uint16_t p = 0; p < grid.places.size(); ++p) grid.positions[index(grid.places[p])] = p;
  const std::uint16_t corners = solid_of(shape)->corners;
  for (std::uint32_t reversed = 0; reversed < (corners == 8 ? 8u : 1u); ++reversed) {
    std::vector<std::uint16_t>& row = grid.rows[reversed];
    for (std::uint16_t c = 0; c < corners; ++c) row.push_back(c);
    // In the order of `positions`, a row along the first axis follows another.
    for (std::uint32_t z = 0; z < side; ++z)
      for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x) {
          NodeGrid::Place place{static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y),
                                static_cast<std::uint8_t>(z)};
          for (std::uint32_t a = 0; a < 3; ++a)
            if ((reversed >> a & 1) != 0) place[a] = static_cast<std::uint8_t>(order - place[a]);
          const std::uint16_t position = grid.positions[index(place)];
          if (position != NodeGrid::kNowhere && position >= corners) row.push_back(position);
        }
  }
  return grid;
}

/// Lists the mid nodes of a grid, in the order of node_places().
class GridNodes {
 public:
  GridNodes(CellShape shape, NodeLayout& layout)
      : frame_(frame_of(shape)),
        solid_(*solid_of(shape)),
        layout_(layout),
        order_(layout.grid.order),
        position_(layout.corners) {
    for (const auto& [from, to] : frame_.edges)
      for (std::uint32_t step = 1; step < order_; ++step) add(on_edge(from, to, step));
    for (const bool is_triangle : {shape == CellShape::wedge, shape != CellShape::wedge})
      for (const auto& face : is_triangle ? frame_.triangles : frame_.quads) {
        const std::uint32_t nodes =
            (order_ - 1) * (is_triangle ? order_ - 2 : 2 * (order_ - 1)) / 2;
        for (std::uint32_t i = 0; i < nodes && position_ < layout_.nodes; ++i)
          add(on_face(face, is_triangle));
      }
    MidNode body;
    body.kind = MidNode::body;
    body.order = static_cast<std::uint8_t>(order_);
    while (position_ < layout_.nodes) add(body);
  }

 private:
  void add(const MidNode& node) {
    MidNode& added = layout_.mid[position_] = node;
    if (position_ > layout_.corners)
      added.continues = added.kind == layout_.mid[position_ - 1].kind &&
                        added.corner == layout_.mid[position_ - 1].corner;
    ++position_;
  }
  MidNode on_edge(std::uint8_t from, std::uint8_t to, std::uint32_t step) const {
    MidNode node;
    node.corner = {from, to};
    node.step[0] = static_cast<std::uint8_t>(step);
    node.order = static_cast<std::uint8_t>(order_);
    std::uint8_t sides = 0;
    for (std::uint8_t f = 0; f < solid_.faces.size(); ++f)
      for (std::size_t i = 0; i < 4; ++i)
        if (sides < 2 && joins({from, to}, solid_.faces[f][i], solid_.faces[f][(i + 1) % 4]))
          node.side[sides++] = f;
    node.has_sides = !solid_.is_flat;
    return node;
  }
  MidNode on_face(const CellFrame::Face& face, bool is_triangle) const {
    const auto& [from, first, second] = face;
    MidNode node;
    node.kind = MidNode::face;
    node.is_on_triangle = is_triangle;
    node.order = static_cast<std::uint8_t>(order_);
    node.step = {static_cast<std::uint8_t>(steps_towards(from, first, second)),
                 static_cast<std::uint8_t>(steps_towards(from, second, first))};
    NodeGrid::Place opposite{};
    for (std::size_t a = 0; a < 3; ++a)
      opposite[a] =
          static_cast<std::uint8_t>(order_ * (frame_.corners[first][a] + frame_.corners[second][a] -
                                              frame_.corners[from][a]));
    if (is_triangle)
      node.corner = {from, first, second, from};
    else
      node.corner = {from, first, static_cast<std::uint8_t>(layout_.grid.position(opposite)),
                     second};
    return node;
  }
  /// Returns the steps of the node at position_ from corner `from` towards `to`. `other`: the third
  /// corner by which the face is given.
  std::uint32_t steps_towards(std::uint8_t from, std::uint8_t to, std::uint8_t other) const {
    const auto& corner = frame_.corners;
    const auto differs = [&](std::uint8_t c, std::size_t a) {
      return corner[c][a] != corner[from][a];
    };
    const auto distance = [&](std::size_t a) {
      const std::uint32_t at = layout_.grid.places[position_][a];
      return corner[from][a] == 0 ? at : order_ - at;
    };
    for (std::size_t a = 0; a < 3; ++a)
      if (differs(to, a) && !differs(other, a)) return distance(a);
    // Steps towards both corners lead along this axis, in the same direction. Steps towards `other`
    // lead along another axis, too.
    std::size_t a = 0;
    while (!differs(to, a)) ++a;
    return distance(a) - steps_towards(from, other, to);
  }

  CellFrame frame_;
  const Solid& solid_;
  NodeLayout& layout_;
  std::uint32_t order_;
  std::size_t position_;
};

[[gnu::cold]] void add_grid(NodeLayout& layout, const BlockInfo& block) {
  layout.grid = grid_of(block.shape, block.scheme, cell_order(block));
  layout.nodes = static_cast<std::uint16_t>(layout.grid.places.size());
  layout.mid.resize(layout.nodes);
  GridNodes(block.shape, layout);
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

}  // namespace

bool has_grid(const BlockInfo& block) { return cell_order(block) >= kLeastGridOrder; }

std::unique_ptr<const NodeLayout> node_layout(const BlockInfo& block) {
  const CellShape shape = block.shape;
  std::uint32_t nodes = block.nodes_per_cell;
  // The first twelve mid nodes of a hexahedron with an unusual number of nodes are those of the
  // edges.
  if (shape == CellShape::hexahedron && nodes > 20 && nodes != 21 && nodes != 24 && nodes != 26 &&
      nodes != 27)
    nodes = 20;
  const bool is_grid = has_grid(block);
  Kind kind{shape, 0, is_grid ? solid_of(shape) : nullptr, false, 0, none};
  for (const Kind& known : kKinds)
    if (known.shape == shape && known.nodes == nodes) kind = known;
  if (kind.solid == nullptr) return nullptr;
  auto layout =
      std::make_unique<NodeLayout>(layout_of(*kind.solid, kind.edges, kind.faces, kind.body));
  if (is_grid) add_grid(*layout, block);
  return layout;
}

}  // namespace shm
