// The codec of hexahedra that a Writer takes when nobody says: never larger than the best one.
#include <gtest/gtest.h>

#include <random>

#include "feature_files.h"

namespace shm {
namespace {

std::uint64_t bytes_with(const TestMesh& mesh, ConnectivityCodec codec) {
  return written(mesh, 65536, codec).size();
}

ConnectivityCodec codec_of(const TestMesh& mesh, const WriteOptions& options = {}) {
  const auto back = read_mesh(expect_round_trip(mesh, options));
  EXPECT_TRUE(back);
  if (!back || back->totals.segment_connectivity.empty()) return ConnectivityCodec::automatic;
  return back->totals.segment_connectivity[0];
}

TEST(CodecChoice, TheSmallerOneWins) {
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
      EXPECT_LE(bytes_with(ordered, automatic), smallest + 8);  // bitstreams are what is compared
    }
  }
}

TEST(CodecChoice, EachSegmentForItself) {
  // Rows of a grid first, then the same in no order.
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
}

TEST(CodecChoice, FastTakesTheFasterUnlessItCostsMuch) {
  using enum ConnectivityCodec;
  TestMesh mesh = grid(26, 26, 26);
  std::mt19937_64 random(4);
  std::vector<std::array<double, 3>> points(mesh.vertices);
  for (auto& point : points)
    for (double& v : point) v = static_cast<double>(random() >> 40);
  mesh.set_points(points);
  // A few cells out of line: rows say them in fewer bits.
  for (std::size_t i = 4000; i < mesh.cells.size(); i += 4000)
    std::swap(mesh.cells[i], mesh.cells[i + random() % 60]);
  const TestMesh stream = with_order(mesh, Order::stream, true, 0);
  EXPECT_EQ(codec_of(stream, {.level = Level::fast}), replay);
  EXPECT_EQ(codec_of(stream, {.level = Level::best}), rows);
  EXPECT_EQ(codec_of(with_order(shuffled(mesh), Order::stream, true, 0), {.level = Level::fast}),
            rows);
}

}  // namespace
}  // namespace shm
