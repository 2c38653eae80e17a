// Tests of coding polyhedra: the open faces between them, round trips, and encoded sizes.
#include <numeric>

#include "mesh/polyhedron_surface.h"
#include "support/coded_meshes.h"
#include "support/sanitized.h"

namespace shm {
namespace {

using Cycle = std::vector<std::uint32_t>;

TEST(PolyhedronSurface, FindsFacesInEitherDirectionFromAnyVertex) {
  PolyhedronSurface surface;
  surface.add_face(Cycle{0, 1, 2, 3, 4}, 7);
  const std::uint32_t face = surface.find(Cycle{2, 3, 4, 0, 1});
  ASSERT_NE(face, kNone);
  EXPECT_EQ(surface.cell_of(face), 7u);
  EXPECT_EQ(surface.find(Cycle{1, 0, 4, 3, 2}), face);
  EXPECT_EQ(surface.find(Cycle{0, 2, 1, 3, 4}), kNone);
  EXPECT_EQ(surface.find(Cycle{0, 1, 2, 3}), kNone);
  surface.remove_face(face);
  EXPECT_EQ(surface.find(Cycle{0, 1, 2, 3, 4}), kNone);
  EXPECT_TRUE(surface.faces_at(0).empty());
}

TEST(PolyhedronSurface, CountsPolyhedraAtEdges) {
  PolyhedronSurface surface;
  surface.add_edge(4, 9);
  surface.add_edge(9, 4);
  EXPECT_EQ(surface.cells_at(4, 9), 2u);
  EXPECT_EQ(surface.cells_at(9, 4), 2u);
  EXPECT_EQ(surface.cells_at(4, 5), 0u);
  EXPECT_EQ(surface.cells_at(77, 4), 0u);
}

TEST(PolyhedronSurface, ForgottenVerticesTakeFacesAndEdgesAlong) {
  PolyhedronSurface surface;
  surface.add_face(Cycle{0, 1, 2}, 7);
  surface.add_face(Cycle{3, 4, 5}, 7);
  surface.add_edge(0, 1);
  surface.forget(0);
  EXPECT_TRUE(surface.faces_at(1).empty());
  EXPECT_TRUE(surface.edges_at(1).empty());
  EXPECT_NE(surface.find(Cycle{5, 4, 3}), kNone);
  surface.forget(1000);
}

TEST(PolyhedronSurface, CrowdedVerticesGetNoMore) {
  PolyhedronSurface surface;
  for (std::uint32_t i = 0; i < 100; ++i) {
    surface.add_face(Cycle{0, 1 + 2 * i, 2 + 2 * i}, 7);
    surface.add_edge(0, 1 + 2 * i);
  }
  EXPECT_EQ(surface.faces_at(0).size(), PolyhedronSurface::kMostFaces);
  EXPECT_EQ(surface.edges_at(0).size(), PolyhedronSurface::kMostEdges);
  EXPECT_TRUE(surface.edges_at(199).empty());
  EXPECT_TRUE(surface.faces_at(199).empty());
}

void expect_all_modes(TestMesh mesh) {
  for (const std::uint32_t delay : {0u, 7u})
    for (const auto codec : codecs_for(with_order(mesh, Order::keep, true, delay).schema))
      for (const std::uint64_t segment_cells : {0, 11}) {
        SCOPED_TRACE("delay " + std::to_string(delay) + ", codec " +
                     std::to_string(static_cast<int>(codec)));
        WriteOptions options;
        options.connectivity = codec;
        options.segment_cells = segment_cells;
        options.group_cells = 13;
        expect_round_trip(with_order(mesh, Order::keep, true, delay), options);
        expect_round_trip(with_order(mesh, Order::stream, true, delay), options);
        expect_round_trip(with_order(mesh, Order::stream, false, delay), options);
      }
}

TEST(Polyhedra, ComeBack) { expect_all_modes(polyhedra()); }

TEST(Polyhedra, ComeBackFromAnyPlace) {
  TestMesh mesh = polyhedra();
  PlainRandom(3).shuffle(mesh.cells);
  expect_all_modes(mesh);
}

TEST(Polyhedra, ComeBackWithValues) {
  for (const Level level : {Level::fast, Level::standard, Level::best}) {
    WriteOptions options;
    options.level = level;
    options.segment_cells = 17;
    expect_round_trip(with_arrays_of_every_type(polyhedra()), options);
    expect_round_trip(with_order(with_arrays_of_every_type(polyhedra()), Order::free, false, 0),
                      options);
  }
}

/// The faces of this mesh have random vertices, so they share few edges. One vertex belongs to a
/// thousand faces.
TEST(Polyhedra, ComeBackWhereNothingFits) {
  TestMesh mesh = polyhedra();
  PlainRandom random(5);
  std::vector<TestCell> cells;
  for (std::uint64_t c = 0; c < 60; ++c) {
    std::vector<std::vector<std::uint64_t>> faces;
    for (std::uint64_t f = 0; f < 1 + random.below(c == 7 ? 1000 : 20); ++f) {
      std::vector<std::uint64_t> all(mesh.vertices);
      std::iota(all.begin(), all.end(), std::uint64_t{0});
      random.shuffle(all);
      all.resize(3 + random.below(c == 9 ? 60 : 4));
      if (c == 7 && std::find(all.begin(), all.end(), 8u) == all.end()) all[0] = 8;
      faces.push_back(all);
    }
    cells.push_back({1, closed_faces(faces)});
  }
  mesh.cells = cells;
  expect_all_modes(mesh);
}

/// Each cell is a hexahedron stored as a polyhedron. Its list of faces has 30 entries: the number
/// of nodes and the four nodes of each face. Nevertheless, a cell needs only 12 bits.
TEST(Polyhedra, OfAGridTakeFewBytes) {
  TestMesh mesh = grid(12, 12, 12, ScalarType::float32, straight);
  mesh.schema.blocks[0].shape = CellShape::faces;
  mesh.schema.blocks[0].nodes_per_cell = 0;
  for (TestCell& cell : mesh.cells) {
    std::vector<std::vector<std::uint64_t>> faces;
    for (const auto& at : kSixFaces) {
      std::vector<std::uint64_t>& face = faces.emplace_back();
      for (const std::uint8_t i : at) face.push_back(cell.corners[i]);
    }
    cell.corners = closed_faces(faces);
  }
  MemorySink sink;
  WriteOptions options;
  options.connectivity = ConnectivityCodec::rows;
  const auto report = write_mesh(mesh, sink, options);
  ASSERT_TRUE(report);
  EXPECT_LT(sink.bytes.size() * 8, mesh.cells.size() * 12);
}

}  // namespace
}  // namespace shm
