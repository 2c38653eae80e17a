// Checks that the same input results in the same mesh groups on every machine, with every compiler,
// and in every version, unless the coders are changed on purpose. The test runs under g++ -O0, -O1
// and -O3 (presets same-gcc-O0, tsan, release) and clang -O1 and -O3 (dev, same-clang-O3), with one
// thread and with two. On a mismatch it prints the new table. If the change is intended, this table
// replaces the old table, and the commit states which stream became smaller or larger. Data
// compressed with zstd (schema, extras, steps) may depend on the version of zstd, so the test does
// not compare it. For groups coded as shifts or patterns, the test compares the data before zstd
// compresses it.
#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdio>
#include <map>
#include <string>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/shared/codec_id.h"
#include "codecs/surface/mesh_streams.h"
#include "support/feature_files.h"
#include "support/file_surgery.h"

namespace shm {
namespace {

/// Returns the stream with the zstd frame at its end replaced by the unpacked contents of the
/// frame.
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

/// Returns a stream of byte planes, with each packed plane replaced by its unpacked contents.
std::vector<std::byte> with_planes_unpacked(const std::vector<std::byte>& stream) {
  constexpr std::array kMagic = {std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f},
                                 std::byte{0xfd}};
  ByteWriter all;
  auto from = stream.begin();
  while (true) {
    const auto frame = std::search(from, stream.end(), kMagic.begin(), kMagic.end());
    const auto left = std::span(frame, stream.end());
    const std::size_t size =
        left.empty() ? 0 : ZSTD_findFrameCompressedSize(left.data(), left.size());
    ByteWriter length;
    length.put_varint(size);
    const auto behind = std::span(from, frame);
    const bool is_plane = size > 0 && ZSTD_isError(size) == 0 &&
                          behind.size() >= length.bytes.size() &&
                          std::equal(length.bytes.begin(), length.bytes.end(),
                                     behind.last(length.bytes.size()).begin());
    if (!is_plane) {
      const auto end = left.empty() ? frame : frame + 1;
      all.put_bytes(std::span(from, end));
      if (left.empty()) return std::move(all.bytes);
      from = end;
      continue;
    }
    const auto content =
        zstd_decompress(left.first(size), ZSTD_getFrameContentSize(left.data(), size));
    EXPECT_TRUE(content.has_value());
    all.put_bytes(behind.first(behind.size() - length.bytes.size()));
    if (content) {
      all.put_varint(content->size());
      all.put_bytes(*content);
    }
    from = frame + static_cast<std::ptrdiff_t>(size);
  }
}

/// Removes the coded special values from the streams of a group. Returns them, unpacked.
std::vector<std::byte> take_special_values(GroupParts& group) {
  std::vector<std::byte> all;
  for (std::size_t s = 0; s < group.streams.size(); ++s) {
    Codec& codec = group.header.streams[s].codec;
    if (!has_special_values(codec)) continue;
    ByteReader in(group.streams[s]);
    ByteReader head(in.get_bytes(in.get_varint()));
    const auto special = get_packed(head, 1 << 20);
    EXPECT_TRUE(special);
    if (special) all.insert(all.end(), special->begin(), special->end());
    const auto rest = in.get_bytes(in.left());
    group.streams[s] = std::vector<std::byte>(rest.begin(), rest.end());
    codec = without_special_values(codec);
  }
  return all;
}

std::uint64_t hash_of(const std::vector<std::byte>& file) {
  std::vector<std::byte> groups;
  for (const Chunk& chunk : take_apart(file).chunks) {
    if (!chunk.is(container::ChunkKind::group)) continue;
    auto group = take_group_apart(chunk.payload);
    if (group) {
      const auto special = take_special_values(*group);
      groups.insert(groups.end(), special.begin(), special.end());
    }
    if (group && !group->streams.empty() &&
        group->header.streams[0].codec == container::Codec::shifts)
      for (std::size_t s = 0; s < group->streams.size(); ++s)
        if (group->header.streams[s].kind != container::StreamKind::vertex_numbers &&
            !is_predicted(group->header.streams[s].codec))
          group->streams[s] = unpacked(group->streams[s]);
    if (group && !group->streams.empty() &&
        group->header.streams[0].codec == container::Codec::patterns)
      for (std::size_t s = 0; s < group->streams.size(); ++s)
        group->streams[s] = group->header.streams[s].codec == container::Codec::shuffled_zstd
                                ? unpacked(group->streams[s])
                                : with_planes_unpacked(group->streams[s]);
    const auto bytes = group ? put_group_together(std::move(*group)) : chunk.payload;
    groups.insert(groups.end(), bytes.begin(), bytes.end());
  }
  return XXH64(groups.data(), groups.size(), 0);
}

/// Returns layers of hexahedra, wedges, pyramids and tetrahedra, with triangles on top.
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

/// Returns the next value of an array. The kind of values changes every 5000 elements: smooth,
/// random, constant, a repetition of earlier values, or smooth with outliers. The changes force the
/// encoder to switch predictors.
double changing_value(std::vector<double>& values, PlainRandom& random) {
  const std::size_t i = values.size();
  const auto x = static_cast<double>(i % 5000) / 4096;
  double value = x * (1 - x) * 100;
  switch (i / 5000 % 5) {
    case 1: value = static_cast<double>(random.below(1 << 20)) / 1024; break;
    case 2: value = 17.25; break;
    case 3: value = values[i - 4000 - random.below(3)]; break;
    case 4: value += random.below(50) == 0 ? 1e5 : 0; break;
    default: break;
  }
  values.push_back(value);
  return value;
}

/// Returns a grid of more than 40,000 cells with arrays of doubles, floats and integers (see
/// changing_value), and a copy of the first array with small differences.
TestMesh changing_arrays() {
  TestMesh mesh = bent_grid(36, 35, 33, ScalarType::float64);
  PlainRandom random(11);
  const auto add = [&](const char* name, ScalarType type, auto value_of) {
    mesh.schema.arrays.push_back(array_of(name, Location::cell, type));
    std::vector<std::byte> bytes;
    std::vector<double> values;
    for (std::size_t c = 0; c < mesh.cells.size(); ++c)
      append(bytes, value_of(changing_value(values, random)));
    mesh.arrays.push_back(std::move(bytes));
  };
  add("doubles", ScalarType::float64, [](double value) { return value; });
  add("floats", ScalarType::float32, [](double value) { return static_cast<float>(value / 3); });
  add("integers", ScalarType::int32, [](double value) { return static_cast<std::int32_t>(value); });
  add("multiples", ScalarType::float64,
      [](double value) { return .001 * static_cast<int>(value); });
  mesh.schema.arrays.push_back(array_of("near the doubles", Location::cell, ScalarType::float64));
  std::vector<std::byte> near = mesh.arrays[0];
  constexpr std::size_t kLowByte = std::endian::native == std::endian::little ? 0 : 7;
  for (std::size_t i = kLowByte; i < near.size(); i += 8 * (1 + random.below(20)))
    near[i] ^= std::byte{1};
  mesh.arrays.push_back(std::move(near));
  return mesh;
}

/// Returns files that are larger than the feature files. They have several groups, enough vertices
/// for slots of finalized vertices to be reused, and enough data for adaptive models to adapt.
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
  const TestMesh changing = changing_arrays();
  add("changing arrays", changing);
  files.push_back(
      {"changing arrays, best", written(changing, 65536, ConnectivityCodec::mixed, Level::best)});
  files.push_back({"changing arrays, shifts",
                   written(changing, 65536, ConnectivityCodec::shifts, Level::standard)});
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
  const auto add_patterns = [&](const char* name, const TestMesh& mesh) {
    files.push_back({name, written(mesh, 1500, ConnectivityCodec::patterns, Level::fast)});
  };
  add_patterns("large patterns", shuffled(bent_grid(16, 15, 14)));
  add_patterns("large patterns, arrays", with_arrays_of_every_type(bent_grid(9, 9, 9)));
  add_patterns("large patterns, quantized", coarse);
  add_patterns("large patterns, stream",
               with_order(bent_grid(16, 15, 14, ScalarType::float64), stream, false, 0));
  return files;
}

const std::map<std::string, std::uint64_t> kPinned = {
    {"no_blocks", 0xef46db3751d8e999},
    {"no_cells", 0xef46db3751d8e999},
    {"one_hexahedron", 0xfb1f930b48a3053e},
    {"keep", 0xb0361c30346ba5f5},
    {"keep_delay", 0x91febe9b19f527ab},
    {"stream", 0x9884cdaf6f1afae3},
    {"stream_turned", 0xb804cf986c940069},
    {"free", 0x9884cdaf6f1afae3},
    {"groups", 0x3c46a13c7857948},
    {"paper_codec", 0x33eb543e77f35dc0},
    {"paper_codec_stream", 0x4d0af516f08d53ae},
    {"holes", 0x56d3c98c531d1d98},
    {"ring", 0x2d3e9629506473be},
    {"mixed_cells", 0x937cf14b48590a01},
    {"mixed_cells_stream", 0x190ff046227c5290},
    {"every_shape", 0x224409722a3719a3},
    {"every_shape_stream", 0xa18f4bb9a19f9466},
    {"every_shape_values", 0x22cda4c98be660d2},
    {"polyhedra", 0x457f1b1eaadea2cf},
    {"polyhedra_stream", 0xa8bc2cd0ccab751a},
    {"polyhedra_values", 0x42c17eeb88adda88},
    {"second_order", 0x8595f58e92127716},
    {"second_order_stream", 0x7dd2c91b80993d63},
    {"degenerate", 0xa88e9cc480a90d58},
    {"arrays", 0xa7e13719ddfdf345},
    {"arrays_on_some_blocks", 0xb70fd8c66ddf7944},
    {"tables_for_some", 0xc0232e6bb78c0923},
    {"mixed_columns", 0x14458dd5ed6f036d},
    {"quantized", 0x6182f441af8a9489},
    {"bounded", 0x3aa136a39555928f},
    {"special_values", 0x3a5a87b7f5a4d79d},
    {"replay_keep", 0xb9909ad329f54142},
    {"replay_stream", 0x5d0ae3f2ed181b1c},
    {"replay_strays", 0xb3db8ea03f3162bb},
    {"replay_strays_stream", 0x3ae3d48d9a167795},
    {"mixed_rows", 0x3dc57dd34ec6b72d},
    {"mixed_rows_stream", 0xc8f2ed3caee7f9b4},
    {"unmarked", 0x1d1c578e36fd0952},
    {"steps_and_extras", 0x342b986554a9127a},
    {"steps_and_extras_stream", 0x5481c24f20ab7830},
    {"steps_that_stand_alone", 0x342b986554a9127a},
    {"bundles", 0x5dcb1e765cfc909f},
    {"bundles_stream", 0x925b3acbb82e269b},
    {"bundles_scaled", 0x5dcb1e765cfc909f},
    {"bounded_steps", 0x1381e0e8a2dbe5cf},
    {"bounded_steps_best", 0xd4e82e4abab00552},
    {"bounded_steps_fast", 0x95a1d77e227a89f3},
    {"filled", 0x5931f92c91d599e5},
    {"filled_stream", 0xe708aeb82bdb3c44},
    {"filled_patterns", 0xff36fd1e23d1d7be},
    {"filled_shifts", 0xb43fb96b084af882},
    {"filled_steps", 0x8417f74a8f2ae0bf},
    {"filled_steps_best", 0xa04cfc5d81897ce9},
    {"filled_steps_fast", 0xfa26f78945a7d24a},
    {"filled_bundles", 0x93e59c7741062c9d},
    {"large_extras", 0x6a1c8cdbdc918f57},
    {"mirrored", 0xea96b028ae07c0e1},
    {"mirrored_best", 0x2cb53ca5faa5a104},
    {"broken", 0x91f1de91b4c4333c},
    {"broken_stream", 0x18585c5b056f1ae4},
    {"broken_shapes", 0x55850448ef9b0b55},
    {"shifts_broken", 0x4581c486927b001f},
    {"segments", 0xb1c7088764fbe208},
    {"segments_stream", 0x36bbb6d6220a91c},
    {"shifts", 0x435d72cc870d39e8},
    {"shifts_stream", 0x2ba7ead486e7b3a6},
    {"shifts_shuffled", 0x5c3d3fd9242dc700},
    {"shifts_arrays", 0xa9fb5a2379928a59},
    {"shifts_quantized", 0xad52bf2474669079},
    {"shifts_special_values", 0x8fdc01ddeb945c21},
    {"shifts_columns", 0x491a2d4b353c94b4},
    {"shifts_columns_arrays", 0x3a8742b2c9b134aa},
    {"shifts_mixed_columns", 0xa22e1539b30076ff},
    {"shifts_steps", 0x92d0ddb42cc7f9ba},
    {"shifts_columns_quads", 0x27bb2befeb7757f9},
    {"patterns", 0x46aed81a1e8009a8},
    {"patterns_stream", 0xb13efb8dc3e92a6f},
    {"patterns_shuffled", 0xb07e565be2c66806},
    {"patterns_shapes", 0xdcc6769c1b56e46b},
    {"patterns_second_order", 0x7bebb87a21842287},
    {"patterns_broken", 0x3bb011e2d98714a8},
    {"patterns_arrays", 0x1a824be5ff6fbd6f},
    {"patterns_quantized", 0xaee46e31077776b0},
    {"patterns_special_values", 0x7a85327b38876c5a},
    {"patterns_steps", 0xf27afdd8708d476c},
    {"patterns_steps_that_rise", 0x95a1d77e227a89f3},
    {"large grid", 0x80ad87b812a8e379},
    {"large grid, doubles, groups", 0x1ff7c8f795d14727},
    {"large grid, shuffled, stream, delay", 0xdd1a4800814c9110},
    {"large grid, shuffled, keep, delay", 0x6da1070f89994c23},
    {"large holes", 0x5d770a872f762dd0},
    {"large ring", 0x471800edbffe6cb1},
    {"large segments", 0xed857f184232ae9b},
    {"large segments, stream", 0x4035e5fd540d5eb7},
    {"large cells of every shape", 0x2a25243cdda5e102},
    {"large cells of every shape, shuffled, stream", 0xae1e9041cb528f48},
    {"large arrays", 0xe6500c091f66db58},
    {"large quantized", 0xa850924381991e84},
    {"changing arrays", 0x873e3d2f4b956bff},
    {"changing arrays, best", 0x96f4f9a8c9684200},
    {"changing arrays, shifts", 0x63c6576d54821bd3},
    {"large shifts", 0xf2245624c3514831},
    {"large shifts, columns", 0x9d70412e4a9e3aa0},
    {"large shifts, doubles", 0xad6902223a7e758},
    {"large shifts, doubles, columns", 0xd1358f30fc18868a},
    {"large shifts, arrays", 0x78212c67be3fdbf7},
    {"large shifts, arrays, columns", 0x60ab5c5815c7d146},
    {"large shifts, quantized", 0xb6a080958f4850f1},
    {"large shifts, quantized, columns", 0x4dd56d18d7425178},
    {"large shifts, stream", 0x884dbf7bfa267dae},
    {"large shifts, stream, columns", 0x1bcac5cdeb6cb79f},
    {"large patterns", 0x57130514b8b9e08b},
    {"large patterns, arrays", 0x49942aa6058001b1},
    {"large patterns, quantized", 0xa35b20ffbdf23203},
    {"large patterns, stream", 0xa7f0d786f02dc5e3},
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
