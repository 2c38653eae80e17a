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
    {"one_hexahedron", 0xa40bb6da4edd6600},
    {"keep", 0xb0c43e868301c59b},
    {"keep_delay", 0x1aaf952680d25242},
    {"stream", 0x94282eee4a00d7fd},
    {"stream_turned", 0x2ea3b007f7f799a7},
    {"free", 0x94282eee4a00d7fd},
    {"groups", 0xea94e3fc4de6608},
    {"paper_codec", 0xb55b7f012f9bc6a0},
    {"paper_codec_stream", 0x9d337adc08605a28},
    {"holes", 0x55ea9748a5714aaf},
    {"ring", 0x3f2cb247e9f9bb07},
    {"mixed_cells", 0xb6f53053c9814df8},
    {"mixed_cells_stream", 0xd0190b46bb48b22b},
    {"every_shape", 0x8299aa23bbf4a413},
    {"every_shape_stream", 0x2d5e6fe53c67f79},
    {"every_shape_values", 0x2b74d4da169be8aa},
    {"polyhedra", 0x2271a2a7accd2338},
    {"polyhedra_stream", 0x9ce960204a90334d},
    {"polyhedra_values", 0x4397a208126330da},
    {"second_order", 0xad0feb248dad8f12},
    {"second_order_stream", 0x5146081a86a03f89},
    {"degenerate", 0xaa04297c3198aa8d},
    {"arrays", 0x796272734f877214},
    {"arrays_on_some_blocks", 0x607d5bb9ae0f6546},
    {"tables_for_some", 0xddfd7a3d8e403f3f},
    {"mixed_columns", 0x635d21262ccf99d5},
    {"quantized", 0x2749c2f1bda57242},
    {"bounded", 0x296ebeead02ef3e1},
    {"special_values", 0x4d23be2df8d0ee00},
    {"replay_keep", 0x8cf9e4171826478},
    {"replay_stream", 0x4e19d159149e322a},
    {"mixed_rows", 0x864d117f72bfec09},
    {"mixed_rows_stream", 0x2132fafbaf7bd7ac},
    {"unmarked", 0x801964953f4bb354},
    {"steps_and_extras", 0x8e8ed124c28573ea},
    {"steps_and_extras_stream", 0xea4b1233bb25e61f},
    {"steps_that_stand_alone", 0x8e8ed124c28573ea},
    {"large_extras", 0x8762ce8076701951},
    {"mirrored", 0x946b8aa9294cca89},
    {"mirrored_best", 0x8f2962d1e89391b9},
    {"segments", 0x3c98148fbb7d124d},
    {"segments_stream", 0x2ed342dc194c81d7},
    {"shifts", 0xbe9398d4e5300296},
    {"shifts_stream", 0x411f36b873ef8a5a},
    {"shifts_shuffled", 0xf15ef79d82c45818},
    {"shifts_arrays", 0x6d39ec8ac8e955b},
    {"shifts_quantized", 0xccb2d6fa8c3ad0b5},
    {"shifts_special_values", 0x289ce5c4d1c70c8f},
    {"shifts_columns", 0x969ce5fb17c609f4},
    {"shifts_columns_arrays", 0x30bb989e3436655a},
    {"shifts_mixed_columns", 0x278b4bd630eb6d64},
    {"shifts_steps", 0xc11c5c8b0e850359},
    {"shifts_columns_quads", 0xc3433d72a5d555c8},
    {"large grid", 0x2e99afdf3593bb68},
    {"large grid, doubles, groups", 0xc5fd3a464a4bbc28},
    {"large grid, shuffled, stream, delay", 0x94fe13ee999e08cb},
    {"large grid, shuffled, keep, delay", 0xb39dd362f13fe150},
    {"large holes", 0x785f4441a060542a},
    {"large ring", 0x26533f7762593612},
    {"large segments", 0x8d23830ea664eaab},
    {"large segments, stream", 0x3b1d6929198c9057},
    {"large cells of every shape", 0x1db4e446573feaba},
    {"large cells of every shape, shuffled, stream", 0xb39c857677be9c57},
    {"large arrays", 0x4a83fafdb786dd0d},
    {"large quantized", 0x17f8d3c9830e8ab9},
    {"large shifts", 0x23f9b746bb4ffc23},
    {"large shifts, columns", 0xc07d7c7457b1daea},
    {"large shifts, doubles", 0xede0371053bd2646},
    {"large shifts, doubles, columns", 0x9f03e31b75713602},
    {"large shifts, arrays", 0x98a93ffd62b99f66},
    {"large shifts, arrays, columns", 0xaebfdc0e5a79305d},
    {"large shifts, quantized", 0x7b4b92e110125f07},
    {"large shifts, quantized, columns", 0x22345d704e39f196},
    {"large shifts, stream", 0xb6b500b858437c2a},
    {"large shifts, stream, columns", 0x96b3cf14a8a0c764},
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
