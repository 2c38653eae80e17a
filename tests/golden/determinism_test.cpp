// The same input gives the same mesh groups: on every machine, with every compiler, in every
// version that does not change the coders on purpose. It runs under g++ -O0, -O1 and -O3 (presets
// same-gcc-O0, tsan, release) and clang -O1 and -O3 (dev, same-clang-O3), with one thread and two.
// On a mismatch the new table is printed, to be put in place of the old one where the change is
// meant (the commit says which stream gained or lost). What passes through zstd (schema, extras,
// steps) may change with zstd's version and is left out; of groups of shifts what goes in counts.
#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <map>
#include <string>

#include "bytes/binary.h"
#include "segment/mesh_streams.h"
#include "support/feature_files.h"
#include "support/file_surgery.h"

namespace shm {
namespace {

/// A stream whose end is a zstd frame: what stands before it, and what it unpacks to.
std::vector<std::byte> unpacked(const std::vector<std::byte>& stream) {
  constexpr std::array<std::byte, 4> kMagic = {std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f},
                                               std::byte{0xfd}};
  const auto frame = std::search(stream.begin(), stream.end(), kMagic.begin(), kMagic.end());
  const auto begin = static_cast<std::size_t>(frame - stream.begin());
  const auto packed = std::span(stream).subspan(begin);
  const auto content =
      zstd_decompress(packed, ZSTD_getFrameContentSize(packed.data(), packed.size()));
  EXPECT_TRUE(content.has_value());
  std::vector<std::byte> all = stream;
  all.resize(begin);
  if (content) all.insert(all.end(), content->begin(), content->end());
  return all;
}

std::uint64_t hash_of(const std::vector<std::byte>& file) {
  std::vector<std::byte> groups;
  for (const Chunk& chunk : take_apart(file).chunks) {
    if (!chunk.is(container::ChunkKind::group)) continue;
    auto group = take_group_apart(chunk.payload);
    if (group && !group->streams.empty() &&
        group->header.streams[0].codec == container::Codec::shifts)
      for (std::size_t s = 0; s < group->streams.size(); ++s)
        if (group->header.streams[s].kind != container::StreamKind::vertex_numbers &&
            !is_predicted(group->header.streams[s].codec))
          group->streams[s] = unpacked(group->streams[s]);
    const auto bytes = group ? put_group_together(std::move(*group)) : chunk.payload;
    groups.insert(groups.end(), bytes.begin(), bytes.end());
  }
  return XXH64(groups.data(), groups.size(), 0);
}

/// Layers of hexahedra, wedges, pyramids and tetrahedra, triangles on top.
TestMesh large_cut_grid() {
  TestMesh mesh = bent_grid(9, 9, 12, ScalarType::float64);
  auto& blocks = mesh.schema.blocks;
  blocks.push_back({2, "", CellShape::wedge, 6});
  blocks.push_back({3, "", CellShape::pyramid, 5});
  blocks.push_back({4, "", CellShape::tetrahedron, 4});
  blocks.push_back({5, "", CellShape::triangle, 3});
  using Part = std::pair<std::uint32_t, std::vector<std::size_t>>;
  const std::array<std::vector<Part>, 4> kinds = {
      {{{0, {0, 1, 2, 3, 4, 5, 6, 7}}},
       {{1, {0, 1, 2, 4, 5, 6}}, {1, {0, 2, 3, 4, 6, 7}}},
       {{2, {0, 1, 2, 3, 6}}, {2, {0, 4, 5, 1, 6}}, {2, {0, 3, 7, 4, 6}}},
       {{3, {0, 1, 2, 6}},
        {3, {0, 2, 3, 6}},
        {3, {0, 3, 7, 6}},
        {3, {0, 7, 4, 6}},
        {3, {0, 4, 5, 6}},
        {3, {0, 5, 1, 6}},
        {4, {4, 5, 6}}}}};
  std::vector<TestCell> cells;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c)
    for (const auto& [block, corners] : kinds[c / 243]) {
      cells.push_back({block, {}});
      for (std::size_t i : corners) cells.back().corners.push_back(mesh.cells[c].corners[i]);
    }
  mesh.cells = std::move(cells);
  return mesh;
}

/// Larger than the feature files: where adaptive models, groups and reused slots come into play.
std::vector<FeatureFile> larger_files() {
  using enum Order;
  std::vector<FeatureFile> files;
  const auto add = [&](const char* name, const TestMesh& mesh, std::uint32_t group_cells = 65536) {
    files.push_back({name, written(mesh, group_cells)});
  };
  const auto add_segments = [&](const char* name, const TestMesh& mesh, std::uint64_t cells) {
    MemorySink sink;
    WriteOptions options;
    options.segment_cells = cells;
    options.group_cells = 300;
    EXPECT_TRUE(write_mesh(mesh, sink, options));
    files.push_back({name, std::move(sink.bytes)});
  };
  add("large grid", bent_grid(16, 15, 14));
  add("large grid, doubles, groups", bent_grid(16, 15, 14, ScalarType::float64), 500);
  add("large grid, shuffled, stream, delay",
      with_order(shuffled(bent_grid(12, 12, 12)), stream, false, 300));
  add("large grid, shuffled, keep, delay",
      with_order(shuffled(bent_grid(12, 12, 12)), keep, true, 300));
  add("large holes", grid(16, 16, 16, ScalarType::float32, straight, porous));
  add("large ring", exact_ring(40, 6, 8));
  add_segments("large segments", bent_grid(14, 13, 16), 700);
  add_segments("large segments, stream",
               with_order(shuffled(bent_grid(10, 10, 10)), stream, false, 20), 300);
  TestMesh in_any_order = large_cut_grid();
  PlainRandom(3).shuffle(in_any_order.cells);
  add("large cells of every shape", with_arrays_of_every_type(large_cut_grid()), 900);
  add("large cells of every shape, shuffled, stream",
      with_order(std::move(in_any_order), stream, true, 100));
  add("large arrays", with_arrays_of_every_type(bent_grid(9, 9, 9)));
  TestMesh coarse = bent_grid(12, 12, 12);
  coarse.schema.coordinate_quantization = {14, {0, 0, -.0625}, {1.125, 1.25, 1}};
  add("large quantized", coarse);
  const auto add_shifts = [&](const char* name, const TestMesh& mesh) {
    files.push_back({name, written(mesh, 1500, ConnectivityCodec::shifts, Level::fast)});
    files.push_back({std::string(name) + ", columns",
                     written(mesh, 1500, ConnectivityCodec::shifts, Level::standard)});
  };
  add_shifts("large shifts", bent_grid(16, 15, 14));
  add_shifts("large shifts, doubles", bent_grid(16, 15, 14, ScalarType::float64));
  add_shifts("large shifts, arrays", with_arrays_of_every_type(bent_grid(9, 9, 9)));
  add_shifts("large shifts, quantized", coarse);
  add_shifts("large shifts, stream", with_order(bent_grid(16, 15, 14), stream, false, 0));
  return files;
}

const std::map<std::string, std::uint64_t> kPinned = {
    {"no_blocks", 0xef46db3751d8e999},
    {"no_cells", 0xef46db3751d8e999},
    {"one_hexahedron", 0x82c0ba770d3a6d54},
    {"keep", 0x3838bd54c52beb6},
    {"keep_delay", 0x92a3c32346b1c7f9},
    {"stream", 0x6f8d0a3b10af7c1f},
    {"stream_turned", 0xe51d3cd6e60fe7d9},
    {"free", 0x6f8d0a3b10af7c1f},
    {"groups", 0xdd0690eed2d8e017},
    {"paper_codec", 0xc1bd2088a18c8189},
    {"paper_codec_stream", 0x8f388faf84ca59fd},
    {"holes", 0xfc8598df95d34ec9},
    {"ring", 0x3156deab60e3d7e1},
    {"mixed_cells", 0xbd5e4c8b64aabc97},
    {"mixed_cells_stream", 0xfa1ae4c0c60b76d5},
    {"every_shape", 0xc6911f72e9cb10ff},
    {"every_shape_stream", 0xdee71e4c49ebbb6c},
    {"every_shape_values", 0xd4254e49f87e170c},
    {"polyhedra", 0xfa2a1ddf054e5a2},
    {"polyhedra_stream", 0x8d6138a206f3089d},
    {"polyhedra_values", 0xe5aca484de86e98b},
    {"second_order", 0x3121e24c5b218f30},
    {"second_order_stream", 0x7e2c26948c69c21d},
    {"degenerate", 0x57bbc60143419e72},
    {"arrays", 0xe1392d6253d3559},
    {"arrays_on_some_blocks", 0x414e9abfa994582a},
    {"tables_for_some", 0x810040f5511ed9a4},
    {"mixed_columns", 0xb410c179365a45c3},
    {"quantized", 0x89c7cddbdf4019e5},
    {"bounded", 0xbb65af725e4d623e},
    {"special_values", 0x38446b225eb53b2b},
    {"replay_keep", 0xd1b97146114196ce},
    {"replay_stream", 0xb3e333dd4dd6df67},
    {"mixed_rows", 0x97afa7a5efc01e8b},
    {"mixed_rows_stream", 0x2ebf948842fb1094},
    {"unmarked", 0xe3ed41edd6dff851},
    {"steps_and_extras", 0x8ff58b002db963f3},
    {"steps_and_extras_stream", 0x11aa7203b148f05f},
    {"steps_that_stand_alone", 0x8ff58b002db963f3},
    {"large_extras", 0x4b7c22f7c4e0fa66},
    {"mirrored", 0x5578daec80f1eff0},
    {"mirrored_best", 0x40ddfb26e1abb5fc},
    {"segments", 0xcf3cb14e3a4f78c3},
    {"segments_stream", 0x84f11afb942b225b},
    {"shifts", 0xfdde396e3c99607c},
    {"shifts_stream", 0x3cdc35600a9b0e01},
    {"shifts_shuffled", 0xbd5fd6a70b52dc13},
    {"shifts_arrays", 0x5ae31a4ae85fc24b},
    {"shifts_quantized", 0x388e2d1ebd5898ff},
    {"shifts_special_values", 0x7d1d27f8278fd000},
    {"shifts_columns", 0xe0314702b735474b},
    {"shifts_columns_arrays", 0x8fe75a8f7abed094},
    {"shifts_mixed_columns", 0x7db29860363a4165},
    {"shifts_steps", 0x5417af3f857b966f},
    {"shifts_columns_quads", 0x1fbbb11576e98cf1},
    {"large grid", 0xf87935cd79b64c35},
    {"large grid, doubles, groups", 0xd8d8dcf961f05dc6},
    {"large grid, shuffled, stream, delay", 0xb7bf530c69805ddb},
    {"large grid, shuffled, keep, delay", 0x7714643221ffc46a},
    {"large holes", 0xb79c225ca1c98e03},
    {"large ring", 0x61db960d8fa540f7},
    {"large segments", 0x5323f6223cb59e60},
    {"large segments, stream", 0xb774f269a62824c8},
    {"large cells of every shape", 0xfae3c3e513f82731},
    {"large cells of every shape, shuffled, stream", 0x1a347ab1e0bda1f3},
    {"large arrays", 0x10f2ea299b2f64f9},
    {"large quantized", 0xe02f5e8c1a4cf696},
    {"large shifts", 0x70646aa20837c932},
    {"large shifts, columns", 0x991d96fbbd1ef9bf},
    {"large shifts, doubles", 0x43183d7eebdf0479},
    {"large shifts, doubles, columns", 0x47bc819b8f444c2b},
    {"large shifts, arrays", 0x5b1e36c248a32050},
    {"large shifts, arrays, columns", 0x77c98f9e8e0bb500},
    {"large shifts, quantized", 0x57dbd007b3d96716},
    {"large shifts, quantized, columns", 0x152a487313fd8ce8},
    {"large shifts, stream", 0x2676111163dde04e},
    {"large shifts, stream, columns", 0x4776caf0bfa6bcab},
};

std::vector<FeatureFile> all_files() {
  auto files = feature_files();
  for (FeatureFile& file : larger_files()) files.push_back(std::move(file));
  return files;
}

TEST(Determinism, PinnedHashes) {
  const auto files = all_files();
  bool same = files.size() == kPinned.size();
  for (const FeatureFile& file : files) {
    const auto pinned = kPinned.find(file.name);
    same = same && pinned != kPinned.end() && pinned->second == hash_of(file.bytes);
    EXPECT_TRUE(pinned != kPinned.end() && pinned->second == hash_of(file.bytes))
        << file.name << ": " << file.bytes.size() << " bytes";
  }
  if (same) return;
  std::printf("const std::map<std::string, std::uint64_t> kPinned = {\n");
  for (const FeatureFile& file : files) {
    char digits[17] = {};
    std::to_chars(digits, digits + 16, hash_of(file.bytes), 16);
    std::printf("    {\"%s\", 0x%s},\n", file.name.c_str(), digits);
  }
  std::printf("};\n");
}

TEST(Determinism, TwoThreads) {
  const auto first = all_files();
  writer_threads = 2;
  const auto second = all_files();
  writer_threads = 1;
  for (std::size_t i = 0; i < first.size(); ++i)
    EXPECT_EQ(first[i].bytes, second[i].bytes) << first[i].name;
}

TEST(Determinism, TwiceInOneProcess) {
  const auto first = feature_files(), second = feature_files();
  for (std::size_t i = 0; i < first.size(); ++i)
    EXPECT_EQ(first[i].bytes, second[i].bytes) << first[i].name;
}

}  // namespace
}  // namespace shm
