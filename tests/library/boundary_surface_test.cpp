// Tests of the boundary surface. For each cell shape, and for meshes of all kinds, the faces found
// are compared with the expected faces: the cell sides that occur only once in the mesh, and the
// cells that are faces themselves. The tests also check the array values on the surface. The memory
// that the search needs must depend only on the size of the active surface.
#include "shm/boundary_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "boundary/boundary_search.h"
#include "support/coded_meshes.h"
#include "support/file_surgery.h"
#include "support/second_order_mesh.h"

namespace shm {
namespace {

using Cycle = std::vector<std::uint64_t>;

std::vector<std::byte> file_of(const TestMesh& mesh, const WriteOptions& options = {}) {
  MemorySink sink;
  const auto report = write_mesh(mesh, sink, options);
  EXPECT_TRUE(report) << (report ? "" : report.error().message());
  return std::move(sink.bytes);
}

Result<BoundarySurface> boundary_anywhere(std::span<const std::byte> bytes,
                                          const BoundaryOptions& options = {},
                                          unsigned threads = 1) {
  MemoryRandomSource source(bytes);
  ReadOptions reading;
  reading.threads = threads;
  return read_boundary(source, options, {}, reading);
}
Result<BoundarySurface> boundary_of_stream(std::span<const std::byte> bytes,
                                           const BoundaryOptions& options = {}) {
  MemorySource source(bytes);
  return read_boundary(source, options);
}

/// Finds the boundary surface in three ways (with random access, front to back, and with two
/// threads) and checks that the results are equal.
BoundarySurface boundary_of(std::span<const std::byte> bytes, const BoundaryOptions& options = {}) {
  const auto surface = boundary_anywhere(bytes, options);
  const auto streamed = boundary_of_stream(bytes, options);
  const auto threaded = boundary_anywhere(bytes, options, 2);
  EXPECT_TRUE(surface) << (surface ? "" : surface.error().message());
  EXPECT_TRUE(streamed) << (streamed ? "" : streamed.error().message());
  if (!surface || !streamed || !threaded) return {};
  EXPECT_EQ(surface->arrays, streamed->arrays);
  EXPECT_TRUE(*surface == *streamed);
  EXPECT_TRUE(*surface == *threaded);
  return *surface;
}

Cycle face_of(const BoundarySurface& surface, std::size_t face) {
  Cycle cycle;
  for (std::uint64_t i = surface.face_begin[face]; i < surface.face_begin[face + 1]; ++i)
    cycle.push_back(surface.vertex_numbers[surface.corners[i]]);
  return cycle;
}

/// Returns the canonical form of a cycle of vertices. It is the same for all rotations of the cycle
/// and for both directions.
Cycle least(Cycle cycle) {
  Cycle best = cycle;
  for (int way = 0; way < 2; ++way) {
    for (std::size_t i = 0; i < cycle.size(); ++i) {
      std::rotate(cycle.begin(), cycle.begin() + 1, cycle.end());
      best = std::min(best, cycle);
    }
    std::reverse(cycle.begin(), cycle.end());
  }
  return best;
}

// --- expected faces, computed by counting how often each cell side occurs

/// Returns the sides of a cell according to VTK's tables.
std::vector<Cycle> sides_of_cell(const BlockInfo& block, const Cycle& v) {
  static const std::map<CellShape, std::pair<std::size_t, std::vector<Cycle>>> tables = {
      {CellShape::tetrahedron, {4, {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 2, 1}}}},
      {CellShape::pyramid, {5, {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}}},
      {CellShape::wedge, {6, {{0, 1, 2}, {3, 5, 4}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}}}},
      {CellShape::hexahedron,
       {8, {{0, 3, 2, 1}, {0, 4, 7, 3}, {0, 1, 5, 4}, {1, 2, 6, 5}, {3, 7, 6, 2}, {4, 5, 6, 7}}}}};
  std::vector<Cycle> sides;
  if (block.shape == CellShape::faces) {
    for (std::size_t first = 0; first < v.size();) {
      const auto end =
          std::find(v.begin() + static_cast<std::ptrdiff_t>(first) + 1, v.end(), v[first]);
      if (end == v.end()) return {};
      sides.emplace_back(v.begin() + static_cast<std::ptrdiff_t>(first), end);
      first = static_cast<std::size_t>(end - v.begin()) + 1;
    }
  }
  const auto table = tables.find(block.shape);
  if (table != tables.end() && v.size() >= table->second.first)
    for (const Cycle& places : table->second.second) {
      Cycle& side = sides.emplace_back();
      for (const std::uint64_t at : places) side.push_back(v[at]);
    }
  std::map<Cycle, int> times;
  for (Cycle& side : sides) {
    side.erase(std::unique(side.begin(), side.end()), side.end());
    while (side.size() > 1 && side.front() == side.back()) side.pop_back();
    if (side.size() >= 3) ++times[least(side)];
  }
  std::vector<Cycle> once;
  for (const auto& [side, count] : times)
    if (count % 2 == 1) once.push_back(side);
  return once;
}

/// Returns the number of corners of a cell that is itself a face; 0 for other cells.
std::size_t corners_itself(const BlockInfo& block, std::size_t nodes) {
  std::size_t corners = 0;
  if (block.shape == CellShape::vertex) corners = 1;
  if (block.shape == CellShape::line) corners = 2;
  if (block.shape == CellShape::triangle) corners = 3;
  if (block.shape == CellShape::quad) corners = 4;
  if (block.shape == CellShape::polygon) corners = std::max<std::size_t>(nodes, 3);
  return corners <= nodes ? corners : 0;
}

/// Set of pairs: a cell number, and the vertex numbers of one face of the cell. The numbers are
/// those of the source mesh.
using Faces = std::multiset<std::pair<std::uint64_t, Cycle>>;

Faces counted_faces(const TestMesh& mesh) {
  std::map<Cycle, std::vector<std::uint64_t>> cells;
  Faces faces;
  for (std::uint64_t c = 0; c < mesh.cells.size(); ++c) {
    const BlockInfo& block = mesh.schema.blocks[mesh.cells[c].block];
    const Cycle& v = mesh.cells[c].corners;
    for (const Cycle& side : sides_of_cell(block, v)) cells[side].push_back(c);
    const auto itself = static_cast<std::ptrdiff_t>(corners_itself(block, v.size()));
    if (itself > 0) faces.emplace(c, least(Cycle(v.begin(), v.begin() + itself)));
  }
  for (const auto& [side, owners] : cells)
    if (owners.size() == 1) faces.emplace(owners.front(), side);
  return faces;
}

/// Returns the faces of the surface, with the cell and vertex numbers of the source. `order`
/// contains the source number of each vertex and cell, in coding order. If `order` is null, the
/// file uses the numbers of the source.
Faces found_faces(const BoundarySurface& surface, const RecordedOrder* order = nullptr) {
  Faces faces;
  for (std::size_t f = 0; f < surface.face_count(); ++f) {
    Cycle cycle = face_of(surface, f);
    std::uint64_t cell = surface.cell_numbers[f];
    if (order != nullptr) {
      for (std::uint64_t& v : cycle) v = order->vertices[v];
      cell = order->cells[cell];
    }
    faces.emplace(cell, least(cycle));
  }
  return faces;
}

/// Checks properties that every surface has.
void expect_sound(const BoundarySurface& surface) {
  ASSERT_EQ(surface.face_begin.size(), surface.face_count() + 1);
  EXPECT_EQ(surface.face_begin.front(), 0u);
  EXPECT_EQ(surface.face_begin.back(), surface.corners.size());
  EXPECT_EQ(surface.blocks.size(), surface.face_count());
  EXPECT_EQ(surface.sides.size(), surface.face_count());
  EXPECT_EQ(surface.xyz.size(), surface.vertex_count() * 3 * scalar_bytes(surface.coordinate_type));
  std::set<std::uint32_t> used(surface.corners.begin(), surface.corners.end());
  EXPECT_EQ(used.size(), surface.vertex_count()) << "no face uses some vertex";
  EXPECT_TRUE(used.empty() || *used.rbegin() + 1 == surface.vertex_count());
  std::set<std::uint64_t> numbers(surface.vertex_numbers.begin(), surface.vertex_numbers.end());
  EXPECT_EQ(numbers.size(), surface.vertex_count()) << "a vertex occurs twice";
}

/// Writes `mesh`, reads it back, and compares its boundary with the result of counted_faces().
BoundarySurface expect_counted(const TestMesh& mesh, WriteOptions options = {}) {
  RecordedOrder order;
  options.coding_order = &order;
  const BoundarySurface surface = boundary_of(file_of(mesh, options));
  expect_sound(surface);
  const bool keep = mesh.schema.order == Order::keep;
  EXPECT_EQ(found_faces(surface, keep ? nullptr : &order), counted_faces(mesh));
  for (std::size_t i = 0; i < surface.vertex_count(); ++i) {
    const std::uint64_t number = surface.vertex_numbers[i];
    const std::size_t bytes = 3 * scalar_bytes(mesh.schema.coordinate_type);
    const std::uint64_t source = keep ? number : order.vertices[number];
    EXPECT_EQ(std::memcmp(&surface.xyz[i * bytes], &mesh.xyz[source * bytes], bytes), 0);
  }
  for (std::size_t f = 0; f < surface.face_count(); ++f) {
    const std::uint64_t number = surface.cell_numbers[f];
    EXPECT_EQ(surface.blocks[f], mesh.cells[keep ? number : order.cells[number]].block);
  }
  return surface;
}

// --- shapes

TestMesh one_cell(CellShape shape, std::uint32_t nodes,
                  const std::vector<std::array<double, 3>>& points) {
  TestMesh mesh;
  mesh.schema.blocks = {{1, "", shape, nodes}};
  mesh.set_points(points);
  TestCell cell;
  for (std::uint64_t i = 0; i < points.size(); ++i) cell.corners.push_back(i);
  mesh.cells = {cell};
  return mesh;
}

const std::vector<std::array<double, 3>> kCube{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                               {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

std::vector<std::array<double, 3>> corners_of_cube(std::initializer_list<std::size_t> at) {
  std::vector<std::array<double, 3>> points;
  for (const std::size_t i : at) points.push_back(kCube[i]);
  return points;
}

/// Returns 6 times the volume that the surface encloses. It is positive if all faces are
/// counter-clockwise when seen from outside.
double volume_within(const BoundarySurface& surface) {
  const auto points = surface.points_as<double>();
  const auto at = [&](std::uint64_t corner, std::size_t c) {
    return points[std::size_t{surface.corners[corner]} * 3 + c];
  };
  double volume = 0;
  for (std::size_t f = 0; f < surface.face_count(); ++f)
    for (std::uint64_t i = surface.face_begin[f] + 1; i + 1 < surface.face_begin[f + 1]; ++i) {
      const std::uint64_t a = surface.face_begin[f];
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t d = (c + 1) % 3, e = (c + 2) % 3;
        volume += at(a, c) * (at(i, d) * at(i + 1, e) - at(i, e) * at(i + 1, d));
      }
    }
  return volume;
}

std::vector<std::uint32_t> counted_to(std::uint32_t last) {
  std::vector<std::uint32_t> list;
  for (std::uint32_t i = 1; i <= last; ++i) list.push_back(i);
  return list;
}

TEST(BoundarySurface, OfOneCellOfEachSolidShape) {
  struct Solid {
    TestMesh mesh;
    std::vector<std::size_t> sizes;  // number of corners of each side
    double volume;                   // 6 times the volume
  };
  const std::vector<Solid> solids = {
      {one_cell(CellShape::hexahedron, 8, kCube), {4, 4, 4, 4, 4, 4}, 6},
      {one_cell(CellShape::tetrahedron, 4, corners_of_cube({0, 1, 3, 4})), {3, 3, 3, 3}, 1},
      {one_cell(CellShape::pyramid, 5, corners_of_cube({0, 1, 2, 3, 4})), {3, 3, 3, 3, 4}, 2},
      {one_cell(CellShape::wedge, 6, corners_of_cube({0, 1, 3, 4, 5, 7})), {4, 4, 4, 3, 3}, 3},
      // This wedge has the node order of VTK's manual: the first triangle is counter-clockwise when
      // seen from outside.
      {one_cell(CellShape::wedge, 6, corners_of_cube({0, 3, 1, 4, 7, 5})), {4, 4, 4, 3, 3}, 3}};
  for (const Solid& solid : solids)
    for (const ScalarType type : {ScalarType::float32, ScalarType::float64}) {
      TestMesh mesh = solid.mesh;
      SCOPED_TRACE(shape_name(mesh.schema.blocks[0].shape));
      if (type == ScalarType::float32) {
        const auto points = numbers_as<double>(ScalarType::float64, mesh.xyz);
        mesh.schema.coordinate_type = type;
        mesh.xyz.clear();
        for (const double v : points) append(mesh.xyz, static_cast<float>(v));
      }
      const BoundarySurface surface = expect_counted(mesh);
      EXPECT_EQ(surface.sides, counted_to(static_cast<std::uint32_t>(solid.sizes.size())));
      ASSERT_EQ(surface.face_count(), solid.sizes.size());
      for (std::size_t f = 0; f < solid.sizes.size(); ++f)
        EXPECT_EQ(face_of(surface, f).size(), solid.sizes[f]);
      EXPECT_DOUBLE_EQ(volume_within(surface), solid.volume);
      EXPECT_EQ(surface.left_out, 0u);
    }
}

// The sides of a hexahedron have the same numbers as in Exodus.
TEST(BoundarySurface, SidesAreThoseOfSets) {
  const BoundarySurface surface = boundary_of(file_of(one_cell(CellShape::hexahedron, 8, kCube)));
  const std::vector<Cycle> sides = {{0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6},
                                    {0, 4, 7, 3}, {0, 3, 2, 1}, {4, 5, 6, 7}};
  ASSERT_EQ(surface.face_count(), sides.size());
  for (std::size_t f = 0; f < sides.size(); ++f) {
    EXPECT_EQ(least(face_of(surface, f)), least(sides[f]));
    EXPECT_EQ(surface.sides[f], f + 1);
  }
}

TEST(BoundarySurface, OfOneCellOfEachFlatShape) {
  struct Flat {
    CellShape shape;
    std::uint32_t nodes, corners;
  };
  const std::vector<Flat> flats = {
      {CellShape::vertex, 1, 1},   {CellShape::line, 2, 2},     {CellShape::line, 3, 2},
      {CellShape::triangle, 3, 3}, {CellShape::triangle, 6, 3}, {CellShape::quad, 4, 4},
      {CellShape::quad, 8, 4},     {CellShape::polygon, 5, 5},  {CellShape::polygon, 7, 7}};
  for (const Flat& flat : flats) {
    SCOPED_TRACE(std::string(shape_name(flat.shape)) + " of " + std::to_string(flat.nodes));
    const std::vector<std::array<double, 3>> points(kCube.begin(), kCube.begin() + flat.nodes);
    const BoundarySurface surface = expect_counted(one_cell(flat.shape, flat.nodes, points));
    ASSERT_EQ(surface.face_count(), 1u);
    Cycle as_stored;
    for (std::uint64_t i = 0; i < flat.corners; ++i) as_stored.push_back(i);
    EXPECT_EQ(face_of(surface, 0), as_stored);
    EXPECT_EQ(surface.sides, std::vector<std::uint32_t>{0});
  }
}

TEST(BoundarySurface, OfSecondOrderCellsHasTheirCorners) {
  std::vector<std::array<double, 3>> points = kCube;
  while (points.size() < 27) points.push_back({2, 2, static_cast<double>(points.size())});
  for (const std::uint32_t nodes : {20u, 24u, 27u}) {
    points.resize(nodes);
    const BoundarySurface surface = expect_counted(one_cell(CellShape::hexahedron, nodes, points));
    EXPECT_EQ(surface.face_count(), 6u);
    EXPECT_EQ(surface.vertex_count(), 8u);
    EXPECT_DOUBLE_EQ(volume_within(surface), 6);
  }
}

/// Returns a mesh of one cell of higher order. Its corners are corners of a cube.
/// `like`: see SecondOrderMesh::add().
TestMesh curved_cell(CellShape shape, std::uint32_t nodes, const std::vector<std::size_t>& at,
                     std::uint32_t like = 0) {
  SecondOrderMesh mesh;
  const std::uint32_t block = mesh.add_block(shape, nodes);
  const auto cube = cube_at(0, 0, 0);
  std::vector<SecondOrderMesh::Point> corners;
  for (const std::size_t i : at) corners.push_back(cube[i]);
  mesh.add(block, corners, like);
  return mesh.finish();
}

/// Checks that the surface is closed: each edge of a face belongs to one other face, in the
/// opposite direction. Also checks that the faces of each side follow each other.
void expect_closed(const BoundarySurface& surface) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t f = 0; f < surface.face_count(); ++f) {
    const Cycle face = face_of(surface, f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const auto from = static_cast<std::uint32_t>(face[i]),
                 to = static_cast<std::uint32_t>(face[(i + 1) % face.size()]);
      edges[std::minmax(from, to)] += from < to ? 1 : -1;
    }
    if (f == 0 || surface.cell_numbers[f] != surface.cell_numbers[f - 1]) continue;
    EXPECT_GE(surface.sides[f], surface.sides[f - 1]);
  }
  for (const auto& [edge, sum] : edges) EXPECT_EQ(sum, 0) << edge.first << " " << edge.second;
  EXPECT_GT(volume_within(surface), 0);
}

/// Returns a mesh of one cell.
TestMesh cell_of_places(CellShape shape, std::uint32_t order,
                        NodeScheme scheme = NodeScheme::lagrange) {
  SecondOrderMesh mesh;
  const std::size_t nodes = node_places(shape, scheme, order).size();
  mesh.add_places(mesh.add_block(shape, static_cast<std::uint32_t>(nodes), scheme), {});
  return mesh.finish();
}

TEST(BoundarySurface, DividesCurvedSides) {
  BoundaryOptions options;
  options.subdivide = true;
  struct Curved {
    TestMesh mesh;
    std::vector<std::size_t> faces;  // number of faces of each side
  };
  using enum CellShape;
  const std::vector<std::size_t> all = {0, 1, 2, 3, 4, 5, 6, 7}, six = {0, 1, 3, 4, 5, 7},
                                 four = {0, 1, 3, 4}, five = {0, 1, 2, 3, 4};
  const std::vector<Curved> solids = {
      {curved_cell(hexahedron, 9, all), {1, 1, 1, 1, 1, 1}},
      {curved_cell(hexahedron, 20, all), {5, 5, 5, 5, 5, 5}},
      {curved_cell(hexahedron, 24, all), {4, 4, 4, 4, 5, 5}},
      {curved_cell(hexahedron, 25, all), {1, 1, 1, 1, 1, 1}},
      {curved_cell(hexahedron, 27, all), {4, 4, 4, 4, 4, 4}},
      {turned_grids(1, 1, 1, 3), {9, 9, 9, 9, 9, 9}},
      {turned_grids(1, 1, 1, 4), {16, 16, 16, 16, 16, 16}},
      {curved_cell(tetrahedron, 10, four), {4, 4, 4, 4}},
      {curved_cell(pyramid, 13, five), {4, 4, 4, 4, 5}},
      {curved_cell(pyramid, 14, five), {4, 4, 4, 4, 4}},
      {curved_cell(wedge, 15, six), {5, 5, 5, 4, 4}},
      {curved_cell(tetrahedron, 14, four), {1, 1, 1, 1}},
      {curved_cell(tetrahedron, 15, four, 10), {4, 4, 4, 4}},
      {curved_cell(pyramid, 19, five, 14), {4, 4, 4, 4, 4}},
      {curved_cell(wedge, 18, six), {4, 4, 4, 4, 4}},
      {curved_cell(wedge, 21, six, 15), {5, 5, 5, 4, 4}},
      {cell_of_places(tetrahedron, 3), {9, 9, 9, 9}},
      {cell_of_places(pyramid, 4), {16, 16, 16, 16, 16}},
      {cell_of_places(wedge, 5), {25, 25, 25, 25, 25}},
      {cell_of_places(wedge, 3, NodeScheme::serendipity), {1, 1, 1, 1, 1}},
      {cell_of_places(hexahedron, 2, NodeScheme::bezier), {1, 1, 1, 1, 1, 1}}};
  for (const Curved& solid : solids) {
    const BlockInfo& block = solid.mesh.schema.blocks[0];
    SCOPED_TRACE(std::string(shape_name(block.shape)) + std::to_string(block.nodes_per_cell));
    const BoundarySurface surface = boundary_of(file_of(solid.mesh), options);
    std::vector<std::size_t> faces(solid.faces.size());
    for (const std::uint32_t side : surface.sides) ++faces.at(side - 1);
    EXPECT_EQ(faces, solid.faces);
    expect_closed(surface);
  }
  struct Flat {
    CellShape shape;
    std::uint32_t nodes;
    std::vector<std::size_t> corners;
    std::size_t faces;
  };
  for (const Flat& flat : std::vector<Flat>{{line, 3, {0, 1}, 2},
                                            {triangle, 6, {0, 1, 2}, 4},
                                            {triangle, 7, {0, 1, 2}, 4},
                                            {quad, 8, {0, 1, 2, 3}, 5},
                                            {quad, 9, {0, 1, 2, 3}, 4}}) {
    const TestMesh mesh = curved_cell(flat.shape, flat.nodes, flat.corners);
    const BoundarySurface surface = boundary_of(file_of(mesh), options);
    EXPECT_EQ(surface.face_count(), flat.faces) << flat.nodes;
    EXPECT_EQ(surface.sides, std::vector<std::uint32_t>(flat.faces, 0));
  }
}

// Each face of a divided flat cell is one step long and wide. The positions are those of VTK's
// Lagrange cells.
TEST(BoundarySurface, DividesFlatCellsOfHigherOrder) {
  BoundaryOptions options;
  options.subdivide = true;
  struct Flat {
    CellShape shape;
    std::vector<std::array<double, 2>> at;
    std::size_t faces;
    double twice_area;
  };
  using enum CellShape;
  for (const Flat& flat : std::vector<Flat>{
           {line, {{0, 0}, {3, 0}, {1, 0}, {2, 0}}, 3, 0},
           {quad,
            {{0, 0},
             {3, 0},
             {3, 3},
             {0, 3},
             {1, 0},
             {2, 0},
             {3, 1},
             {3, 2},
             {1, 3},
             {2, 3},
             {0, 1},
             {0, 2},
             {1, 1},
             {2, 1},
             {1, 2},
             {2, 2}},
            9,
            2},
           {triangle,
            {{0, 0}, {3, 0}, {0, 3}, {1, 0}, {2, 0}, {2, 1}, {1, 2}, {0, 2}, {0, 1}, {1, 1}},
            9,
            1},
           {triangle,
            {{0, 0},
             {4, 0},
             {0, 4},
             {1, 0},
             {2, 0},
             {3, 0},
             {3, 1},
             {2, 2},
             {1, 3},
             {0, 3},
             {0, 2},
             {0, 1},
             {1, 1},
             {2, 1},
             {1, 2}},
            16,
            1}}) {
    std::vector<std::array<double, 3>> points;
    for (const auto& [x, y] : flat.at) points.push_back({x, y, 0});
    const BoundarySurface surface = boundary_of(
        file_of(one_cell(flat.shape, static_cast<std::uint32_t>(points.size()), points)), options);
    ASSERT_EQ(surface.face_count(), flat.faces);
    const auto xyz = surface.points_as<double>();
    for (std::size_t f = 0; f < surface.face_count(); ++f) {
      const std::size_t begin = surface.face_begin[f], size = surface.face_begin[f + 1] - begin;
      double twice = 0;
      for (std::size_t i = 0; i < size; ++i) {
        const double* const a = &xyz[std::size_t{3} * surface.corners[begin + i]];
        const double* const b = &xyz[std::size_t{3} * surface.corners[begin + (i + 1) % size]];
        twice += a[0] * b[1] - a[1] * b[0];
        EXPECT_LE(std::max(std::abs(b[0] - a[0]), std::abs(b[1] - a[1])), 1) << points.size();
      }
      EXPECT_EQ(twice, flat.twice_area) << points.size();
    }
  }
}

TEST(BoundarySurface, NeighboursShareDividedSides) {
  BoundaryOptions options;
  options.subdivide = true;
  const BoundarySurface grids = boundary_of(file_of(turned_grids(3, 2, 2, 3)), options);
  EXPECT_EQ(grids.face_count(), 2u * (6 + 6 + 4) * 9);
  expect_closed(grids);
  const BoundarySurface quadratic = boundary_of(file_of(second_order_grid(3, 2, 2, 20)), options);
  EXPECT_EQ(quadratic.face_count(), 2u * (6 + 6 + 4) * 5);
  expect_closed(quadratic);
  // Collapsed cells, and cells that repeat nodes
  for (const TestMesh& mesh : {grids_of_nodes(), second_order_cells()})
    EXPECT_GT(boundary_of(file_of(mesh), options).face_count(), 500u);
}

TEST(BoundarySurface, OfPolyhedraHasTheirFacesInTheirOrder) {
  TestMesh mesh = one_cell(CellShape::faces, 0, kCube);
  std::vector<Cycle> faces;
  for (const auto& at : kSixFaces) faces.emplace_back(at.begin(), at.end());
  faces[0] = {0, 3, 2};  // one face split into two triangles
  faces.push_back({0, 2, 1});
  faces.push_back({7, 7, 6});  // not a face
  mesh.cells[0].corners =
      closed_faces({faces[0], faces[1], faces[2], faces[3], faces[4], faces[5], faces[6]});
  BoundarySurface surface = expect_counted(mesh);
  EXPECT_EQ(surface.sides, counted_to(7));
  EXPECT_DOUBLE_EQ(volume_within(surface), 6);
  for (std::size_t f = 0; f < 7; ++f) EXPECT_EQ(least(face_of(surface, f)), least(faces[f]));
  // A polyhedron whose node list does not describe faces has no boundary.
  mesh.cells[0].corners = {0, 1, 2, 3};
  surface = expect_counted(mesh);
  EXPECT_EQ(surface.face_count(), 0u);
  EXPECT_EQ(surface.left_out, 1u);
}

TEST(BoundarySurface, CountsWhatItLeavesOut) {
  for (const auto& [shape, nodes] :
       {std::pair(CellShape::other, 8u), std::pair(CellShape::polyhedron, 8u),
        std::pair(CellShape::hexahedron, 7u), std::pair(CellShape::polygon, 2u)}) {
    const std::vector<std::array<double, 3>> points(kCube.begin(), kCube.begin() + nodes);
    const BoundarySurface surface = boundary_of(file_of(one_cell(shape, nodes, points)));
    EXPECT_EQ(surface.left_out, 1u);
    EXPECT_EQ(surface.vertex_count(), 0u);
    EXPECT_EQ(surface.face_begin, std::vector<std::uint64_t>{0});
  }
  EXPECT_EQ(boundary_of(file_of(TestMesh())).face_begin, std::vector<std::uint64_t>{0});
}

// --- meshes

TEST(BoundarySurface, OfGrids) {
  BoundarySurface surface = expect_counted(grid(2, 1, 1));
  EXPECT_EQ(surface.face_count(), 10u);
  surface = expect_counted(grid(3, 3, 3));
  EXPECT_EQ(surface.face_count(), 54u);
  EXPECT_EQ(surface.vertex_count(), 56u);
  EXPECT_NEAR(volume_within(surface), 6, 1e-6);
  // Faces are in coding order. In this mesh, cells are coded in the order of their numbers.
  EXPECT_TRUE(std::is_sorted(surface.cell_numbers.begin(), surface.cell_numbers.end()));
  for (std::size_t f = 1; f < surface.face_count(); ++f)
    EXPECT_TRUE(surface.cell_numbers[f] != surface.cell_numbers[f - 1] ||
                surface.sides[f - 1] < surface.sides[f]);
}

// If the Writer reorders vertices and cells, the surface lists its vertices and faces in coding
// order.
TEST(BoundarySurface, VerticesComeInCodingOrder) {
  TestMesh mesh = shuffled(bent_grid(5, 4, 4));
  std::mt19937_64 random(5);
  shuffle_vertices(mesh, random);
  RecordedOrder order;
  WriteOptions options;
  options.coding_order = &order;
  const BoundarySurface surface = boundary_of(file_of(mesh, options));
  std::vector<std::uint64_t> expected;
  const std::set<std::uint64_t> found(surface.vertex_numbers.begin(), surface.vertex_numbers.end());
  for (const std::uint64_t v : order.vertices)
    if (found.contains(v)) expected.push_back(v);
  EXPECT_EQ(surface.vertex_numbers, expected);
}

TEST(BoundarySurface, OfMeshesOfAllKinds) {
  TestMesh renumbered = shuffled(bent_grid(4, 4, 4));
  std::mt19937_64 random(7);
  shuffle_vertices(renumbered, random);
  rotate_corners(renumbered, random, true);
  const std::vector<std::pair<const char*, TestMesh>> meshes = {
      {"bent", bent_grid(5, 4, 4)},
      {"holes", grid(6, 5, 5, ScalarType::float64, bent, porous)},
      {"ring", exact_ring(7, 2, 3)},
      {"mixed", mixed_cells()},
      {"every shape", every_shape()},
      {"polyhedra", polyhedra()},
      {"degenerate", degenerate_hexahedra()},
      {"replayed", replayed(Order::keep)},
      {"renumbered", renumbered}};
  for (const auto& [name, mesh] : meshes)
    for (const auto& [order, corner_order, delay] :
         {std::tuple(Order::keep, true, 0u), std::tuple(Order::keep, true, 6u),
          std::tuple(Order::stream, true, 0u), std::tuple(Order::stream, false, 4u)})
      for (const std::uint64_t segment : {0u, 7u}) {
        SCOPED_TRACE(std::string(name) + ", " + std::string(order_name(order)) + ", delay " +
                     std::to_string(delay) + ", segments of " + std::to_string(segment));
        WriteOptions options;
        options.segment_cells = segment;
        options.group_cells = 5;
        expect_counted(with_order(mesh, order, corner_order, delay), options);
        for (const auto codec : codecs_without_delay()) {
          if (!can_be_in(with_order(mesh, order, corner_order, delay).schema, codec)) continue;
          options.connectivity = codec;
          expect_counted(with_order(mesh, order, corner_order, delay), options);
        }
      }
}

TEST(BoundarySurface, WhatThreeCellsHaveIsInside) {
  TestMesh mesh = grid(1, 1, 1, ScalarType::float64);
  mesh.set_points({{0, 0, 0},
                   {1, 0, 0},
                   {0, 1, 0},
                   {1, 1, 0},
                   {0, 0, 1},
                   {1, 0, 1},
                   {0, 1, 1},
                   {1, 1, 1},
                   {0, 0, 2},
                   {1, 0, 2},
                   {0, 1, 2},
                   {1, 1, 2},
                   {0, 0, 3},
                   {1, 0, 3},
                   {0, 1, 3},
                   {1, 1, 3}});
  mesh.cells.push_back({0, {4, 5, 7, 6, 8, 9, 11, 10}});
  mesh.cells.push_back({0, {4, 5, 7, 6, 12, 13, 15, 14}});
  EXPECT_EQ(expect_counted(mesh).face_count(), 15u);
  mesh.cells.push_back(mesh.cells[0]);  // if a cell occurs twice, all of its sides are shared
  EXPECT_EQ(expect_counted(mesh).face_count(), 10u);
}

TEST(BoundarySurface, OfDegenerateCells) {
  TestMesh mesh = grid(1, 1, 2, ScalarType::float64);
  // The second cell has no volume and covers a side of the first cell. The boundary contains that
  // side as if the flat cell did not exist.
  mesh.cells[1].corners = {4, 5, 7, 6, 4, 5, 7, 6};
  BoundarySurface surface = expect_counted(mesh);
  EXPECT_EQ(surface.face_count(), 6u);
  EXPECT_EQ(std::count(surface.cell_numbers.begin(), surface.cell_numbers.end(), 0u), 6);
  // A hexahedron that is collapsed to a wedge shares a side with a real wedge.
  mesh = grid(1, 1, 2, ScalarType::float64);
  mesh.schema.blocks.push_back({2, "", CellShape::wedge, 6});
  mesh.cells = {{0, {0, 1, 3, 3, 4, 5, 7, 7}}, {1, {4, 5, 7, 8, 9, 11}}};
  surface = expect_counted(mesh);
  EXPECT_EQ(surface.face_count(), 8u);
  EXPECT_DOUBLE_EQ(volume_within(surface), 3);
  // If a quad covers a side of a hexahedron, both the quad and the side are faces of the boundary.
  mesh = grid(1, 1, 1, ScalarType::float64);
  mesh.schema.blocks.push_back({2, "", CellShape::quad, 4});
  mesh.cells.push_back({1, {4, 5, 7, 6}});
  EXPECT_EQ(expect_counted(mesh).face_count(), 7u);
  // A face may contain a vertex twice. Two such faces with the same vertices are equal only if they
  // list the vertices in the same or in the opposite cyclic order.
  mesh.schema.blocks[1] = {2, "", CellShape::faces, 0};
  mesh.cells = {{1, closed_faces({{0, 1, 2, 3}, {3, 4, 5}})},
                {1, {0, 1, 2, 3, 1, 4, 5, 0}},
                {1, {3, 2, 1, 0, 5, 4, 1, 3}},
                {1, {5, 4, 1, 3, 2, 1, 0, 5}}};
  mesh.cells[1].corners = {2, 1, 3, 1, 4, 2};
  mesh.cells[2].corners = {4, 1, 3, 1, 2, 4};
  expect_counted(mesh);
}

/// Returns a long strip of tetrahedra around vertex 0. If `with_polyhedra` is true, every second
/// cell is a polyhedron with one additional face.
TestMesh hub(std::uint64_t cells, bool with_polyhedra) {
  TestMesh mesh;
  mesh.schema.blocks = {{1, "", CellShape::tetrahedron, 4}, {2, "", CellShape::faces, 0}};
  std::vector<std::array<double, 3>> points{{0, 0, 0}};
  for (std::uint64_t i = 0; i < cells + 3; ++i)
    points.push_back({static_cast<double>(i), static_cast<double>(i % 3), 1});
  mesh.set_points(points);
  for (std::uint64_t i = 0; i < cells; ++i) {
    const std::uint64_t a = i + 1, b = i + 2, c = i + 3;
    if (with_polyhedra && i % 2 == 1)  // this polyhedron also has a side with five corners
      mesh.cells.push_back(
          {1, closed_faces({{0, a, b}, {0, b, c}, {0, c, a}, {a, b, c}, {0, a, b, c, c + 1}})});
    else
      mesh.cells.push_back({0, {0, a, b, c}});
  }
  return mesh;
}

// All cells share vertex 0. The search therefore keeps the open sides at that vertex (those found
// only once so far) until the end of the mesh. Looking up a side must not become slower as the
// number of open sides grows.
TEST(BoundarySurface, OfManyCellsAroundAVertex) {
  expect_counted(hub(300, false));
  expect_counted(hub(300, true));
  const BoundarySurface surface = boundary_of(file_of(hub(20000, false)));
  EXPECT_EQ(surface.face_count(), 2u * 20000 + 2);
}

// --- memory

/// Passes the mesh to the search block by block. Returns two maxima over all blocks: the number of
/// open sides (those found only once so far), and the number of vertices that the search keeps in
/// memory.
std::pair<std::size_t, std::size_t> most_kept(const TestMesh& mesh) {
  WriteOptions options;
  options.group_cells = 64;
  const auto bytes = file_of(mesh, options);
  MemorySource source(bytes);
  auto reader = Reader::open(source);
  EXPECT_TRUE(reader);
  BoundarySearch search(reader->schema(), {});
  std::pair<std::size_t, std::size_t> most;
  while (Item* const item = *reader->next()) {
    auto* const block = std::get_if<MeshBlock>(item);
    if (block == nullptr) continue;
    EXPECT_TRUE(search.add(*block));
    most.first = std::max(most.first, search.open_sides());
    most.second = std::max(most.second, search.kept_vertices());
  }
  EXPECT_TRUE(search.end_mesh());
  EXPECT_EQ(search.open_sides(), 0u);
  EXPECT_EQ(search.found().faces(), counted_faces(mesh).size());
  return most;
}

TEST(BoundarySurface, KeepsWhatTheActiveSurfaceNeeds) {
  const auto [sides, vertices] = most_kept(grid(2, 2, 1500));
  EXPECT_LE(sides, 60u);  // about 12 open sides for each layer of four cells
  EXPECT_LE(vertices, 30u);
  const auto [mixed, mixed_vertices] = most_kept(every_shape());
  EXPECT_GT(mixed, 0u);
  EXPECT_GT(mixed_vertices, 0u);
}

TEST(BoundarySurface, TakesNoMoreThanItMay) {
  const auto bytes = file_of(grid(12, 12, 12));
  BoundaryOptions options;
  options.max_bytes = 10000;
  for (const auto& surface :
       {boundary_anywhere(bytes, options), boundary_of_stream(bytes, options)}) {
    ASSERT_FALSE(surface);
    EXPECT_EQ(surface.error().code, ErrorCode::over_limit) << surface.error().message();
  }
  options.max_bytes = 1 << 20;
  EXPECT_TRUE(boundary_anywhere(bytes, options));
}

// --- values

/// Returns the values of an array that are expected at the vertices or faces of the surface.
std::vector<std::byte> expected_values(const TestMesh& mesh, const BoundarySurface& surface,
                                       std::uint32_t array, const std::vector<std::byte>& all,
                                       const RecordedOrder& order) {
  const ArrayInfo& info = mesh.schema.arrays[array];
  const std::size_t stride = mesh.stride(array);
  const bool keep = mesh.schema.order == Order::keep;
  std::vector<std::byte> values;
  const auto add = [&](std::uint64_t element) {
    values.insert(values.end(), all.begin() + static_cast<std::ptrdiff_t>(element * stride),
                  all.begin() + static_cast<std::ptrdiff_t>((element + 1) * stride));
  };
  if (info.location == Location::point) {
    for (const std::uint64_t number : surface.vertex_numbers)
      add(keep ? number : order.vertices[number]);
    return values;
  }
  std::vector<std::uint64_t> element(mesh.cells.size());
  std::uint64_t next = 0;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    element[c] = next;
    next += mesh.schema.array_covers(array, mesh.cells[c].block) ? 1 : 0;
  }
  for (std::size_t f = 0; f < surface.face_count(); ++f) {
    if (mesh.schema.array_covers(array, surface.blocks[f])) {
      const std::uint64_t number = surface.cell_numbers[f];
      add(element[keep ? number : order.cells[number]]);
      continue;
    }
    for (std::uint32_t c = 0; c < info.components; ++c)
      if (info.type == ScalarType::float64)
        append(values, std::numeric_limits<double>::quiet_NaN());
      else if (info.type == ScalarType::float32)
        append(values, std::numeric_limits<float>::quiet_NaN());
      else
        values.resize(values.size() + scalar_bytes(info.type));
  }
  return values;
}

TestMesh with_static_arrays(TestMesh mesh, const std::vector<std::uint32_t>& some = {0, 3}) {
  const auto covered = static_cast<std::uint64_t>(
      std::count_if(mesh.cells.begin(), mesh.cells.end(), [&](const TestCell& cell) {
        return std::find(some.begin(), some.end(), cell.block) != some.end();
      }));
  add_array(mesh, array_of("t", Location::point, ScalarType::float32, 3), mesh.vertices);
  add_array(mesh, array_of("i", Location::point, ScalarType::int16), mesh.vertices);
  add_array(mesh, array_of("c", Location::cell, ScalarType::float64), mesh.cells.size());
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64, ScalarType::uint8})
    add_array(mesh, array_of("some", Location::cell, type, 2, some), covered);
  return mesh;
}

TEST(BoundarySurface, CarriesStaticArrays) {
  for (const Order kind : {Order::keep, Order::stream}) {
    const TestMesh mesh = with_order(with_static_arrays(every_shape()), kind, true, 0);
    RecordedOrder order;
    WriteOptions write;
    write.coding_order = &order;
    write.segment_cells = 20;
    const auto bytes = file_of(mesh, write);
    BoundaryOptions options;
    options.arrays = {{5, 0}, {0, 0}, {2, 7}, {3, 0}, {4, 0}, {1, 0}, {0, 0}};
    const BoundarySurface surface = boundary_of(bytes, options);
    ASSERT_EQ(surface.arrays.size(), options.arrays.size());
    for (std::size_t i = 0; i < options.arrays.size(); ++i) {
      const std::uint32_t array = options.arrays[i].array;
      EXPECT_EQ(surface.arrays[i], expected_values(mesh, surface, array, mesh.arrays[array], order))
          << i;
    }
  }
}

TEST(BoundarySurface, CarriesSteppedArrays) {
  for (const Order kind : {Order::keep, Order::stream}) {
    Stepped stepped = with_steps(every_shape(), kind);
    // The array covers only blocks 1 and 3, whose cells are mixed with cells of other blocks.
    stepped.mesh.schema.arrays[3].blocks = {1, 3};
    for (const std::uint64_t step : {0u, 1u, 2u, 4u, 5u, 9u})
      stepped.values[{3, step}] =
          moving_values(stepped.mesh.schema.arrays[3], elements_of(stepped.mesh, 3), step);
    RecordedOrder order;
    stepped.options.coding_order = &order;
    stepped.options.segment_cells = 25;
    stepped.options.group_cells = 6;
    const auto bytes = written(stepped);
    BoundaryOptions options;
    options.arrays = {{0, 5}, {3, 9}, {2, 1}, {1, 0}, {4, 4}, {3, 0}, {0, 4}};
    // Step values are written in coding order. `order` contains the source number of each element,
    // in coding order.
    const BoundarySurface surface = boundary_of(bytes, options);
    ASSERT_EQ(surface.arrays.size(), options.arrays.size());
    for (std::size_t i = 0; i < options.arrays.size(); ++i) {
      const auto& [array, step] = options.arrays[i];
      const std::size_t stride = stepped.mesh.stride(array);
      const Bytes& coded = stepped.values.at({array, step});
      Bytes all(coded.size());
      const bool of_points = stepped.mesh.schema.arrays[array].location == Location::point;
      std::vector<std::uint64_t> element(stepped.mesh.cells.size());
      std::uint64_t next = 0;
      for (std::size_t c = 0; c < element.size(); ++c) {
        element[c] = next;
        next += stepped.mesh.schema.array_covers(array, stepped.mesh.cells[c].block) ? 1 : 0;
      }
      std::uint64_t at = 0;
      for (const std::uint64_t source : of_points ? order.vertices : order.cells) {
        if (!of_points &&
            !stepped.mesh.schema.array_covers(array, stepped.mesh.cells[source].block))
          continue;
        std::memcpy(&all[(of_points ? source : element[source]) * stride], &coded[at++ * stride],
                    stride);
      }
      EXPECT_EQ(surface.arrays[i], expected_values(stepped.mesh, surface, array, all, order)) << i;
    }
  }
}

TEST(BoundarySurface, RefusesArraysThatAreNotThere) {
  const auto bytes = written(with_steps(every_shape(), Order::keep));
  for (const BoundaryArray& array :
       {BoundaryArray{99, 0}, BoundaryArray{0, 3}, BoundaryArray{2, 10}}) {
    BoundaryOptions options;
    options.arrays = {array};
    for (const auto& surface :
         {boundary_anywhere(bytes, options), boundary_of_stream(bytes, options)}) {
      ASSERT_FALSE(surface);
      EXPECT_EQ(surface.error().code, ErrorCode::misuse) << surface.error().message();
    }
  }
  // The array is defined on a block without cells, so no values are missing.
  TestMesh mesh = bent_grid(2, 2, 2);
  mesh.schema.blocks.push_back({2, "empty", CellShape::hexahedron, 8});
  BoundaryOptions options;
  options.arrays = {{3, 1}};
  const BoundarySurface surface = boundary_of(written(with_steps(mesh, Order::keep)), options);
  EXPECT_EQ(surface.arrays[0].size(), surface.face_count() * sizeof(double));
}

// --- blocks supplied by the caller

std::vector<MeshBlock> blocks_of(std::span<const std::byte> bytes, Schema& schema) {
  MemorySource source(bytes);
  auto reader = Reader::open(source);
  EXPECT_TRUE(reader);
  schema = reader->schema();
  std::vector<MeshBlock> blocks;
  while (Item* const item = *reader->next())
    if (auto* const block = std::get_if<MeshBlock>(item)) blocks.push_back(std::move(*block));
  return blocks;
}

TEST(BoundaryFinder, TakesPiecesOfAMesh) {
  const Stepped stepped = with_steps(with_static_arrays(bent_grid(6, 5, 4), {0}), Order::keep);
  Stepped cut = stepped;
  cut.options.segment_cells = 25;
  const auto bytes = written(cut);
  MemoryRandomSource source(bytes);
  auto mesh = MeshExtractor::open(source);
  ASSERT_TRUE(mesh);
  const auto u = static_cast<std::uint32_t>(stepped.mesh.schema.arrays.size() - 5);
  BoundaryOptions options;
  options.arrays = {{u, 2}, {u + 2, 4}, {1, 0}};
  auto finder = BoundaryFinder::create(mesh->schema(), options);
  ASSERT_TRUE(finder);
  ExtractRequest request;
  request.cells.range = {{17, 93}};
  ASSERT_TRUE(mesh->begin(request));
  while (MeshBlock* const block = *mesh->next()) ASSERT_TRUE(finder->add(*block));
  for (const auto& [array, step] : {std::pair(u, 2u), std::pair(u + 2, 4u)}) {
    ASSERT_TRUE(mesh->begin_values(array, step));
    while (StepValues* const values = *mesh->next_values())
      ASSERT_TRUE(finder->add(array, step, *values));
  }
  const auto surface = finder->finish();
  ASSERT_TRUE(surface) << surface.error().message();
  expect_sound(*surface);
  TestMesh piece = stepped.mesh;
  piece.cells = {stepped.mesh.cells.begin() + 17, stepped.mesh.cells.begin() + 93};
  Faces expected;
  for (const auto& [cell, cycle] : counted_faces(piece)) expected.emplace(cell + 17, cycle);
  EXPECT_EQ(found_faces(*surface), expected);
  // The mesh has a single block, so its cells are coded in the order of their numbers. Vertices
  // keep their numbers.
  for (std::size_t f = 0; f < surface->face_count(); ++f)
    EXPECT_EQ(std::memcmp(&surface->arrays[1][f * 4],
                          &stepped.values.at({u + 2, 4})[surface->cell_numbers[f] * 4], 4),
              0);
  BoundaryOptions whole_options = options;
  const BoundarySurface whole = boundary_of(bytes, whole_options);
  std::map<std::uint64_t, std::size_t> of_whole;
  for (std::size_t v = 0; v < whole.vertex_count(); ++v) of_whole[whole.vertex_numbers[v]] = v;
  std::size_t compared = 0;
  for (std::size_t v = 0; v < surface->vertex_count(); ++v)
    if (const auto found = of_whole.find(surface->vertex_numbers[v]); found != of_whole.end()) {
      ++compared;
      EXPECT_EQ(std::memcmp(&surface->arrays[0][v * 24], &whole.arrays[0][found->second * 24], 24),
                0);
      EXPECT_EQ(std::memcmp(&surface->arrays[2][v * 2], &whole.arrays[2][found->second * 2], 2), 0);
    }
  EXPECT_GT(compared, 50u);
}

TEST(BoundaryFinder, RefusesBlocksThatMakeNoSense) {
  Schema schema;
  const auto blocks = blocks_of(file_of(with_static_arrays(bent_grid(3, 3, 3), {0})), schema);
  ASSERT_EQ(blocks.size(), 1u);
  BoundaryOptions options;
  options.arrays = {{0, 0}, {2, 0}};
  const auto error_of = [&](const std::function<void(MeshBlock&)>& spoil) {
    MeshBlock block = blocks[0];
    spoil(block);
    auto finder = BoundaryFinder::create(schema, options);
    EXPECT_TRUE(finder);
    const auto added = finder->add(block);
    EXPECT_FALSE(added);
    return added ? ErrorCode::io : added.error().code;
  };
  const std::vector<std::function<void(MeshBlock&)>> misuses = {
      [](MeshBlock& b) { b.first_vertex = 1; },
      [](MeshBlock& b) { b.first_cell = 1; },
      [](MeshBlock& b) { b.xyz.pop_back(); },
      [](MeshBlock& b) { b.cell_numbers.pop_back(); },
      [](MeshBlock& b) { b.last_use.pop_back(); },
      [](MeshBlock& b) { b.corners.pop_back(); },
      [](MeshBlock& b) { b.corner_begin.pop_back(); },
      [](MeshBlock& b) { b.corner_begin.clear(); },
      [](MeshBlock& b) { b.corner_begin[1] = 17; },
      [](MeshBlock& b) { --b.corner_begin[1]; },  // another number of nodes than the block states
      [](MeshBlock& b) { b.cell_blocks[2] = 9; },
      [](MeshBlock& b) { b.arrays.clear(); },
      [](MeshBlock& b) { b.arrays[0].pop_back(); },
      [](MeshBlock& b) { b.arrays[2].clear(); },
      [](MeshBlock& b) { b.vertices_before_cell[0] = 999; }};
  for (std::size_t i = 0; i < misuses.size(); ++i)
    EXPECT_EQ(error_of(misuses[i]), ErrorCode::misuse) << i;
  EXPECT_EQ(error_of([](MeshBlock& b) { b.vertex_numbers[1] = b.vertex_numbers[0]; }),
            ErrorCode::corrupt);
  EXPECT_EQ(error_of([](MeshBlock& b) { b.corners[3] = 12345; }), ErrorCode::corrupt);
  EXPECT_EQ(error_of([](MeshBlock& b) { std::fill(b.last_use.begin(), b.last_use.end(), 255u); }),
            ErrorCode::corrupt);

  auto finder = BoundaryFinder::create(schema, options);
  ASSERT_TRUE(finder);
  ASSERT_TRUE(finder->add(blocks[0]));
  EXPECT_FALSE(finder->add(blocks[0]));  // not the next block
  auto other = BoundaryFinder::create(schema, options);
  ASSERT_TRUE(other->add(blocks[0]));
  ASSERT_TRUE(other->finish());
  EXPECT_FALSE(other->finish());
  EXPECT_FALSE(other->add(blocks[0]));
  StepPiece piece;
  piece.array = 77;
  EXPECT_FALSE(other->add(piece));
}

// For a file with a damaged byte, the search must return either an error or a valid surface.
TEST(BoundarySurface, OfDamagedFiles) {
  const auto bytes = written(with_steps(every_shape(), Order::keep));
  BoundaryOptions options;
  options.arrays = {{0, 5}, {3, 9}};
  std::size_t failed = 0, tried = 0;
  for (std::size_t at = 0; at < bytes.size(); at += 101) {
    auto damaged = bytes;
    damaged[at] ^= std::byte{0x10};
    for (const auto& surface :
         {boundary_anywhere(damaged, options), boundary_of_stream(damaged, options)}) {
      ++tried;
      failed += surface ? 0 : 1;
      if (surface) expect_sound(*surface);
    }
  }
  EXPECT_GT(failed, tried / 4);
  for (std::size_t size = 0; size < bytes.size(); size += 501)
    EXPECT_FALSE(boundary_anywhere(std::span(bytes).first(size), options));
}

}  // namespace
}  // namespace shm
