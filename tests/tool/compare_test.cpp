// Tests the comparison of meshes, and round trips through a .shm file. Data must be restored
// unchanged in orders `keep` and `stream`, and every kind of change must be detected.
#include "compare/compare.h"
#include "mesh/cell_rotations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>

#include "base/failure.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "support/memory_mesh.h"

namespace shm::converters {
namespace {

CompareReport compare(MeshSource& source, MeshSource& restored) {
  Spool spool(::testing::TempDir());
  return compare_meshes(source, restored, spool);
}

std::string words(const CompareReport& report) {
  std::string text;
  for (const std::string& sentence : report.first) text += sentence + "\n";
  return text;
}

struct Compressed {
  std::vector<std::byte> bytes;
  SizeReport sizes;
};

Compressed compress(MeshSource& mesh, const CompressOptions& options = {}) {
  Spool spool(::testing::TempDir());
  MemorySink sink;
  Compressed result;
  result.sizes = compress_mesh(mesh, sink, options, spool);
  result.bytes = std::move(sink.bytes);
  return result;
}

CompressOptions options_of(Order order, std::uint32_t delay = 0, std::uint32_t bits = 0) {
  CompressOptions options;
  options.order = order;
  options.delay = delay;
  if (bits > 0) options.lossy.coordinates = Accuracy::of_bits(bits);
  return options;
}

// Compresses a mesh, restores it, and compares it with the source.
CompareReport round_trip(MeshSource& mesh, const CompressOptions& options) {
  const Compressed compressed = compress(mesh, options);
  Spool spool(::testing::TempDir());
  MemorySource source(compressed.bytes);
  StagedMesh restored(source, "test.shm", spool);
  return compare_meshes(mesh, restored, spool);
}

TEST(Compare, HexahedronHas24Rotations) {
  const auto& rotations = rotations_of(CellShape::hexahedron, 8);
  EXPECT_EQ(rotations.size(), 24u);
  std::set<std::string> distinct;
  for (const Rotation& turn : rotations) distinct.emplace(turn.begin(), turn.end());
  EXPECT_EQ(distinct.size(), 24u);
  constexpr int kCorner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                 {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  for (const auto& rotation : rotations) {
    // After the rotation, the edges 0-1, 0-3 and 0-4 still form a right-handed coordinate system.
    int edge[3][3];
    constexpr int kEnds[3] = {1, 3, 4};
    for (int e = 0; e < 3; ++e)
      for (int d = 0; d < 3; ++d)
        edge[e][d] =
            kCorner[rotation[static_cast<std::size_t>(kEnds[e])]][d] - kCorner[rotation[0]][d];
    const int volume = edge[0][0] * (edge[1][1] * edge[2][2] - edge[1][2] * edge[2][1]) -
                       edge[0][1] * (edge[1][0] * edge[2][2] - edge[1][2] * edge[2][0]) +
                       edge[0][2] * (edge[1][0] * edge[2][1] - edge[1][1] * edge[2][0]);
    EXPECT_EQ(volume, 1);
  }
}

TEST(Compare, EqualToItself) {
  MemoryMesh a = rich_mesh(), b = rich_mesh();
  b.most_at_once = 7;
  EXPECT_TRUE(compare(a, b).equal());
}

TEST(Compare, FindsEveryKindOfChange) {
  struct Case {
    const char* sentence;
    std::function<void(MemoryMesh&)> change;
  };
  const Case cases[] = {
      {"source format: test in the source, vtk",
       [](MemoryMesh& m) { m.mesh.schema.source_format = "vtk"; }},
      {"number of vertices", [](MemoryMesh& m) { m.add_point(0, 0, 0); }},
      {"number of cells", [](MemoryMesh& m) { m.add_cell(0, m.cells[0]); }},
      {"block 1: id 7, 'block 7', wedge of 6",
       [](MemoryMesh& m) { m.mesh.schema.blocks[1].id = 8; }},
      {"coordinates, vertex 12, component 1",
       [](MemoryMesh& m) { m.points[12 * 24 + 8] ^= std::byte{1}; }},
      {"block of cell 3", [](MemoryMesh& m) { std::swap(m.cell_blocks[3], m.cell_blocks[4]); }},
      {"corners of cell 5", [](MemoryMesh& m) { std::swap(m.cells[5][0], m.cells[5][1]); }},
      {"array 0: 'tag'", [](MemoryMesh& m) { m.mesh.schema.arrays[0].name = "Tag"; }},
      {"array 'tag', vertex 9: 109 in the source, 108",
       [](MemoryMesh& m) { m.arrays[0][0][72] ^= std::byte{1}; }},
      {"array 'heat', step 2, vertex 0", [](MemoryMesh& m) { m.arrays[2][2][7] ^= std::byte{1}; }},
      {"array 'level', element 3, component 1",
       [](MemoryMesh& m) { m.arrays[4][0][14] ^= std::byte{1}; }},
      {"number of time steps", [](MemoryMesh& m) { m.mesh.step_times.pop_back(); }},
      {"time of step 1: 0.25 in the source, 0.26",
       [](MemoryMesh& m) { m.mesh.step_times[1] = 0.26; }},
      {"extra 'test/title' is missing", [](MemoryMesh& m) { m.mesh.extras.pop_back(); }},
      {"extra 'test/new' is not in the source",
       [](MemoryMesh& m) {
         m.add_extra<std::uint8_t>("test/new", ScalarType::uint8, Reference::nothing, {1});
       }},
      {"extra 'test/picked/cells', value 1: 3 in the source, 2",
       [](MemoryMesh& m) { m.mesh.extras[1].data[8] = std::byte{2}; }},
      {"extra 'test/title': [2] uint8 in the source, [1 x 2] uint8",
       [](MemoryMesh& m) {
         m.mesh.extras[2].shape = {1, 2};
       }},
  };
  for (const Case& test : cases) {
    MemoryMesh a = rich_mesh(), b = rich_mesh();
    test.change(b);
    const CompareReport report = compare(a, b);
    EXPECT_FALSE(report.equal()) << test.sentence;
    EXPECT_NE(words(report).find(test.sentence), std::string::npos) << words(report);
  }
}

TEST(Compare, SignOfZeroAndNanPayloadCount) {
  for (const double value : {0.0, std::numeric_limits<double>::quiet_NaN()}) {
    MemoryMesh a = grid_mesh(1, 1, 1), b = grid_mesh(1, 1, 1);
    double other = -value;
    std::memcpy(a.points.data(), &value, 8);
    std::memcpy(b.points.data(), &other, 8);
    EXPECT_EQ(compare(a, b).differences, 1u);
  }
}

TEST(Compare, QuantizedValuesHaveAPromise) {
  MemoryMesh a = grid_mesh(4, 4, 4), b = grid_mesh(4, 4, 4);
  b.mesh.schema.coordinate_quantization = {8, {0, 0, 0}, {2, 2, 2}};
  const double promise = b.mesh.schema.coordinate_quantization.max_error(ScalarType::float64);
  double value = 0.9 * promise;
  std::memcpy(b.points.data(), &value, 8);
  CompareReport report = compare(a, b);
  EXPECT_TRUE(report.equal()) << words(report);
  ASSERT_EQ(report.measured.size(), 1u);
  EXPECT_EQ(report.measured[0].largest, value);
  value = 1.1 * promise;
  std::memcpy(b.points.data(), &value, 8);
  EXPECT_FALSE(compare(a, b).equal());
  value = std::numeric_limits<double>::infinity();
  std::memcpy(b.points.data(), &value, 8);
  EXPECT_FALSE(compare(a, b).equal());
  std::memcpy(a.points.data(), &value, 8);
  EXPECT_TRUE(compare(a, b).equal());
}

TEST(RoundTrip, EveryOrderWithAndWithoutDelay) {
  MemoryMesh rich = rich_mesh();
  for (const Order order : {Order::keep, Order::stream})
    for (const std::uint32_t delay : {0u, 3u, 1000u}) {
      const CompareReport report = round_trip(rich, options_of(order, delay));
      EXPECT_TRUE(report.equal()) << "delay " << delay << "\n" << words(report);
    }
  const CompareReport report = round_trip(rich, options_of(Order::free));
  EXPECT_TRUE(report.equal()) << words(report);
}

TEST(RoundTrip, ShuffledCells) {
  MemoryMesh mesh = grid_mesh(9, 8, 7);
  shuffle_mesh(mesh, 11, true);
  for (const Order order : {Order::keep, Order::stream, Order::free})
    EXPECT_TRUE(round_trip(mesh, options_of(order, 10)).equal());
}

TEST(RoundTrip, SideSetsKeepCornerOrder) {
  MemoryMesh mesh = grid_mesh(5, 4, 3);
  EXPECT_FALSE(needs_corner_order(mesh.info()));
  mesh.add_extra<std::int64_t>("test/side_set/0/elements", ScalarType::int64, Reference::cell,
                               {7, 2});
  EXPECT_TRUE(needs_corner_order(mesh.info()));
  EXPECT_TRUE(round_trip(mesh, options_of(Order::stream, 5)).equal());
}

TEST(RoundTrip, OnlyDataByPlaceKeepsCornerOrder) {
  const auto with_role = [](const std::string& role) {
    MemoryMesh mesh = grid_mesh(2, 1, 1);
    mesh.add_array<std::int32_t>({"a", Location::cell, ScalarType::int32, 1, false, {}, role, {}},
                                 {{1, 2}});
    return needs_corner_order(mesh.info());
  };
  for (const char* role : {"exodus:edgconn1", "exodus:facconn12", "gmsh:element_node_data"})
    EXPECT_TRUE(with_role(role)) << role;
  for (const char* role : {"", "exodus:edgconn", "exodus:surface", "gmsh:element_tag", "x:node"})
    EXPECT_FALSE(with_role(role)) << role;

  const auto with_extra = [](const std::string& key) {
    MemoryMesh mesh = grid_mesh(2, 1, 1);
    mesh.mesh.schema.source_format = "exodus";
    mesh.add_extra<std::int64_t>(key, ScalarType::int64, Reference::nothing, {1});
    return needs_corner_order(mesh.info());
  };
  for (const char* key : {"mesh/side_set/0/sides", "exodus/edge_set/0/sides",
                          "exodus/variable/side_ss1", "exodus/variable/side_ss1/2"})
    EXPECT_TRUE(with_extra(key)) << key;
  for (const char* key : {"mesh/node_set/0/members", "exodus/variable/ss_side_cnt_global"})
    EXPECT_FALSE(with_extra(key)) << key;
}

TEST(RoundTrip, QuantizedCoordinates) {
  MemoryMesh mesh = rich_mesh();
  const double odd = std::numeric_limits<double>::quiet_NaN();
  std::memcpy(mesh.points.data() + 24, &odd, 8);
  for (const std::uint32_t bits : {1u, 16u, 52u}) {
    MemoryMesh plain = grid_mesh(6, 5, 4);
    for (MemoryMesh* each : {&mesh, &plain}) {
      const CompareReport report = round_trip(*each, options_of(Order::keep, 0, bits));
      EXPECT_TRUE(report.equal()) << bits << " bits\n" << words(report);
      // If rounding does not make a mesh smaller, its coordinates are exact.
      if (each == &mesh && bits == 16) {
        EXPECT_EQ(report.measured.size(), 1u);
      }
      for (const MeasuredError& error : report.measured) EXPECT_LE(error.largest, error.promised);
    }
  }
}

TEST(RoundTrip, EmptyAndUnusedVertices) {
  MemoryMesh mesh;
  EXPECT_TRUE(round_trip(mesh, options_of(Order::keep)).equal());
  mesh.add_point(1, 2, 3);
  mesh.add_point(4, 5, 6);
  for (const Order order : {Order::keep, Order::stream, Order::free})
    EXPECT_TRUE(round_trip(mesh, options_of(order)).equal());
}

TEST(RoundTrip, StreamsAddUp) {
  MemoryMesh mesh = rich_mesh();
  const Compressed compressed = compress(mesh);
  std::uint64_t sum = 0;
  for (const auto& [name, bytes] : compressed.sizes.streams) sum += bytes;
  EXPECT_EQ(sum, compressed.bytes.size());
  EXPECT_EQ(compressed.sizes.total_bytes, compressed.bytes.size());
}

TEST(RoundTrip, SameBytesEveryTime) {
  MemoryMesh mesh = rich_mesh();
  const auto first = compress(mesh, options_of(Order::stream, 20)).bytes;
  mesh.most_at_once = 13;
  EXPECT_EQ(first, compress(mesh, options_of(Order::stream, 20)).bytes);
}

TEST(RoundTrip, ChangedMeshIsNotTakenForTheSource) {
  MemoryMesh mesh = grid_mesh(6, 5, 4);
  for (const std::uint32_t delay : {0u, 10u}) {
    const Compressed compressed = compress(mesh, options_of(Order::stream, delay));
    MemoryMesh moved = grid_mesh(6, 5, 4);
    moved.points[100] ^= std::byte{1};
    MemoryMesh turned = grid_mesh(6, 5, 4);
    std::swap(turned.cells[20][0], turned.cells[20][6]);
    for (MemoryMesh* each : {&moved, &turned}) {
      Spool spool(::testing::TempDir());
      MemorySource source(compressed.bytes);
      StagedMesh restored(source, "test.shm", spool);
      EXPECT_FALSE(compare_meshes(*each, restored, spool).equal());
    }
  }
}

TEST(RoundTrip, CellsOfEachBlockTogether) {
  MemoryMesh mesh = grid_mesh(6, 5, 4);
  mesh.add_block(CellShape::hexahedron, 8, 2);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) mesh.cell_blocks[c] = c < 60 ? 0 : 1;
  mesh.mesh.block_cells = {60, 60};
  std::vector<std::int32_t> tags(120);
  std::iota(tags.begin(), tags.end(), 0);
  mesh.add_array<std::int32_t>({"tag", Location::cell, ScalarType::int32, 1, false, {}, "", {}},
                               {tags});
  mesh.add_extra<std::int32_t>("test/cells", ScalarType::int32, Reference::cell, tags);
  const Compressed compressed = compress(mesh, options_of(Order::stream, 100));
  Spool spool(::testing::TempDir());
  MemorySource source(compressed.bytes);
  StagedMesh restored(source, "test.shm", spool);

  // Sorts the cells of the restored mesh by block. This is how cells are ordered after conversion
  // to a format that stores the cells of each block consecutively.
  MemoryMesh grouped;
  grouped.mesh = restored.info();
  grouped.mesh.schema.order = Order::keep;
  grouped.points.resize(restored.info().vertices * 24);
  restored.read_points(0, restored.info().vertices, grouped.points.data());
  CellBatch batch;
  ASSERT_TRUE(restored.next_cells(batch, 120));
  ASSERT_EQ(batch.size(), 120u);
  std::vector<std::int32_t> values(120), moved, position(120);
  restored.read_array(0, 0, 0, 120, reinterpret_cast<std::byte*>(values.data()));
  bool alternating = false;
  for (std::uint32_t block = 0; block < 2; ++block)
    for (std::size_t c = 0; c < 120; ++c) {
      alternating |= c > 0 && batch.blocks[c] < batch.blocks[c - 1];
      if (batch.blocks[c] != block) continue;
      position[c] = static_cast<std::int32_t>(moved.size());
      moved.push_back(values[c]);
      grouped.cell_blocks.push_back(block);
      grouped.cells.emplace_back(batch.cell(c).begin(), batch.cell(c).end());
    }
  EXPECT_TRUE(alternating) << "the test needs cells of both blocks in alternation";
  grouped.arrays = {{bytes_of(moved)}};
  std::vector<std::int32_t> cells(120);
  std::memcpy(cells.data(), restored.info().extras[0].data.data(), 480);
  for (std::int32_t& cell : cells) cell = position[static_cast<std::size_t>(cell)];
  grouped.mesh.extras[0].data = bytes_of(cells);
  const CompareReport report = compare_meshes(grouped, restored, spool);
  EXPECT_TRUE(report.equal()) << words(report);
  std::swap(grouped.cells[3], grouped.cells[4]);
  EXPECT_FALSE(compare_meshes(grouped, restored, spool).equal());
}

TEST(RoundTrip, TruncatedFileIsSaidSo) {
  MemoryMesh mesh = rich_mesh();
  const Compressed compressed = compress(mesh);
  for (const std::size_t cut : {std::size_t{0}, std::size_t{10}, compressed.bytes.size() / 2,
                                compressed.bytes.size() - 1}) {
    Spool spool(::testing::TempDir());
    MemorySource source(std::span(compressed.bytes).first(cut));
    try {
      StagedMesh restored(source, "cut.shm", spool);
      ADD_FAILURE() << "cut at " << cut;
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.error().code, ErrorCode::truncated) << failure.what();
      EXPECT_EQ(failure.error().file, "cut.shm");
    }
  }
}

}  // namespace
}  // namespace shm::converters
