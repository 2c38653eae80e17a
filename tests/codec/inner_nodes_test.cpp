// Tests of the nodes of second-order cells: their positions, their size in files, and round trips.
#include "codecs/surface/cells/mid_nodes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

#include "codecs/surface/cells/mid_node_numbers.h"
#include "support/second_order_mesh.h"

namespace shm {
namespace {

using Kind = MidNode::Kind;

/// Parametric coordinates of the 27 nodes of VTK's triquadratic hexahedron, in units of 1/2.
constexpr std::array<std::array<int, 3>, 27> kTriquadratic = {
    {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 0, 2}, {2, 0, 2}, {2, 2, 2},
     {0, 2, 2}, {1, 0, 0}, {2, 1, 0}, {1, 2, 0}, {0, 1, 0}, {1, 0, 2}, {2, 1, 2},
     {1, 2, 2}, {0, 1, 2}, {0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}, {0, 1, 1},
     {2, 1, 1}, {1, 0, 1}, {1, 2, 1}, {1, 1, 0}, {1, 1, 2}, {1, 1, 1}}};

TEST(NodeLayout, OfHexahedraIsVtks) {
  const auto layout = node_layout({0, {}, CellShape::hexahedron, 27});
  ASSERT_NE(layout, nullptr);
  for (std::size_t p = 8; p < 27; ++p) {
    const MidNode* node = layout->at(p);
    ASSERT_NE(node, nullptr) << p;
    const auto mean = [&](const auto& positions, std::size_t count, int axis) {
      int sum = 0;
      for (std::size_t i = 0; i < count; ++i) sum += kTriquadratic[positions[i]][axis];
      return sum / static_cast<int>(count);
    };
    for (int a = 0; a < 3; ++a) {
      EXPECT_EQ(kTriquadratic[p][a], mean(node->corner, node->kind == Kind::edge ? 2 : 4, a)) << p;
      if (node->kind == Kind::edge) continue;
      EXPECT_EQ(kTriquadratic[p][a], mean(node->middle, 4, a)) << p;
      // middle[i] is the midpoint of the edge from corner[i] to the next corner
      for (std::size_t i = 0; i < 4; ++i)
        EXPECT_EQ(2 * kTriquadratic[node->middle[i]][a],
                  kTriquadratic[node->corner[i]][a] + kTriquadratic[node->corner[(i + 1) % 4]][a]);
    }
    EXPECT_EQ(node->kind, p < 20 ? Kind::edge : p < 26 ? Kind::face : Kind::body);
    EXPECT_EQ(node->parallels, p < 20 ? 3 : p < 26 ? 1 : 0);
    for (std::size_t i = 0; i < node->parallels; ++i) {
      // The vector from node p to node parallel[i] equals the vector from node corner[0] to node
      // beside[i].
      int away = 0;
      for (int a = 0; a < 3; ++a) {
        const int step = kTriquadratic[node->parallel[i]][a] - kTriquadratic[p][a];
        EXPECT_EQ(kTriquadratic[node->beside[i]][a] - kTriquadratic[node->corner[0]][a], step);
        away += step != 0 ? 1 : 0;
      }
      EXPECT_EQ(away, i == 2 ? 2 : 1) << p;
    }
  }
  EXPECT_EQ(layout->at(7), nullptr);
  EXPECT_EQ(layout->at(27), nullptr);
}

TEST(NodeLayout, OfAllShapes) {
  using enum CellShape;
  struct Expected {
    CellShape shape;
    std::uint32_t nodes;
    std::array<int, 3> kinds;
  };
  for (const Expected& expected :
       std::vector<Expected>{{line, 3, {1, 0, 0}},          {triangle, 6, {3, 0, 0}},
                             {triangle, 7, {3, 0, 1}},      {quad, 8, {4, 0, 0}},
                             {quad, 9, {4, 1, 0}},          {tetrahedron, 10, {6, 0, 0}},
                             {pyramid, 13, {8, 0, 0}},      {pyramid, 14, {8, 1, 0}},
                             {wedge, 15, {9, 0, 0}},        {wedge, 18, {9, 3, 0}},
                             {hexahedron, 9, {0, 0, 1}},    {hexahedron, 20, {12, 0, 0}},
                             {hexahedron, 21, {12, 0, 1}},  {hexahedron, 23, {12, 0, 0}},
                             {hexahedron, 24, {12, 4, 0}},  {hexahedron, 26, {12, 6, 0}},
                             {hexahedron, 27, {12, 6, 1}},  {hexahedron, 63, {12, 0, 0}},
                             {hexahedron, 64, {24, 24, 8}}, {hexahedron, 1331, {108, 486, 729}},
                             {tetrahedron, 20, {12, 4, 0}}, {tetrahedron, 35, {18, 12, 1}},
                             {pyramid, 30, {16, 8, 1}},     {wedge, 40, {18, 14, 2}},
                             {triangle, 10, {6, 1, 0}},     {quad, 16, {8, 4, 0}},
                             {line, 5, {3, 0, 0}}}) {
    const auto layout = node_layout({0, {}, expected.shape, expected.nodes});
    ASSERT_NE(layout, nullptr);
    std::array<int, 3> kinds{};
    for (std::size_t p = 0; p < expected.nodes; ++p)
      if (const MidNode* node = layout->at(p)) {
        ++kinds[node->kind];
        if (node->has_sides) {
          // Both ends are corners of both sides.
          for (std::uint8_t side : node->side)
            for (std::size_t e = 0; e < 2; ++e) {
              const auto& corners = layout->sides[side];
              EXPECT_NE(std::find(corners.begin(), corners.end(), node->corner[e]), corners.end());
            }
          EXPECT_NE(node->side[0], node->side[1]);
        }
      }
    EXPECT_EQ(kinds, expected.kinds) << expected.nodes;
  }
  EXPECT_EQ(node_layout({0, {}, hexahedron, 8}), nullptr);
  EXPECT_EQ(node_layout({0, {}, hexahedron, 16}), nullptr);
  EXPECT_EQ(node_layout({0, {}, tetrahedron, 4}), nullptr);
  EXPECT_EQ(node_layout({0, {}, other, 27}), nullptr);
  EXPECT_EQ(node_layout({0, {}, polyhedron, 20}), nullptr);
}

TEST(NodeLayout, OfGridsIsThatOfPlaces) {
  using enum CellShape;
  for (const CellShape shape : {line, triangle, quad, tetrahedron, pyramid, wedge, hexahedron})
    for (const NodeScheme scheme :
         {NodeScheme::lagrange, NodeScheme::bezier, NodeScheme::serendipity})
      for (std::uint32_t order = kLeastGridOrder; order <= kMostGridOrder; ++order) {
        if (shape == line && scheme == NodeScheme::serendipity) continue;
        const std::vector<NodePlace> places = node_places(shape, scheme, order);
        const auto made =
            node_layout({0, {}, shape, static_cast<std::uint32_t>(places.size()), scheme});
        ASSERT_NE(made, nullptr);
        const NodeLayout& layout = *made;
        ASSERT_EQ(layout.grid.order, order);
        ASSERT_EQ(layout.grid.places, places);
        for (std::uint32_t p = 0; p < layout.nodes; ++p) {
          const NodePlace& place = places[p];
          EXPECT_EQ(layout.grid.position(place), p);
          const MidNode* node = layout.at(p);
          ASSERT_EQ(node == nullptr, p < layout.corners);
          if (node == nullptr || node->kind == Kind::body) continue;
          // The node is at the sum of its steps from its first corner.
          const NodePlace& first = places[node->corner[0]];
          for (std::uint32_t a = 0; a < 3; ++a) {
            int at = first[a];
            for (std::size_t i = 0; i < (node->kind == Kind::edge ? 1u : 2u); ++i) {
              const std::size_t end = i == 0 ? 1 : node->is_on_triangle ? 2 : 3;
              at += (places[node->corner[end]][a] - first[a]) / static_cast<int>(order) *
                    node->step[i];
            }
            EXPECT_EQ(place[a], at) << shape_name(shape) << ' ' << p;
          }
        }
        for (const auto& rows : layout.grid.rows) {
          if (&rows != layout.grid.rows.data() && shape != hexahedron) {
            EXPECT_TRUE(rows.empty());
            continue;
          }
          std::vector<std::uint16_t> sorted = rows;
          std::sort(sorted.begin(), sorted.end());
          ASSERT_EQ(sorted.size(), places.size());
          for (std::uint32_t p = 0; p < layout.nodes; ++p) EXPECT_EQ(sorted[p], p);
        }
      }
  const auto cubic = node_layout({0, {}, hexahedron, 64});
  const auto& rows = cubic->grid.rows;
  EXPECT_EQ(rows[0][8], 8);   // the first row, from corner 0
  EXPECT_EQ(rows[1][8], 9);   // the same row, from corner 1
  EXPECT_EQ(rows[4][8], 16);  // the row from corner 4
}

/// Adds vertices to a surface and returns their slots.
template <std::size_t kCount>
std::array<std::uint32_t, kCount> add_vertices(ActiveSurface& surface) {
  std::array<std::uint32_t, kCount> slots{};
  for (std::uint32_t& slot : slots) slot = surface.add_vertex();
  return slots;
}

TEST(MiddleTable, PlacesOnTrianglesDoNotDependOnTheFirstCorner) {
  ActiveSurface surface;
  MiddleTable table(surface);
  constexpr std::uint32_t kOrder = 5;
  const auto v = add_vertices<3>(surface);
  std::array<std::uint32_t, 3> corners = {0, 1, 2};  // indices in v
  do {
    for (std::uint8_t s = 1; s < kOrder; ++s)
      for (std::uint8_t t = 1; s + t < kOrder; ++t) {
        // The node has weight s at v[1], t at v[2], and the rest at v[0].
        const std::array<std::uint32_t, 3> weights = {kOrder - s - t, s, t};
        const MiddleTable::Place place =
            table.triangle({v[corners[0]], v[corners[1]], v[corners[2]]},
                           {static_cast<std::uint8_t>(weights[corners[1]]),
                            static_cast<std::uint8_t>(weights[corners[2]])},
                           kOrder);
        EXPECT_EQ(place.low, v[0]);
        EXPECT_EQ(place.middle, v[1]);
        EXPECT_EQ(place.high, v[2]);
        EXPECT_EQ(place.index, s - 1 + (kOrder - 1) * (t - 1));
      }
  } while (std::next_permutation(corners.begin(), corners.end()));
}

TEST(MiddleTable, KeepsTrianglesOfTheSameEdgeApart) {
  ActiveSurface surface;
  MiddleTable table(surface);
  const auto v = add_vertices<6>(surface);
  const auto left = table.triangle({v[0], v[1], v[2]}, {1, 1}, 3),
             right = table.triangle({v[0], v[1], v[3]}, {1, 1}, 3);
  table.put(left, v[4]);
  EXPECT_EQ(table.find(right), kNone);
  table.put(right, v[5]);
  EXPECT_EQ(table.find(left), v[4]);
  EXPECT_EQ(table.find(right), v[5]);
  table.forget(v[4]);
  EXPECT_EQ(table.find(left), kNone);
}

TEST(MiddleTable, PlacesOnFacesDoNotDependOnTheFirstCorner) {
  ActiveSurface surface;
  MiddleTable table(surface);
  constexpr std::uint32_t kOrder = 5;
  const auto v = add_vertices<4>(surface);
  std::array<std::uint32_t, 4> corners = {2, 0, 3, 1};  // indices in v
  do {
    // A node with these steps along the sides 01 and 03 of the face 0123
    std::set<std::uint32_t> indices;
    for (std::uint32_t s = 1; s < kOrder; ++s)
      for (std::uint32_t t = 1; t < kOrder; ++t) {
        const auto place_of = [&](std::array<std::uint32_t, 4> face, std::uint32_t a,
                                  std::uint32_t b) {
          return table.face({v[face[0]], v[face[1]], v[face[2]], v[face[3]]},
                            {static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b)}, kOrder);
        };
        const auto [p, q, r, o] = corners;
        const MiddleTable::Place place = place_of({p, q, r, o}, s, t);
        indices.insert(place.index);
        EXPECT_EQ(place.low, v[0]);
        // The same face, from another corner and in the opposite direction
        for (const MiddleTable::Place& other :
             {place_of({q, r, o, p}, t, kOrder - s), place_of({r, o, p, q}, kOrder - s, kOrder - t),
              place_of({o, p, q, r}, kOrder - t, s), place_of({p, o, r, q}, t, s)}) {
          EXPECT_EQ(other.index, place.index);
          EXPECT_EQ(other.low, place.low);
          EXPECT_EQ(other.high, place.high);
        }
      }
    EXPECT_EQ(indices.size(), (kOrder - 1) * (kOrder - 1));
  } while (std::next_permutation(corners.begin(), corners.end()));
}

TEST(MiddleTable, LeadsFromPlacesToLiveVertices) {
  ActiveSurface surface;
  MiddleTable table(surface);
  const auto v = add_vertices<6>(surface);
  const auto edge = table.edge(v[1], v[0]);
  EXPECT_EQ(table.find(edge), kNone);
  table.put(edge, v[4]);
  EXPECT_EQ(table.find(table.edge(v[0], v[1])), v[4]);
  // A face has the same key, whatever its first corner and its direction are. The key of a face
  // differs from the keys of all edges.
  table.put(table.face({v[2], v[1], v[0], v[3]}), v[5]);
  EXPECT_EQ(table.find(table.face({v[3], v[0], v[1], v[2]})), v[5]);
  EXPECT_EQ(table.find(table.edge(v[0], v[2])), kNone);

  table.open(v[4]) = 7;
  table.put(edge, v[4]);
  EXPECT_EQ(table.open(v[4]), 7u);
  table.put(edge, v[3]);  // replaces the entry
  EXPECT_EQ(table.find(edge), v[3]);
  EXPECT_EQ(table.open(v[4]), 0u);
  table.put(table.edge(v[1], v[2]), v[3]);  // a vertex has at most one entry
  EXPECT_EQ(table.find(edge), kNone);
  table.forget(v[3]);
  table.forget(v[4]);
  EXPECT_EQ(table.find(table.edge(v[1], v[2])), kNone);
}

TEST(MiddleTable, OtherVerticesInTheSameSlotsAreOthers) {
  ActiveSurface surface;
  MiddleTable table(surface);
  std::vector<std::uint32_t> fresh;
  for (int i = 0; i < 2; ++i) fresh.push_back(surface.add_vertex());
  const std::uint32_t middle = surface.add_vertex();
  table.put(table.edge(fresh[0], fresh[1]), middle);
  const auto taken = fresh;
  surface.finalize(fresh[1]);
  // Repeats until the slot is reused.
  std::uint32_t again = kNone;
  for (int i = 0; i < 2000 && again != taken[1]; ++i) {
    again = surface.add_vertex();
    if (again != taken[1]) surface.finalize(again);
  }
  ASSERT_EQ(again, taken[1]);
  EXPECT_EQ(table.find(table.edge(taken[0], again)), kNone);
  const std::uint32_t other = surface.add_vertex();
  table.put(table.edge(taken[0], again), other);
  EXPECT_EQ(table.find(table.edge(taken[0], again)), other);
  table.forget(middle);
  EXPECT_EQ(table.find(table.edge(taken[0], again)), other);
}

constexpr std::array kCodecs = {ConnectivityCodec::rows, ConnectivityCodec::replay,
                                ConnectivityCodec::mixed, ConnectivityCodec::paper};

TEST(MidNodes, OfAllShapesComeBack) {
  for (Order order : {Order::keep, Order::stream})
    for (std::uint64_t cells : {0u, 7u})
      for (ConnectivityCodec codec : kCodecs) {
        TestMesh mesh = second_order_cells();
        mesh.schema.order = order;
        WriteOptions options;
        options.connectivity = codec;
        options.segment_cells = cells;
        expect_round_trip(mesh, options);
        if (testing::Test::HasFailure()) return;
      }
}

// The decoder may rotate the corners of hexahedra with eight nodes, but not those of second-order
// cells next to these hexahedra. Encoder and decoder must nevertheless agree on the corner order of
// a face between two second-order cells.
TEST(MidNodes, BesideHexahedraThatMayTurn) {
  for (const auto codec : {ConnectivityCodec::paper, ConnectivityCodec::rows,
                           ConnectivityCodec::mixed, ConnectivityCodec::replay})
    for (const std::uint32_t every : {2u, 3u, 5u}) {
      TestMesh mesh = grid(4, 4, 3);
      mesh.schema.order = Order::stream;
      mesh.schema.corner_order = false;
      mesh.schema.blocks.push_back({20, "", CellShape::hexahedron, 20});
      std::mt19937 random(every);
      for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
        auto& corners = mesh.cells[c].corners;
        for (unsigned n = random() % 4; n > 0; --n) {  // rotates the numbering
          std::rotate(corners.begin(), corners.begin() + 1, corners.begin() + 4);
          std::rotate(corners.begin() + 4, corners.begin() + 5, corners.end());
        }
        if (c % every != 0) continue;
        mesh.cells[c].block = 1;
        for (std::uint64_t i = 0; i < 12; ++i) corners.push_back((7 * c + i) % mesh.vertices);
      }
      WriteOptions options;
      options.connectivity = codec;
      SCOPED_TRACE(static_cast<int>(codec));
      expect_round_trip(mesh, options);
    }
}

// Mid nodes need no bytes if their positions and numbers can be computed from the corners. All
// encoded bytes belong to the corners.
TEST(MidNodes, CostNothingOnAGrid) {
  for (std::uint32_t nodes : {20u, 27u})
    for (ConnectivityCodec codec : kCodecs) {
      WriteOptions options;
      options.connectivity = codec;
      SizeReport report;
      expect_round_trip(second_order_grid(12, 12, 12, nodes), options, &report);
      EXPECT_LT(report.streams["connectivity"], 300u) << nodes;  // bytes for 1728 cells
      EXPECT_LT(report.streams["vertex numbers"], 200u) << nodes;
    }
}

TEST(GridNodes, ComeBack) {
  for (const Order order : {Order::keep, Order::stream})
    for (ConnectivityCodec codec : kCodecs) {
      WriteOptions options;
      options.connectivity = codec;
      TestMesh mesh = grids_of_nodes();
      mesh.schema.order = order;
      if (order == Order::stream) mesh.schema.delay = 4;
      expect_round_trip(mesh, options);
    }
}

// Nodes are finalized wherever they are in their cell, so few vertices stay active.
TEST(GridNodes, AreFinalized) {
  const TestMesh mesh = turned_grids(3, 3, 20, 5);  // a layer has 16 * 16 * 5 nodes
  for (ConnectivityCodec codec : kCodecs)
    for (const Order order : {Order::keep, Order::stream}) {
      TestMesh ordered = mesh;
      ordered.schema.order = order;
      if (order == Order::stream) ordered.schema.delay = 3;
      WriteOptions options;
      options.connectivity = codec;
      const auto bytes = expect_round_trip(ordered, options);
      const auto back = read_mesh(bytes);
      ASSERT_TRUE(back);
      EXPECT_GT(back->mesh.other_last_uses.size(), mesh.vertices / 2);
      EXPECT_LT(back->totals.max_active_vertices, 16u * 16 * 6 * 2);
    }
}

TEST(GridNodes, AreFoundByTheirEdgesAndFaces) {
  for (ConnectivityCodec codec : kCodecs) {
    WriteOptions options;
    options.connectivity = codec;
    SizeReport report;
    expect_round_trip(turned_grids(6, 6, 4, 4), options, &report);
    // Bytes for 144 cells with 117 nodes each that are not corners. The cells are turned.
    EXPECT_LT(report.streams["connectivity"], 1000u);
  }
}

// A node is predicted from the nodes before it along the rows, so smooth coordinates cost a
// fraction of their 24 bytes.
TEST(GridNodes, ArePredictedAlongTheRows) {
  TestMesh mesh = turned_grids(4, 4, 4, 5);
  SizeReport report;
  expect_round_trip(mesh, {}, &report);
  EXPECT_LT(report.streams["geometry"], 3 * mesh.vertices);
}

// Any node may be the same vertex as any earlier node of its cell, in cells with and without
// corners.
TEST(Nodes, MayRepeatAnyEarlierNodeOfTheCell) {
  for (const Order order : {Order::keep, Order::stream})
    for (const CellShape shape : {CellShape::other, CellShape::hexahedron})
      for (const ConnectivityCodec codec : kCodecs) {
        constexpr std::uint32_t kNodes = 12;
        TestMesh mesh;
        mesh.schema.order = order;
        mesh.schema.blocks = {{10, "", shape, kNodes}};
        std::vector<std::array<double, 3>> points;
        for (std::size_t i = 1; i < kNodes; ++i)
          for (std::size_t earlier = 0; earlier < i; ++earlier) {
            auto& corners = mesh.cells.emplace_back().corners;
            for (std::size_t n = 0; n < kNodes; ++n) {
              corners.push_back(n == i ? corners[earlier] : points.size());
              if (n != i) points.push_back({static_cast<double>(points.size()), 0, 0});
            }
          }
        mesh.set_points(points);
        WriteOptions options;
        options.connectivity = codec;
        SCOPED_TRACE(static_cast<int>(codec));
        expect_round_trip(mesh, options);
      }
}

TEST(MidNodeNumbers, RulesThatFitAreFound) {
  // The vertex numbers on the second edge of the quad are 100 more than those on the first edge.
  CellTopology cell;
  const auto layout = node_layout({0, {}, CellShape::quad, 8});
  cell.layout = layout.get();
  std::vector<std::uint64_t> numbers(8);
  for (std::uint32_t i = 0; i < 8; ++i) cell.slots.push_back(i);
  MidNodeNumbers rules;
  for (std::uint64_t c = 0; c < 20; ++c) {
    numbers = {c, 40 + 7 * c, 900, 9 * c * c, 1000 + 13 * c * c, 0, 0, 0};
    const auto guess = rules.expect(cell, *cell.layout->at(6), 6, 0x1f, false, numbers, 0);
    if (c > 8) {
      EXPECT_EQ(guess.best, 1100 + 13 * c * c) << c;
    }
    rules.learn(1100 + 13 * c * c);
  }
}

}  // namespace
}  // namespace shm
