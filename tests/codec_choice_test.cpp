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
  return back ? back->totals.connectivity : ConnectivityCodec::automatic;
}

TEST(CodecChoice, TheSmallerOneWins) {
  using enum ConnectivityCodec;
  TestMesh scrambled = grid(12, 12, 12);
  std::mt19937_64 random(9);
  shuffle_vertices(scrambled, random);
  for (const TestMesh& mesh : {grid(15, 12, 12), shuffled(grid(12, 12, 12)), scrambled}) {
    const std::uint64_t smallest = std::min(bytes_with(mesh, rows), bytes_with(mesh, replay));
    EXPECT_EQ(bytes_with(mesh, automatic), smallest);
    EXPECT_EQ(bytes_with(mesh, codec_of(mesh)), smallest);
  }
}

TEST(CodecChoice, MixedOnlyWhenAsked) {
  using enum ConnectivityCodec;
  TestMesh scrambled = shuffled(grid(12, 12, 12));
  EXPECT_NE(codec_of(scrambled), mixed);
  WriteOptions options;
  options.connectivity = mixed;
  EXPECT_EQ(codec_of(scrambled, options), mixed);
  EXPECT_LT(bytes_with(scrambled, mixed), bytes_with(scrambled, rows));
  EXPECT_LE(bytes_with(grid(15, 12, 12), mixed), bytes_with(grid(15, 12, 12), rows));
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

TEST(CodecChoice, WhereBirthsNumberVerticesItIsRows) {
  TestMesh mesh = grid(12, 12, 12);
  EXPECT_EQ(codec_of(with_order(mesh, Order::stream, true, 0)), ConnectivityCodec::rows);
  EXPECT_EQ(codec_of(grid(3, 3, 3)), ConnectivityCodec::rows);  // too small to try
  WriteOptions options;
  options.connectivity = ConnectivityCodec::paper;
  EXPECT_EQ(codec_of(mesh, options), ConnectivityCodec::paper);
}

}  // namespace
}  // namespace shm
