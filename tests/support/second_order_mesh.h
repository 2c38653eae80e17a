// Meshes of second-order cells of all shapes that share mid nodes. The nodes are on a lattice with
// exact coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "mesh/node_layout.h"
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
  std::uint32_t add_block(CellShape shape, std::uint32_t nodes) {
    const auto block = static_cast<std::uint32_t>(mesh_.schema.blocks.size());
    mesh_.schema.blocks.push_back({block + 1, "", shape, nodes});
    return block;
  }
  /// Adds a cell. All coordinates of `corners` must be multiples of 8.
  void add(std::uint32_t block, const std::vector<Point>& corners) {
    const BlockInfo& info = mesh_.schema.blocks[block];
    const NodeLayout* layout = node_layout(info.shape, info.nodes_per_cell);
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
