// Tests of coding the corners of cells of all shapes: the open faces between cells, round trips,
// and encoded sizes.
#include <numeric>

#include "mesh/open_faces.h"
#include "support/coded_meshes.h"
#include "support/sanitized.h"

namespace shm {
namespace {

constexpr std::array<ShapeFace, 4> kTetrahedronSides = {
    {{3, {0, 1, 3}}, {3, {1, 2, 3}}, {3, {2, 0, 3}}, {3, {0, 2, 1}}}};
constexpr std::array<ShapeFace, 4> kTriangle = {
    {{3, {0, 1, 2}}, {2, {0, 1}}, {2, {1, 2}}, {2, {2, 0}}}};

void add(OpenFaces& faces, const std::array<std::uint32_t, 4>& corners) {
  faces.add_cell({kTetrahedronSides}, corners);
}

TEST(OpenFaces, ASecondCellClosesAFace) {
  OpenFaces faces;
  add(faces, {0, 1, 2, 3});
  EXPECT_EQ(faces.vertex(0).faces, 3);
  add(faces, {1, 2, 3, 4});
  EXPECT_EQ(faces.behind()[3], 0u);  // the neighbour across face 0 2 1 of the new cell is cell 0
  EXPECT_EQ(faces.behind()[0], OpenFaces::kNever);
  EXPECT_EQ(faces.find(std::array<std::uint32_t, 3>{3, 1, 2}), kNone);
  EXPECT_NE(faces.find(std::array<std::uint32_t, 3>{1, 0, 2}), kNone);
  EXPECT_EQ(faces.vertex(1).faces, 4);
}

TEST(OpenFaces, AFlatCellCoversAndItsEdgesAreOpen) {
  OpenFaces faces;
  add(faces, {0, 1, 2, 3});
  faces.add_cell({kTriangle, true}, std::array<std::uint32_t, 3>{0, 1, 2});
  EXPECT_EQ(faces.vertex(0).faces, 3);
  EXPECT_EQ(faces.vertex(0).bare, 2);
  EXPECT_EQ(faces.vertex(0).edges, 2);
  EXPECT_EQ(faces.behind()[0], 0u);
}

TEST(OpenFaces, AFlatCellIsClosedByWhatSitsOnIt) {
  OpenFaces faces;
  faces.add_cell({kTriangle, true}, std::array<std::uint32_t, 3>{2, 1, 0});
  add(faces, {0, 1, 2, 3});
  EXPECT_EQ(faces.behind()[3], 0u);
  EXPECT_EQ(faces.find(std::array<std::uint32_t, 3>{0, 1, 2}), kNone);
}

TEST(OpenFaces, ForgottenVerticesTakeTheirFacesAlong) {
  OpenFaces faces;
  add(faces, {0, 1, 2, 3});
  faces.forget(3);
  EXPECT_EQ(faces.vertex(0).faces, 1);
  faces.forget(0);
  EXPECT_EQ(faces.vertex(1).faces, 0);
  EXPECT_NE(faces.cell(0), nullptr) << "the slot of the cell rests first";
  for (std::uint32_t c = 0; c < 300; ++c) {
    add(faces, {0, 1, 2, 3});
    for (std::uint32_t v = 0; v < 4; ++v) faces.forget(v);
  }
  EXPECT_EQ(faces.cell(0), nullptr);
  EXPECT_NE(faces.cell(299), nullptr);
}

TEST(OpenFaces, DegenerateCellsAndCrowdedVertices) {
  OpenFaces faces;
  add(faces, {5, 5, 5, 5});
  EXPECT_EQ(faces.vertex(5).faces, 0);
  add(faces,
      {0, 1, 2, 2});  // this cell has the face 0 1 2 twice: it opens the face and closes it again
  EXPECT_EQ(faces.vertex(0).faces, 0);
  for (std::uint32_t i = 0; i < 100; ++i) add(faces, {9, 10 + 3 * i, 11 + 3 * i, 12 + 3 * i});
  EXPECT_EQ(faces.vertex(9).faces, 128);
}

/// Shuffles the cells. (`shuffled` also rotates hexahedra.)
TestMesh in_any_order(TestMesh mesh) {
  PlainRandom(3).shuffle(mesh.cells);
  return mesh;
}

void expect_all_modes(TestMesh mesh) {
  for (const std::uint32_t delay : {0u, 3u, 60u})
    for (const auto codec : codecs_for(with_order(mesh, Order::keep, true, delay).schema))
      for (const std::uint64_t segment_cells : {0, 17}) {
        SCOPED_TRACE("delay " + std::to_string(delay) + ", codec " +
                     std::to_string(static_cast<int>(codec)));
        WriteOptions options;
        options.connectivity = codec;
        options.segment_cells = segment_cells;
        options.group_cells = 23;
        mesh = with_order(std::move(mesh), Order::keep, true, delay);
        expect_round_trip(mesh, options);
        mesh = with_order(std::move(mesh), Order::stream, true, delay);
        expect_round_trip(mesh, options);
        mesh = with_order(std::move(mesh), Order::stream, false, delay);
        expect_round_trip(mesh, options);
      }
}

TEST(CellCorners, EveryShapeComesBack) { expect_all_modes(every_shape()); }

TEST(CellCorners, EveryShapeComesBackFromAnyPlace) {
  expect_all_modes(in_any_order(every_shape()));
}

TEST(CellCorners, EveryShapeComesBackBackwards) {
  TestMesh mesh = every_shape();
  std::reverse(mesh.cells.begin(), mesh.cells.end());
  expect_all_modes(mesh);
}

TEST(CellCorners, ValuesOfEveryShapeComeBack) {
  SomeCases some(5);
  for (const bool in_order : {true, false})
    for (const Level level : {Level::fast, Level::standard, Level::best})
      for (const std::uint64_t segment_cells : {0, 17})
        for (const std::uint32_t delay : {0u, 20u}) {
          if (some.skips_next()) continue;
          const TestMesh mesh =
              with_arrays_of_every_type(in_order ? every_shape() : in_any_order(every_shape()));
          SCOPED_TRACE("level " + std::to_string(static_cast<int>(level)) + ", delay " +
                       std::to_string(delay));
          WriteOptions options;
          options.level = level;
          options.segment_cells = segment_cells;
          options.group_cells = 40;
          expect_round_trip(with_order(mesh, Order::keep, true, delay), options);
          expect_round_trip(with_order(mesh, Order::stream, true, delay), options);
          expect_round_trip(with_order(mesh, Order::stream, false, delay), options);
          expect_round_trip(with_order(mesh, Order::free, false, 0), options);
        }
}

using Parts = std::vector<std::vector<std::size_t>>;
const Parts kWhole = {{0, 1, 2, 3, 4, 5, 6, 7}};
const Parts kWedges = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}};
const Parts kTetrahedra = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                           {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};

/// Divides each hexahedron of the mesh into cells. For each cell, `parts` states which corners of
/// the hexahedron are its corners.
TestMesh cut(TestMesh mesh, CellShape shape, const Parts& parts) {
  mesh.schema.blocks[0].shape = shape;
  mesh.schema.blocks[0].nodes_per_cell = static_cast<std::uint32_t>(parts[0].size());
  std::vector<TestCell> cells;
  for (const TestCell& whole : mesh.cells)
    for (const auto& part : parts) {
      cells.emplace_back();
      for (std::size_t i : part) cells.back().corners.push_back(whole.corners[i]);
    }
  mesh.cells = std::move(cells);
  return mesh;
}
TestMesh cut_grid(CellShape shape, const Parts& parts) {
  return cut(grid(12, 11, 10), shape, parts);
}
TestMesh bent_cut_grid(CellShape shape, const Parts& parts) {
  return cut(grid(12, 11, 10, ScalarType::float64, warped), shape, parts);
}

std::uint64_t bytes_of(const TestMesh& mesh, const char* stream) {
  MemorySink sink;
  WriteOptions options;
  options.connectivity = ConnectivityCodec::rows;
  const auto report = write_mesh(mesh, sink, options);
  EXPECT_TRUE(static_cast<bool>(report));
  return report ? report->streams.at(stream) : 0;
}
std::uint64_t connectivity_bytes(const TestMesh& mesh) { return bytes_of(mesh, "connectivity"); }

// Checks the encoded size of float64 coordinates on grids in which lattice prediction is exact for
// nearly all coordinates. The size must be less than 1.7 (wedges) or 5 (tetrahedra) times the size
// on the same grid of hexahedra. Without lattice prediction, a vertex needs 90 bits or more.
TEST(CellCorners, CoordinatesOfCutGridsCostLittleMore) {
  const double whole =
      8.0 * static_cast<double>(bytes_of(bent_cut_grid(CellShape::hexahedron, kWhole), "geometry"));
  const auto share = [&](CellShape shape, const Parts& parts) {
    return 8.0 * static_cast<double>(bytes_of(bent_cut_grid(shape, parts), "geometry")) / whole;
  };
  EXPECT_LT(share(CellShape::wedge, kWedges), 1.7);
  EXPECT_LT(share(CellShape::tetrahedron, kTetrahedra), 5.0);
}

TEST(CellCorners, RegularMeshesCostNextToNothing) {
  EXPECT_LT(connectivity_bytes(cut_grid(CellShape::tetrahedron, kTetrahedra)), 400u);
  EXPECT_LT(connectivity_bytes(cut_grid(CellShape::wedge, kWedges)), 250u);
}

/// Returns a grid in which every second column of hexahedra is divided into wedges. In the list of
/// cells, all wedges precede all hexahedra.
TestMesh columns_of_wedges() {
  TestMesh mesh = grid(12, 11, 10);
  mesh.schema.blocks.push_back({2, "", CellShape::wedge, 6});
  std::vector<TestCell> wedges, hexahedra;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    if ((c % 12 + c / 12 % 11) % 2 == 1) {
      hexahedra.push_back(mesh.cells[c]);
      continue;
    }
    for (const auto& part : kWedges) {
      wedges.push_back({1, {}});
      for (std::size_t i : part) wedges.back().corners.push_back(mesh.cells[c].corners[i]);
    }
  }
  mesh.cells = std::move(wedges);
  mesh.cells.insert(mesh.cells.end(), hexahedra.begin(), hexahedra.end());
  return mesh;
}

// Every hexahedron touches wedges on four sides. If hexahedra were coded by vertex numbers, they
// would need 1701 bytes in scanline order and 3436 bytes in random order.
TEST(CellCorners, HexahedraAreFoundByTheFacesOfOtherCells) {
  TestMesh mesh = columns_of_wedges();
  EXPECT_LT(connectivity_bytes(mesh), 800u);
  const auto wedges = static_cast<std::ptrdiff_t>(std::count_if(
      mesh.cells.begin(), mesh.cells.end(), [](const TestCell& cell) { return cell.block == 1; }));
  std::vector<TestCell> hexahedra(mesh.cells.begin() + wedges, mesh.cells.end());
  PlainRandom(3).shuffle(hexahedra);
  std::copy(hexahedra.begin(), hexahedra.end(), mesh.cells.begin() + wedges);
  EXPECT_LT(connectivity_bytes(mesh), 2600u);
  expect_round_trip(with_order(mesh, Order::stream, false, 0));
  for (const Level level : {Level::standard, Level::best}) {
    WriteOptions options;
    options.level = level;
    options.segment_cells = 300;
    expect_round_trip(mesh, options);
  }
}

TEST(CellCorners, TetrahedraInAnyOrderAreFoundByTheirFaces) {
  const TestMesh mesh = in_any_order(cut_grid(CellShape::tetrahedron, kTetrahedra));
  EXPECT_LT(connectivity_bytes(mesh) * 8, mesh.cells.size() * 24);
}

}  // namespace
}  // namespace shm
