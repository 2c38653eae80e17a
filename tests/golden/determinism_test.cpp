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
#include "bytes/packing.h"
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
    {"one_hexahedron", 0x54c9763607bb1822},
    {"keep", 0xadd1a71eabf3ec39},
    {"keep_delay", 0x9c3b58d9cf78a4ab},
    {"stream", 0x2b3378cf7d545b6},
    {"stream_turned", 0xf6f176b0ce275cd9},
    {"free", 0x2b3378cf7d545b6},
    {"groups", 0xaa59d7b4dbf50423},
    {"paper_codec", 0x30516211b596d908},
    {"paper_codec_stream", 0xd1b6b238e12007a0},
    {"holes", 0x3ae6196487263619},
    {"ring", 0xf77747a2963b9d52},
    {"mixed_cells", 0x335386c1fed68130},
    {"mixed_cells_stream", 0x7580992a2f82eefa},
    {"every_shape", 0xca9117ea40c616ab},
    {"every_shape_stream", 0xcd4aaba6356bf91b},
    {"every_shape_values", 0xfa61ecfab53c9cd1},
    {"polyhedra", 0x7236118257201f7},
    {"polyhedra_stream", 0x2ed77b9c12c60bcc},
    {"polyhedra_values", 0x4cebf418fa6766d2},
    {"second_order", 0x1f318f5395f9ad4f},
    {"second_order_stream", 0xe6219f89dcbfef0e},
    {"degenerate", 0x4770abc70bab46e7},
    {"arrays", 0x6759d3d1cfe1960d},
    {"arrays_on_some_blocks", 0x9188d32380320068},
    {"tables_for_some", 0xe6599a860738c4c0},
    {"mixed_columns", 0x64b1e657d63de4cb},
    {"quantized", 0x6182f441af8a9489},
    {"bounded", 0x1f6b572ae4c25eba},
    {"special_values", 0x9b57a64364caf664},
    {"replay_keep", 0x437023045788f47},
    {"replay_stream", 0x9f5faffffad3145d},
    {"mixed_rows", 0x4f4eea7b34092177},
    {"mixed_rows_stream", 0x61671c72d3b87cf9},
    {"unmarked", 0xd3e88d5039228537},
    {"steps_and_extras", 0xc698ebc985540e51},
    {"steps_and_extras_stream", 0xbcc713687adc4bea},
    {"steps_that_stand_alone", 0xc698ebc985540e51},
    {"large_extras", 0xa1de3bf08490df7f},
    {"mirrored", 0xd4f6f1f62a83d6d0},
    {"mirrored_best", 0xa407b6ff6af0c758},
    {"segments", 0xad6af24750e76f98},
    {"segments_stream", 0x77505535213cd3b5},
    {"shifts", 0x435d72cc870d39e8},
    {"shifts_stream", 0x2ba7ead486e7b3a6},
    {"shifts_shuffled", 0x5c3d3fd9242dc700},
    {"shifts_arrays", 0xa9fb5a2379928a59},
    {"shifts_quantized", 0xad52bf2474669079},
    {"shifts_special_values", 0x8fdc01ddeb945c21},
    {"shifts_columns", 0x9df0c999eec8490f},
    {"shifts_columns_arrays", 0x3da22400382be554},
    {"shifts_mixed_columns", 0x3c1abc6c43d06cab},
    {"shifts_steps", 0x527bfaa06177cd42},
    {"shifts_columns_quads", 0x419146dc92b5a49b},
    {"large grid", 0x8fc6e2cb284a8268},
    {"large grid, doubles, groups", 0x45224565a0abfa8e},
    {"large grid, shuffled, stream, delay", 0x854f6551347c2f06},
    {"large grid, shuffled, keep, delay", 0xb51ee0d0806e04cd},
    {"large holes", 0xc36dce1fec53a948},
    {"large ring", 0x312d0d0bb265effe},
    {"large segments", 0xad5c0c985050a657},
    {"large segments, stream", 0x19eea7e4be38750e},
    {"large cells of every shape", 0xed743d36e3e715f3},
    {"large cells of every shape, shuffled, stream", 0xa0befc8683ff6363},
    {"large arrays", 0xf043f6e06dd53296},
    {"large quantized", 0x7a8fe130245e18d2},
    {"large shifts", 0xf2245624c3514831},
    {"large shifts, columns", 0xa0f26466bd6a9a07},
    {"large shifts, doubles", 0xad6902223a7e758},
    {"large shifts, doubles, columns", 0xcccfdca91a61bcf1},
    {"large shifts, arrays", 0x78212c67be3fdbf7},
    {"large shifts, arrays, columns", 0x9017f3e019d97679},
    {"large shifts, quantized", 0xb6a080958f4850f1},
    {"large shifts, quantized, columns", 0x2d424f01eacb5aa0},
    {"large shifts, stream", 0x884dbf7bfa267dae},
    {"large shifts, stream, columns", 0x78bf928f4a67d0d8},
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
