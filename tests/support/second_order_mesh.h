// Meshes of cells of second and higher order that share mid nodes. The nodes are on a lattice with
// exact coordinates.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "mesh/node_layout.h"
#include "shm/cell_nodes.h"
#include "support/test_mesh.h"

namespace shm {

/// Builds a mesh of second-order cells from the positions of their corners. Nodes are numbered in
/// the order of their first use.
class SecondOrderMesh {
 public:
  using Point = std::array<std::int64_t, 3>;

  SecondOrderMesh() {
    mesh_.schema.coordinate_type = ScalarType::float64;
    mesh_.schema.corner_order = true;
  }

  /// Adds a block of cells with `nodes` nodes each. Returns the index of the block.
  std::uint32_t add_block(CellShape shape, std::uint32_t nodes,
                          NodeScheme scheme = NodeScheme::lagrange) {
    const auto block = static_cast<std::uint32_t>(mesh_.schema.blocks.size());
    mesh_.schema.blocks.push_back({block + 1, "", shape, nodes, scheme});
    return block;
  }
  /// Adds a straight cell of the order of its block, 1 to 10. `from`: its corner 0.
  void add_places(std::uint32_t block, const Point& from) {
    const BlockInfo& info = mesh_.schema.blocks[block];
    TestCell cell;
    cell.block = block;
    for (const NodePlace& place : node_places(info.shape, info.scheme, cell_order(info)))
      cell.corners.push_back(
          number({4 * (from[0] + place[0]), 4 * (from[1] + place[1]), 4 * (from[2] + place[2])}));
    mesh_.cells.push_back(std::move(cell));
  }
  /// Adds a cell. All coordinates of `corners` must be multiples of 8. `like`: the number of nodes
  /// of a cell whose layout is known, and which has its nodes in common with the first ones of this
  /// cell; 0: all of them.
  void add(std::uint32_t block, const std::vector<Point>& corners, std::uint32_t like = 0) {
    const BlockInfo& info = mesh_.schema.blocks[block];
    const auto layout =
        node_layout({0, {}, info.shape, like == 0 ? info.nodes_per_cell : like, info.scheme});
    std::vector<Point> at = corners;
    for (std::size_t p = corners.size(); p < info.nodes_per_cell; ++p) {
      const MidNode* node = layout == nullptr ? nullptr : layout->at(p);
      if (node == nullptr)
        at.push_back({static_cast<std::int64_t>(p), 1, unshared_++});
      else if (node->kind == MidNode::body)
        at.push_back(mean(corners));
      else if (node->kind == MidNode::edge)
        at.push_back(mean({corners[node->corner[0]], corners[node->corner[1]]}));
      else
        at.push_back(mean({corners[node->corner[0]], corners[node->corner[1]],
                           corners[node->corner[2]], corners[node->corner[3]]}));
    }
    TestCell cell;
    cell.block = block;
    for (const Point& p : at) cell.corners.push_back(number(p));
    mesh_.cells.push_back(std::move(cell));
  }
  /// Adds a cell with (order + 1)^3 nodes. Its corner with the lowest coordinates is at `from`, its
  /// edges have `order` steps. `turned`: 0 to 7, how the axes of the cell are turned. `collapses`:
  /// true if all nodes of the side at the high end of the third axis are the same vertex.
  void add_grid(std::uint32_t block, const Point& from, std::uint32_t turned = 0,
                bool collapses = false) {
    const BlockInfo& info = mesh_.schema.blocks[block];
    const auto layout = node_layout(info);
    const NodeGrid& grid = layout->grid;
    TestCell cell;
    cell.block = block;
    for (NodeGrid::Place place : grid.places) {
      if (collapses && place[2] == grid.order) place = grid.places[4];
      Point steps = {place[0], place[1], place[2]};
      std::rotate(steps.begin(), steps.begin() + turned % 3, steps.end());
      for (std::size_t a = 0; a < 2; ++a)  // two reversed axes are a rotation
        if (turned >= 4) steps[a] = grid.order - steps[a];
      for (std::size_t a = 0; a < 3; ++a) steps[a] = 4 * (from[a] + steps[a]);
      cell.corners.push_back(number(steps));
    }
    mesh_.cells.push_back(std::move(cell));
  }
  /// Returns the nodes of the cell that was added last.
  std::vector<std::uint64_t>& nodes() { return mesh_.cells.back().corners; }
  TestMesh finish() {
    std::vector<std::array<double, 3>> points;
    for (const Point& p : points_) {
      const double x = static_cast<double>(p[0]) / 64, y = static_cast<double>(p[1]) / 64,
                   z = static_cast<double>(p[2]) / 64;
      points.push_back({x + .5 * y * z, y + .25 * x * x, z - .125 * x * y});
    }
    mesh_.set_points(points);
    return std::move(mesh_);
  }

 private:
  static Point mean(const std::vector<Point>& points) {
    Point sum{};
    for (const Point& p : points)
      for (std::size_t a = 0; a < 3; ++a) sum[a] += p[a];
    for (std::int64_t& it : sum) it /= static_cast<std::int64_t>(points.size());
    return sum;
  }
  std::uint64_t number(const Point& p) {
    const auto [it, is_new] = numbers_.try_emplace(p, points_.size());
    if (is_new) points_.push_back(p);
    return it->second;
  }

  TestMesh mesh_;
  std::vector<Point> points_;
  std::map<Point, std::uint64_t> numbers_;
  std::int64_t unshared_ = 1000;
};

/// Returns the corners of the cube at (x, y, z) of a lattice, in VTK's order.
inline std::vector<SecondOrderMesh::Point> cube_at(std::int64_t x, std::int64_t y, std::int64_t z) {
  std::vector<SecondOrderMesh::Point> corners;
  for (std::int64_t k = 0; k < 2; ++k)
    for (const auto& [i, j] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)})
      corners.push_back({8 * (x + i), 8 * (y + j), 8 * (z + k)});
  return corners;
}

/// Returns cells of all shapes, schemes and some orders above 2. Some of them share nodes.
inline TestMesh high_order_cells() {
  using enum CellShape;
  SecondOrderMesh mesh;
  std::int64_t row = 0;
  for (const CellShape shape : {hexahedron, wedge, pyramid, tetrahedron, quad, triangle, line})
    for (const NodeScheme scheme :
         {NodeScheme::lagrange, NodeScheme::serendipity, NodeScheme::bezier}) {
      if (shape == line && scheme == NodeScheme::serendipity) continue;
      for (const std::uint32_t order : {2u, 3u, 5u}) {
        if (order == 2 && scheme != NodeScheme::bezier) continue;
        const auto nodes = static_cast<std::uint32_t>(node_places(shape, scheme, order).size());
        const std::uint32_t block = mesh.add_block(shape, nodes, scheme);
        for (const std::int64_t x : {0u, order}) mesh.add_places(block, {x, 6 * row, 0});
        ++row;
      }
    }
  return mesh.finish();
}

/// Returns a grid of hexahedra with the given number of nodes per cell.
inline TestMesh second_order_grid(std::int64_t nx, std::int64_t ny, std::int64_t nz,
                                  std::uint32_t nodes) {
  SecondOrderMesh mesh;
  const std::uint32_t block = mesh.add_block(CellShape::hexahedron, nodes);
  for (std::int64_t z = 0; z < nz; ++z)
    for (std::int64_t y = 0; y < ny; ++y)
      for (std::int64_t x = 0; x < nx; ++x) mesh.add(block, cube_at(x, y, z));
  return mesh.finish();
}

/// Returns a grid of hexahedra of the given order. Neighbouring cells are turned differently.
inline TestMesh turned_grids(std::int64_t nx, std::int64_t ny, std::int64_t nz,
                             std::uint32_t order) {
  SecondOrderMesh mesh;
  const std::uint32_t block =
      mesh.add_block(CellShape::hexahedron, (order + 1) * (order + 1) * (order + 1));
  const auto p = static_cast<std::int64_t>(order);
  std::uint32_t turned = 0;
  for (std::int64_t z = 0; z < nz; ++z)
    for (std::int64_t y = 0; y < ny; ++y)
      for (std::int64_t x = 0; x < nx; ++x)
        mesh.add_grid(block, {p * x, p * y, p * z}, turned++ % 8);
  return mesh.finish();
}

/// Returns hexahedra of orders 3 and 4, some of them collapsed, next to hexahedra of other orders.
/// Some nodes are not where the neighbours expect them, and some occur several times in a cell.
inline TestMesh grids_of_nodes() {
  SecondOrderMesh mesh;
  const std::uint32_t cubic = mesh.add_block(CellShape::hexahedron, 64),
                      quartic = mesh.add_block(CellShape::hexahedron, 125),
                      quadratic = mesh.add_block(CellShape::hexahedron, 27);
  for (std::uint32_t i = 0; i < 6; ++i) mesh.add_grid(cubic, {3 * (i % 3), 3 * (i / 3), 0}, i);
  mesh.add(quadratic, cube_at(3, 0, 0));
  mesh.add_grid(cubic, {0, 0, 3}, 0, true);
  mesh.add_grid(quartic, {0, 6, 0}, 7);
  mesh.add_grid(quartic, {4, 6, 0}, 1);
  mesh.add_grid(quartic, {4, 6, 4}, 0, true);
  mesh.add_grid(quartic, {4, 10, 0}, 5);
  std::swap(mesh.nodes()[20], mesh.nodes()[60]);
  mesh.add_grid(cubic, {6, 3, 3}, 2);
  std::swap(mesh.nodes()[9], mesh.nodes()[40]);
  mesh.nodes()[50] = mesh.nodes()[12];
  mesh.nodes()[63] = mesh.nodes()[49];
  mesh.add_grid(quartic, {8, 6, 0}, 4);
  mesh.nodes()[124] = mesh.nodes()[8];
  mesh.nodes()[100] = mesh.nodes()[99];
  return mesh.finish();
}

/// Returns cells with all node layouts. The cells touch each other or overlap. Some are collapsed,
/// and some have a number of nodes for which no layout is defined.
inline TestMesh second_order_cells() {
  SecondOrderMesh mesh;
  std::map<std::pair<CellShape, std::uint32_t>, std::uint32_t> blocks;
  using enum CellShape;
  for (const auto& [shape, nodes] : std::vector<std::pair<CellShape, std::uint32_t>>{
           {hexahedron, 8},  {hexahedron, 9},   {hexahedron, 16}, {hexahedron, 20},
           {hexahedron, 21}, {hexahedron, 22},  {hexahedron, 24}, {hexahedron, 26},
           {hexahedron, 27}, {wedge, 15},       {wedge, 18},      {pyramid, 13},
           {pyramid, 14},    {tetrahedron, 10}, {quad, 8},        {quad, 9},
           {triangle, 6},    {triangle, 7},     {line, 3},        {tetrahedron, 15},
           {hexahedron, 70}})
    blocks[{shape, nodes}] = mesh.add_block(shape, nodes);
  const auto add = [&](CellShape shape, std::uint32_t nodes,
                       const std::vector<SecondOrderMesh::Point>& corners) {
    mesh.add(blocks.at({shape, nodes}), corners);
  };
  constexpr std::array<std::uint32_t, 11> kNodes = {27, 20, 27, 21, 24, 26, 9, 22, 16, 8, 70};
  std::size_t next = 0;
  for (std::int64_t z = 0; z < 2; ++z)
    for (std::int64_t y = 0; y < 3; ++y)
      for (std::int64_t x = 0; x < 4; ++x) {
        auto c = cube_at(x, y, z);
        const SecondOrderMesh::Point top = {8 * x + 4, 8 * y + 4, 8 * z + 4};
        switch ((x + 2 * y + 3 * z) % 6) {
          case 0:
            add(wedge, 18, {c[0], c[1], c[3], c[4], c[5], c[7]});
            add(wedge, 15, {c[1], c[2], c[3], c[5], c[6], c[7]});
            break;
          case 1:
            add(pyramid, 13, {c[0], c[1], c[2], c[3], top});
            add(pyramid, 14, {c[4], c[7], c[6], c[5], top});
            add(tetrahedron, 10, {c[0], c[4], c[5], top});
            add(tetrahedron, 10, {c[0], c[5], c[1], top});
            add(tetrahedron, 15, {c[1], c[5], c[6], top});
            break;
          case 2:
            c[3] = c[2], c[7] = c[6];  // a wedge of eight corners
            add(hexahedron, x % 2 == 0 ? 20 : 27, c);
            add(quad, 8, {c[0], c[1], c[2], c[3]});
            break;
          default:
            add(hexahedron, kNodes[next++ % kNodes.size()], c);
            add(quad, x % 2 == 0 ? 8 : 9, {c[0], c[1], c[2], c[3]});
        }
        add(line, 3, {c[0], c[4]});
        add(triangle, x % 2 == 0 ? 6 : 7, {c[0], c[1], c[5]});
      }
  return mesh.finish();
}

}  // namespace shm
