// Tests which codec a Writer chooses for hexahedra: at level default, no other codec may result in
// a file that is clearly smaller.
#include <gtest/gtest.h>

#include <random>

#include "shm/summary.h"
#include "support/feature_files.h"
#include "support/sanitized.h"

namespace shm {
namespace {

std::uint64_t bytes_with(const TestMesh& mesh, ConnectivityCodec codec) {
  return written(mesh, 65536, codec).size();
}

/// Writes the mesh and returns the codec of its first segment. With sanitizers, the file is not
/// read back, because the meshes are large; other tests read smaller meshes that are coded with the
/// same codecs.
ConnectivityCodec codec_of(const TestMesh& mesh, const WriteOptions& options = {}) {
  MemorySink sink;
  if (kSanitized)
    EXPECT_TRUE(write_mesh(mesh, sink, options));
  else
    sink.bytes = expect_round_trip(mesh, options);
  MemoryRandomSource source(sink.bytes);
  const auto summary = read_summary(source);
  EXPECT_TRUE(summary);
  if (!summary || summary->totals.segment_connectivity.empty()) return ConnectivityCodec::automatic;
  return summary->totals.segment_connectivity[0];
}

TEST(CodecChoice, ASlowerCodecMustSaveAFewPercent) {
  using enum ConnectivityCodec;
  TestMesh scrambled = grid(12, 12, 12);
  std::mt19937_64 random(9);
  shuffle_vertices(scrambled, random);
  for (const TestMesh& mesh : {grid(15, 12, 12), shuffled(grid(12, 12, 12)), scrambled}) {
    for (const Order order : {Order::keep, Order::stream}) {
      const TestMesh ordered = with_order(mesh, order, true, 0);
      const std::uint64_t smallest =
          std::min(bytes_with(ordered, rows), bytes_with(ordered, replay));
      EXPECT_EQ(bytes_with(ordered, automatic), bytes_with(ordered, codec_of(ordered)));
      // A slower codec must save 1/64 of the bitstreams.
      EXPECT_LE(bytes_with(ordered, automatic), smallest + smallest / 64 + 8);
    }
  }
}

TEST(CodecChoice, MixedOnlyAtLevelBest) {
  using enum ConnectivityCodec;
  TestMesh scrambled = shuffled(grid(12, 12, 12));
  EXPECT_EQ(codec_of(scrambled, {.level = Level::best}), mixed);
  EXPECT_EQ(codec_of(scrambled), rows);
  EXPECT_EQ(codec_of(scrambled, {.level = Level::fast}), patterns);
  WriteOptions options;
  options.connectivity = mixed;
  EXPECT_EQ(codec_of(scrambled, options), mixed);
  EXPECT_LT(bytes_with(scrambled, mixed), bytes_with(scrambled, rows));
  EXPECT_LE(bytes_with(grid(15, 12, 12), mixed), bytes_with(grid(15, 12, 12), rows));
}

TEST(CodecChoice, EachSegmentForItself) {
  // The first half of the cells is in grid rows, the second half in random order.
  TestMesh mesh = grid(16, 16, 16);
  std::mt19937_64 random(4);
  std::shuffle(mesh.cells.begin() + 2048, mesh.cells.end(), random);
  WriteOptions options;
  options.segment_cells = 2048;
  const auto one = expect_round_trip(mesh, options);
  options.threads = 2;
  EXPECT_EQ(expect_round_trip(mesh, options), one);
}

TEST(CodecChoice, TheCallerMaySayIt) {
  using enum ConnectivityCodec;
  TestMesh mesh = grid(12, 12, 12);
  WriteOptions options;
  options.connectivity = paper;
  EXPECT_EQ(codec_of(mesh, options), paper);
  options.segment_cells = 500;
  options.segment_connectivity = {rows, paper, replay};
  const auto back = read_mesh(expect_round_trip(mesh, options));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->totals.segment_connectivity,
            (std::vector<ConnectivityCodec>{rows, paper, replay, replay}));
  options.segment_connectivity = {shifts, rows, shifts, replay};
  const auto again = read_mesh(expect_round_trip(mesh, options));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->totals.segment_connectivity, options.segment_connectivity);
}

TEST(CodecChoice, FastTakesPatternsWhereThereCanBeSome) {
  using enum ConnectivityCodec;
  TestMesh mesh = grid(26, 26, 26);
  std::mt19937_64 random(4);
  std::vector<std::array<double, 3>> points(mesh.vertices);
  for (auto& point : points)
    for (double& v : point) v = static_cast<double>(random() >> 40);
  mesh.set_points(points);
  // A few cells are out of order. Such a mesh needs fewer bits with the codec `rows` than with
  // `patterns`.
  for (std::size_t i = 4000; i < mesh.cells.size(); i += 4000)
    std::swap(mesh.cells[i], mesh.cells[i + random() % 60]);
  const auto in_stream = [](const TestMesh& of) { return with_order(of, Order::stream, true, 0); };
  EXPECT_EQ(codec_of(shuffled(mesh), {.level = Level::fast}), patterns);
  EXPECT_EQ(codec_of(grid(6, 5, 5), {.level = Level::fast}), patterns);
  EXPECT_EQ(codec_of(grid(5, 5, 5), {.level = Level::fast}), rows);  // few cells
  EXPECT_EQ(codec_of(in_stream(shuffled(mesh)), {.level = Level::fast}), patterns);
  EXPECT_EQ(codec_of(with_order(mesh, Order::stream, true, 5), {.level = Level::fast}), rows);
  // the codec `shifts` cannot encode polygons with varying numbers of nodes
  mesh.schema.blocks.push_back({2, "polygons", CellShape::polygon, 0});
  EXPECT_EQ(codec_of(in_stream(mesh), {.level = Level::fast}), rows);
  EXPECT_EQ(codec_of(in_stream(mesh), {.level = Level::best}), mixed);
}

TEST(CodecChoice, FastTakesShiftsWhereTheyTakeNoRoom) {
  using enum ConnectivityCodec;
  const auto of = [](const TestMesh& mesh, Level level) {
    return codec_of(mesh, {.level = level});
  };
  const TestMesh large = bent_grid(26, 26, 26);
  EXPECT_EQ(of(large, Level::fast), shifts);
  EXPECT_EQ(of(bent_grid(64, 16, 16), Level::fast), shifts);  // the shortest rows that shifts allow
  EXPECT_NE(of(large, Level::best), shifts);
  // The mesh is too small for speed to matter.
  EXPECT_NE(of(bent_grid(25, 25, 26), Level::fast), shifts);
  // The mesh has no rows.
  EXPECT_NE(of(shuffled(large), Level::fast), shifts);
  EXPECT_NE(of(with_order(shuffled(large), Order::stream, true, 0), Level::fast), shifts);
  TestMesh scrambled = large;
  std::mt19937_64 random(9);
  shuffle_vertices(scrambled, random);
  EXPECT_NE(of(scrambled, Level::fast), shifts);
  // In orders `stream` and `free`, vertices are renumbered, so the vertex numbers of the source do
  // not matter.
  for (const Order order : {Order::stream, Order::free})
    EXPECT_EQ(of(with_order(scrambled, order, false, 0), Level::fast), shifts);
  // The schema does not allow shifts.
  EXPECT_NE(of(with_order(large, Order::keep, true, 10), Level::fast), shifts);
  EXPECT_NE(of(with_order(large, Order::stream, true, 10), Level::fast), shifts);
  TestMesh polygons = large;
  polygons.schema.blocks.push_back({2, "polygons", CellShape::polygon, 0});
  EXPECT_NE(of(polygons, Level::fast), shifts);
}

TEST(CodecChoice, DefaultTakesShiftsWhereValuesAreAsSmall) {
  using enum ConnectivityCodec;
  const TestMesh large = bent_grid(33, 33, 33);
  EXPECT_EQ(codec_of(large, {}), shifts);
  SizeReport by_number, over_surface;
  expect_round_trip(large, {}, &by_number);
  expect_round_trip(large, {.connectivity = replay}, &over_surface);
  EXPECT_LE(by_number.streams.at("geometry") * 100, over_surface.streams.at("geometry") * 101);
  // A mesh that is shorter than the sample
  const TestMesh small = bent_grid(15, 16, 17);
  EXPECT_LE(bytes_with(small, automatic) * 100, bytes_with(small, rows) * 103);
  // The writer does not choose shifts if the mesh has no rows, or if every hundredth cell is out of
  // order.
  EXPECT_NE(codec_of(shuffled(large), {}), shifts);
  TestMesh disturbed = large;
  for (std::size_t i = 0; i + 50 < disturbed.cells.size(); i += 100)
    std::swap(disturbed.cells[i], disturbed.cells[i + 50]);
  EXPECT_NE(codec_of(disturbed, {}), shifts);
}

TEST(CodecChoice, FastLooksAtEachSegment) {
  using enum ConnectivityCodec;
  TestMesh mesh = bent_grid(32, 32, 40);
  std::mt19937_64 random(4);
  std::shuffle(mesh.cells.begin() + 20480, mesh.cells.end(), random);
  WriteOptions options;
  options.level = Level::fast;
  options.segment_cells = 20480;
  options.group_cells = 5000;
  const auto one = expect_round_trip(mesh, options);
  const auto back = read_mesh(one);
  ASSERT_TRUE(back);
  ASSERT_EQ(back->totals.segment_connectivity.size(), 2u);
  EXPECT_EQ(back->totals.segment_connectivity[0], shifts);
  EXPECT_NE(back->totals.segment_connectivity[1], shifts);
  options.threads = 2;
  EXPECT_EQ(expect_round_trip(mesh, options), one);
}

}  // namespace
}  // namespace shm
