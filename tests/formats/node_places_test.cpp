// Tests of the places of nodes (shm/cell_nodes.h), and of what follows from them: the layouts of
// grids, the facets of cells, and the orders of nodes in other formats. high_order_test.py compares
// them with VTK and Gmsh.
#include "shm/cell_nodes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "boundary/cell_sides.h"
#include "mesh/node_layout.h"
#include "mesh/node_orders.h"
#include "sets/cell_sides.h"

namespace shm::converters {
namespace {

using enum CellShape;
constexpr CellShape kShapes[] = {line, triangle, quad, tetrahedron, pyramid, wedge, hexahedron};

BlockInfo block_of(CellShape shape, NodeScheme scheme, std::uint32_t order) {
  const auto nodes = static_cast<std::uint32_t>(node_places(shape, scheme, order).size());
  return {1, {}, shape, nodes, scheme};
}

TEST(NodePlaces, AreDistinctAndDetermineTheOrder) {
  for (const CellShape shape : kShapes)
    for (const NodeScheme scheme :
         {NodeScheme::lagrange, NodeScheme::serendipity, NodeScheme::bezier})
      for (std::uint32_t order = 1; order <= kMostCellOrder; ++order) {
        const NodePlaces places = node_places(shape, scheme, order);
        EXPECT_EQ(std::set<NodePlace>(places.begin(), places.end()).size(), places.size());
        for (const NodePlace& place : places)
          for (const std::uint8_t steps : place) EXPECT_LE(steps, order);
        const bool is_serendipity = scheme == NodeScheme::serendipity;
        if (is_serendipity && shape == line) continue;
        const std::uint32_t least = is_serendipity ? 3
                                    : scheme == NodeScheme::bezier
                                        ? 2
                                        : 1;  // that differ from lagrange
        EXPECT_EQ(cell_order(block_of(shape, scheme, order)), order < least ? 0 : order)
            << shape_name(shape) << ' ' << scheme_name(scheme) << ' ' << order;
      }
  EXPECT_TRUE(node_places(hexahedron, NodeScheme::lagrange, 0).empty());
  EXPECT_TRUE(node_places(hexahedron, NodeScheme::lagrange, 11).empty());
  EXPECT_TRUE(node_places(polygon, NodeScheme::lagrange, 2).empty());
}

TEST(NodePlaces, OfSecondOrderCellsWithoutAllNodes) {
  for (const auto& [shape, nodes] :
       {std::pair(triangle, 7u), {quad, 8u}, {pyramid, 13u}, {wedge, 15u}, {hexahedron, 20u}}) {
    EXPECT_EQ(cell_order({1, {}, shape, nodes, NodeScheme::lagrange}), 2u);
    EXPECT_EQ(cell_order({1, {}, shape, nodes, NodeScheme::serendipity}), 0u);
    EXPECT_EQ(cell_order({1, {}, shape, nodes, NodeScheme::bezier}), 0u);
  }
  EXPECT_EQ(cell_order({1, {}, hexahedron, 0, NodeScheme::lagrange}), 0u);
  EXPECT_EQ(cell_order({1, {}, hexahedron, 22, NodeScheme::lagrange}), 0u);
}

TEST(NodePlaces, OfSecondOrderCellsAreThoseOfTheirLayouts) {
  for (const CellShape shape : {line, triangle, quad, tetrahedron, pyramid, wedge, hexahedron}) {
    const NodePlaces places = node_places(shape, NodeScheme::lagrange, 2);
    const auto layout = node_layout({0, {}, shape, static_cast<std::uint32_t>(places.size())});
    ASSERT_NE(layout, nullptr) << shape_name(shape);
    for (std::size_t p = layout->corners; p < layout->nodes; ++p) {
      const MidNode& node = *layout->at(p);
      const std::size_t around = node.kind == MidNode::edge   ? 2
                                 : node.kind == MidNode::face ? 4
                                                              : 0;
      for (std::size_t a = 0; a < 3 && around > 0; ++a) {
        int sum = 0;
        for (std::size_t i = 0; i < around; ++i) sum += places[node.corner[i]][a];
        EXPECT_EQ(sum, places[p][a] * static_cast<int>(around)) << shape_name(shape) << ' ' << p;
      }
    }
  }
}

// The sum of p^2 facets of each side, as vectors, is the side's own area vector: the facets cover
// the side, and have its direction.
TEST(NodePlaces, OfFacetsCoverTheSides) {
  using Vector = std::array<int, 3>;
  const auto twice_area = [](const NodePlaces& at, auto&& nodes, std::size_t size) {
    Vector sum{};
    for (std::size_t i = 0; i < size; ++i) {
      const NodePlace &a = at[nodes[i]], &b = at[nodes[(i + 1) % size]];
      for (std::size_t k = 0; k < 3; ++k)
        sum[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
    return sum;
  };
  for (const CellShape shape : {triangle, quad, tetrahedron, pyramid, wedge, hexahedron})
    for (std::uint32_t order = 3; order <= kMostCellOrder; ++order) {
      const BlockInfo block = block_of(shape, NodeScheme::lagrange, order);
      const NodePlaces at = node_places(shape, NodeScheme::lagrange, order);
      std::map<std::uint8_t, Vector> areas;
      std::map<std::uint8_t, std::uint32_t> counts;
      for (const Facet& facet : facets_of(block)) {
        const Vector area = twice_area(at, facet.at, facet.size);
        for (std::size_t k = 0; k < 3; ++k) areas[facet.side][k] += area[k];
        ++counts[facet.side];
        for (std::size_t i = 0; i < facet.size; ++i)
          for (std::size_t k = 0; k < 3; ++k)
            EXPECT_LE(std::abs(at[facet.at[i]][k] - at[facet.at[(i + 1) % facet.size]][k]), 1);
      }
      const CellForm form = form_of(shape, block.nodes_per_cell);
      const std::size_t sides = form.kind == CellForm::itself ? 1 : form.sides.size();
      EXPECT_EQ(counts.size(), sides);
      for (const auto& [side, count] : counts) EXPECT_EQ(count, order * order);
      for (std::size_t k = 0; k < form.sides.size(); ++k)
        EXPECT_EQ(areas.at(static_cast<std::uint8_t>(k + 1)),
                  twice_area(at, form.sides[k].at, form.sides[k].size));
    }
  EXPECT_TRUE(facets_of(block_of(hexahedron, NodeScheme::serendipity, 3)).empty());
  EXPECT_TRUE(facets_of(block_of(hexahedron, NodeScheme::bezier, 2)).empty());
}

// The nodes of a side are the nodes of the cell in the plane of the side.
TEST(NodePlaces, OfSidesAreThoseOfTheirCells) {
  SideFinder finder;
  for (const CellShape shape : {triangle, quad, tetrahedron, pyramid, wedge, hexahedron})
    for (const NodeScheme scheme : {NodeScheme::lagrange, NodeScheme::serendipity})
      for (std::uint32_t order = 3; order <= kMostCellOrder; ++order) {
        const BlockInfo block = block_of(shape, scheme, order);
        const NodePlaces at = node_places(shape, scheme, order);
        std::vector<std::uint64_t> cell(at.size());
        for (std::size_t i = 0; i < cell.size(); ++i) cell[i] = i;
        const bool is_flat = shape == triangle || shape == quad;
        std::uint64_t sides = 0;
        for (std::uint64_t k = 1; finder.nodes_of_side(block, k, is_flat) > 0; ++k, ++sides) {
          const CellSide side = finder.side_of_cell(block, cell, k, is_flat);
          EXPECT_EQ(side.nodes.size(), finder.nodes_of_side(block, k, is_flat));
          EXPECT_EQ(cell_order({1, {}, side.kind.shape, side.kind.nodes, side.kind.scheme}), order);
          const NodePlaces on_side = node_places(side.kind.shape, side.kind.scheme, order);
          ASSERT_EQ(on_side.size(), side.nodes.size());
          const std::size_t last = side.kind.shape == line ? 1 : side.kind.shape == quad ? 3 : 2;
          const auto of = [&](std::size_t i, std::size_t a) { return int{at[side.nodes[i]][a]}; };
          for (std::size_t i = 0; i < on_side.size(); ++i)
            for (std::size_t a = 0; a < 3; ++a)
              EXPECT_EQ(
                  static_cast<int>(order) * (of(i, a) - of(0, a)),
                  (of(1, a) - of(0, a)) * on_side[i][0] + (of(last, a) - of(0, a)) * on_side[i][1]);
        }
        EXPECT_EQ(sides, is_flat ? (shape == quad ? 4u : 3u)
                                 : form_of(shape, block.nodes_per_cell).sides.size());
      }
}

// Gmsh lists the same nodes as the mesh model, corners first.
TEST(NodePlaces, OfGmshAreThoseOfTheModel) {
  for (const CellShape shape : kShapes)
    for (const NodeScheme scheme : {NodeScheme::lagrange, NodeScheme::serendipity})
      for (std::uint32_t order = 1; order <= kMostCellOrder; ++order) {
        const NodePlaces model = node_places(shape, scheme, order);
        const NodePlaces gmsh = gmsh_places(shape, scheme, order);
        EXPECT_EQ(std::set<NodePlace>(gmsh.begin(), gmsh.end()),
                  std::set<NodePlace>(model.begin(), model.end()))
            << shape_name(shape) << ' ' << scheme_name(scheme) << ' ' << order;
        EXPECT_EQ(gmsh.size(), model.size());
      }
}

}  // namespace
}  // namespace shm::converters
