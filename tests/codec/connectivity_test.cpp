// Tests of connectivity: each of the ten ways in which a hexahedron can touch its neighbours, and
// encoding and decoding of connectivity without coordinates and values.
#include "codecs/surface/cells/connectivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <map>
#include <string>
#include <vector>

#include "mesh/hexahedron.h"
#include "support/test_mesh.h"

namespace shm {
namespace {

/// Encodes the cells of `mesh` in their order, decodes them, and checks that the decoded cells
/// equal the original cells. Returns the decoded cells.
std::vector<CellTopology> expect_same_cells(const TestMesh& mesh, ConnectivityCodec codec) {
  std::vector<std::uint64_t> last(mesh.vertices);
  for (std::uint64_t c = 0; c < mesh.cells.size(); ++c)
    for (std::uint64_t v : mesh.cells[c].corners) last[v] = c;

  RangeEncoder symbols, order;
  Connectivity<RangeEncoder> encoder(mesh.schema);
  encoder.set_codec(codec);
  std::map<std::uint64_t, std::uint32_t> slots;
  // For each vertex, in the order in which vertices are introduced: its number in the mesh.
  std::vector<std::uint64_t> numbers_by_id;
  std::vector<CellTopology> coded, decoded;
  for (std::uint64_t c = 0; c < mesh.cells.size(); ++c) {
    StoredCell stored;
    stored.block = mesh.cells[c].block;
    for (std::uint64_t v : mesh.cells[c].corners) {
      if (stored.slots.size() < 8) stored.original[stored.slots.size()] = v;
      stored.slots.push_back(slots.contains(v) ? slots[v] : kNone);
      stored.numbers.push_back(v);
      stored.last_use.push_back(last[v] == c ? 1 : 0);
    }
    CellTopology cell;
    EXPECT_TRUE(encoder.code_cell(symbols, order, stored, cell));
    const auto number = [&](std::uint32_t p) { return stored.numbers[cell.stored_position(p)]; };
    for (std::uint32_t p : cell.new_positions) {
      slots[number(p)] = cell.slots[p];
      numbers_by_id.push_back(number(p));
    }
    for (std::uint32_t i = 0; i < cell.slots.size(); ++i)
      if (cell.last_use[i] != 0) slots.erase(number(i));
    encoder.finish_cell(cell);
    coded.push_back(std::move(cell));
  }
  const auto symbol_bytes = symbols.finish(), order_bytes = order.finish();
  RangeDecoder symbols_in(symbol_bytes), order_in(order_bytes);
  Connectivity<RangeDecoder> decoder(mesh.schema);
  decoder.set_codec(codec);
  for (std::uint64_t c = 0; c < mesh.cells.size(); ++c) {
    CellTopology cell;
    EXPECT_TRUE(decoder.decode_cell(symbols_in, order_in, cell));
    EXPECT_EQ(cell.block, coded[c].block);
    EXPECT_EQ(cell.slots, coded[c].slots);
    EXPECT_EQ(cell.last_use, coded[c].last_use);
    EXPECT_EQ(cell.new_positions, coded[c].new_positions);
    EXPECT_EQ(cell.face_mask, coded[c].face_mask);
    if (mesh.schema.corner_order) {
      EXPECT_EQ(cell.stored_corner, coded[c].stored_corner);
    }
    for (std::uint32_t i = 0; i < cell.slots.size() && mesh.schema.corner_order; ++i) {
      const std::uint64_t id = decoder.surface().vertex(cell.slots[i]).id;
      EXPECT_EQ(numbers_by_id[id], mesh.cells[c].corners[cell.stored_position(i)]);
    }
    decoder.finish_cell(cell);
    decoded.push_back(std::move(cell));
    if (testing::Test::HasFailure()) break;
  }
  EXPECT_EQ(decoder.surface().active_vertices(), encoder.surface().active_vertices());
  return decoded;
}

/// Checks the cells with every codec. Returns the cells decoded with the codec `paper`.
std::vector<CellTopology> expect_same_cells(const TestMesh& mesh) {
  expect_same_cells(mesh, ConnectivityCodec::rows);
  expect_same_cells(mesh, ConnectivityCodec::replay);
  expect_same_cells(mesh, ConnectivityCodec::mixed);
  return expect_same_cells(mesh, ConnectivityCodec::paper);
}

enum : std::uint32_t { kBottom = 1, kWest = 2, kSouth = 4, kEast = 8, kNorth = 16, kTop = 32 };

/// Returns the centre cell of a 3x3x3 grid and some of its six neighbours. `faces` selects the
/// neighbours. The centre cell is the last cell of the mesh.
TestMesh neighbourhood(std::uint32_t faces, bool corner_order) {
  const TestMesh all = grid(3, 3, 3);
  TestMesh mesh = all;
  mesh.schema.order = Order::stream;
  mesh.schema.corner_order = corner_order;
  mesh.cells.clear();
  constexpr std::array<std::size_t, 6> kNeighbour = {4,  12, 10,
                                                     14, 16, 22};  // neighbours of cell 13
  for (std::size_t f = 0; f < 6; ++f)
    if ((faces >> f & 1) != 0) mesh.cells.push_back(all.cells[kNeighbour[f]]);
  mesh.cells.push_back(all.cells[13]);
  return mesh;
}

/// Returns the number of active faces of the centre cell, and the number of pairs of opposite faces
/// among them. The two numbers distinguish the ten cases: CORNER and BRIDGE both have three active
/// faces, but different numbers of pairs.
std::pair<int, int> shape_of(std::uint32_t mask) {
  const auto has = [&](std::uint32_t faces) { return (mask & faces) == faces ? 1 : 0; };
  return {std::popcount(mask), has(kBottom | kTop) + has(kWest | kEast) + has(kSouth | kNorth)};
}

struct Configuration {
  const char* name;
  std::uint32_t faces;
  int new_vertices;
};
constexpr std::array<Configuration, 10> kConfigurations = {{
    {"START", 0, 8},
    {"HUT", kBottom, 4},
    {"ROOF", kBottom | kTop, 0},
    {"STEP", kBottom | kWest, 2},
    {"BRIDGE", kBottom | kWest | kEast, 0},
    {"CORNER", kBottom | kWest | kSouth, 1},
    {"TUNNEL", kBottom | kWest | kEast | kTop, 0},
    {"GAP", kBottom | kWest | kSouth | kEast, 0},
    {"PIT", kBottom | kWest | kSouth | kEast | kNorth, 0},
    {"DEN", kBottom | kWest | kSouth | kEast | kNorth | kTop, 0},
}};

TEST(Connectivity, TheTenConfigurations) {
  for (const bool corner_order : {true, false})
    for (const Configuration& configuration : kConfigurations) {
      SCOPED_TRACE(configuration.name);
      const auto cells = expect_same_cells(neighbourhood(configuration.faces, corner_order));
      ASSERT_FALSE(HasFailure());
      const CellTopology& centre = cells.back();
      EXPECT_EQ(shape_of(centre.face_mask), shape_of(configuration.faces));
      EXPECT_EQ(static_cast<int>(centre.new_positions.size()), configuration.new_vertices);
    }
}

// Every set of active faces, with the centre cell in each of its 24 rotations, is one of the ten
// cases.
TEST(Connectivity, EverySetOfFacesInEveryRotation) {
  for (std::uint32_t faces = 0; faces < 64; ++faces)
    for (std::uint32_t r = 0; r < kRotationCount; ++r) {
      TestMesh mesh = neighbourhood(faces, true);
      const auto corners = mesh.cells.back().corners;
      for (std::size_t i = 0; i < 8; ++i) mesh.cells.back().corners[i] = corners[kRotations[r][i]];
      const auto cells = expect_same_cells(mesh);
      ASSERT_FALSE(HasFailure()) << "faces " << faces << ", rotation " << r;
      ASSERT_EQ(shape_of(cells.back().face_mask), shape_of(faces));
      // A face is active if and only if one of the previous cells contains all of its corners.
      for (std::uint32_t k = 0; k < 6; ++k) {
        const bool shared =
            std::any_of(mesh.cells.begin(), mesh.cells.end() - 1, [&](const auto& other) {
              return std::all_of(kFaceCorners[k].begin(), kFaceCorners[k].end(), [&](auto corner) {
                const auto number = mesh.cells.back().corners[cells.back().stored_position(corner)];
                return std::count(other.corners.begin(), other.corners.end(), number) > 0;
              });
            });
        ASSERT_EQ((cells.back().face_mask >> k & 1) != 0, shared) << "face " << k;
      }
    }
}

TEST(Connectivity, MirroredCentre) {
  for (std::uint32_t faces = 0; faces < 64; ++faces) {
    TestMesh mesh = neighbourhood(faces, true);
    auto& v = mesh.cells.back().corners;
    for (std::size_t i = 0; i < 4; ++i) std::swap(v[i], v[i + 4]);
    expect_same_cells(mesh);
    ASSERT_FALSE(HasFailure()) << faces;
  }
}

TEST(Connectivity, RepeatedCorners) {
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = 0; b < a; ++b) {
      TestMesh mesh = neighbourhood(kBottom | kWest | kTop, true);
      mesh.cells.back().corners[a] = mesh.cells.back().corners[b];
      mesh.cells.push_back(mesh.cells.back());  // and the same cell again
      expect_same_cells(mesh);
      ASSERT_FALSE(HasFailure()) << a << ' ' << b;
    }
}

TEST(Connectivity, AnIslandIsFoundByItsNumber) {
  // The row grows alternately at its two ends. The gate (the face to which a hexahedron is
  // attached) therefore never belongs to the previous hexahedron.
  const TestMesh row = grid(20, 1, 1);
  TestMesh mesh = row;
  mesh.cells.clear();
  for (std::size_t i = 0; i < 10; ++i) {
    mesh.cells.push_back(row.cells[i]);
    mesh.cells.push_back(row.cells[19 - i]);
  }
  const auto cells = expect_same_cells(mesh);
  for (std::size_t i = 2; i < 19; ++i) EXPECT_EQ(std::popcount(cells[i].face_mask), 1);
  EXPECT_EQ(std::popcount(cells[19].face_mask), 2);
}

TEST(Connectivity, RegularGridsCostLittle) {
  const TestMesh mesh = grid(16, 16, 16);
  expect_same_cells(mesh);
  MemorySink sink;
  const auto report = write_mesh(mesh, sink);
  ASSERT_TRUE(report);
  EXPECT_LT(report->streams.at("connectivity"), 600u);  // of 4096 cells
}

// Some cells of this mesh were divided into eight. The codec `replay` predicts the corners of a
// cell from an earlier cell, and also predicts which of these predictions are wrong (the strays).
TEST(Connectivity, CutCellsReplayInFewBits) {
  // Limits in bytes. The sizes would be 5000 and 5464 bytes if the codec did not predict strays.
  for (const auto& [order, most] : {std::pair{Order::keep, 4300u}, {Order::stream, 4950u}}) {
    TestMesh mesh = cut_into_eight(8);
    ASSERT_EQ(mesh.cells.size(), 4488u);
    mesh.schema.order = order;
    expect_same_cells(mesh);
    MemorySink sink;
    WriteOptions options;
    options.connectivity = ConnectivityCodec::replay;
    const auto report = write_mesh(mesh, sink, options);
    ASSERT_TRUE(report);
    EXPECT_LT(report->streams.at("connectivity"), most);
  }
}

// Decoding arbitrary bytes must either succeed or return an error.
TEST(Connectivity, AnyBytesDecodeOrAreRefused) {
  std::mt19937_64 random(1);
  TestMesh mesh;
  mesh.schema = hexahedra_schema();
  mesh.schema.blocks.push_back({2, "quadratic", CellShape::hexahedron, 27});
  mesh.schema.blocks.push_back({3, "polygons", CellShape::polygon, 0});
  for (int n = 0; n < 400; ++n) {
    std::vector<std::byte> bytes(random() % 300);
    for (auto& b : bytes) b = static_cast<std::byte>(random() % (n % 2 == 0 ? 256 : 3));
    RangeDecoder symbols(bytes), order(std::span<const std::byte>(bytes).subspan(bytes.size() / 2));
    Connectivity<RangeDecoder> decoder(mesh.schema);
    constexpr std::array<ConnectivityCodec, 4> kCodecs = {
        ConnectivityCodec::paper, ConnectivityCodec::rows, ConnectivityCodec::replay,
        ConnectivityCodec::mixed};
    decoder.set_codec(kCodecs[static_cast<std::size_t>(n / 2) % 4]);
    CellTopology cell;
    for (int c = 0; c < 200 && decoder.decode_cell(symbols, order, cell); ++c) {
      for (std::uint32_t slot : cell.slots) ASSERT_TRUE(decoder.surface().vertex(slot).alive);
      decoder.finish_cell(cell);
    }
  }
}

}  // namespace
}  // namespace shm
