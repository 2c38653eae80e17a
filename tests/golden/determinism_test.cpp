// Checks that the same input results in the same mesh groups on every machine, with every compiler,
// and in every version, unless the coders are changed on purpose. The test runs under g++ -O0, -O1
// and -O3 (presets same-gcc-O0, tsan, release) and clang -O1 and -O3 (dev, same-clang-O3), with one
// thread and with two. On a mismatch it prints the new table. If the change is intended, this table
// replaces the old table, and the commit states which stream became smaller or larger. Data
// compressed with zstd (schema, extras, steps) may depend on the version of zstd. The first hash of
// a file therefore covers only its mesh groups; if they are coded as shifts or patterns, it covers
// the data before zstd compresses it. The second hash covers the whole file. It is compared only if
// the version of zstd is kZstdOfPins.
#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cinttypes>
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
    auto group = take_group_apart(chunk);
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

/// Pinned hashes of a file (see the comment at the top).
struct Pins {
  std::uint64_t groups, file;
  bool operator==(const Pins&) const = default;
};
constexpr unsigned kZstdOfPins = 10504;

Pins pins_of(const std::vector<std::byte>& file) {
  return {hash_of(file), XXH64(file.data(), file.size(), 0)};
}

const std::map<std::string, Pins> kPinned = {
    {"no_blocks", {0xef46db3751d8e999, 0x04ae70a63324643f}},
    {"no_cells", {0xef46db3751d8e999, 0x81809021789f174d}},
    {"one_hexahedron", {0xfb1f930b48a3053e, 0x73ac71224a53df3b}},
    {"keep", {0xb0361c30346ba5f5, 0x6113e57c30f8178d}},
    {"keep_delay", {0x91febe9b19f527ab, 0x342f4abaa1a1e8a0}},
    {"stream", {0x9884cdaf6f1afae3, 0xb8dc10de935886f7}},
    {"stream_turned", {0xb804cf986c940069, 0x0b2b887439001732}},
    {"free", {0x9884cdaf6f1afae3, 0x477c6aeb116c3aee}},
    {"groups", {0x03c46a13c7857948, 0x77cbd771dcdfaa9f}},
    {"paper_codec", {0x33eb543e77f35dc0, 0x7766e30b22d7a621}},
    {"paper_codec_stream", {0x4d0af516f08d53ae, 0xa0514cf43c5d63c6}},
    {"holes", {0x56d3c98c531d1d98, 0x401bf752faacabbb}},
    {"ring", {0x2d3e9629506473be, 0x94f1ead2a68e9fcb}},
    {"mixed_cells", {0x937cf14b48590a01, 0x4e2966107082a69d}},
    {"mixed_cells_stream", {0x190ff046227c5290, 0xa6aa9d733f57e745}},
    {"every_shape", {0x224409722a3719a3, 0x7b129f602904debb}},
    {"every_shape_stream", {0xa18f4bb9a19f9466, 0xe1f1fa77d8f2a4df}},
    {"every_shape_values", {0xb171fc7f7459fc55, 0x32a4acb37fc723ae}},
    {"polyhedra", {0x457f1b1eaadea2cf, 0x902540f2ccaa72e8}},
    {"polyhedra_stream", {0xa8bc2cd0ccab751a, 0xca28faf60b16565c}},
    {"polyhedra_values", {0x42c17eeb88adda88, 0xc90cc7e33b5aff0d}},
    {"second_order", {0x8595f58e92127716, 0x6a33623c1c1463a2}},
    {"second_order_stream", {0x7dd2c91b80993d63, 0xe5e2f68815626070}},
    {"grid_nodes", {0xcefe632f3db8c673, 0xe7e8aa479fa3fbb8}},
    {"high_order", {0x2aff2e9bfbf73a98, 0xeeffcff66dfbc2ac}},
    {"grid_nodes_stream", {0x05bc29dc20091d4f, 0xd22f4a2877737b02}},
    {"degenerate", {0xa88e9cc480a90d58, 0x7e54d8363e7d2b91}},
    {"arrays", {0xa7e13719ddfdf345, 0x8f1976465b08b40c}},
    {"arrays_on_some_blocks", {0xb70fd8c66ddf7944, 0x1f7aed241285f7d2}},
    {"tables_for_some", {0x0ff2ff990ad7053d, 0xb9707486928de60a}},
    {"mixed_columns", {0x3f48030b0dabe3b3, 0xb0d9c725ce84c70e}},
    {"quantized", {0x6182f441af8a9489, 0x963aa51cca30f7d4}},
    {"bounded", {0x71ac560a7fbf33bf, 0x3ee46d7c35bdc76a}},
    {"special_values", {0x3a5a87b7f5a4d79d, 0xeccf994ed6d5556e}},
    {"replay_keep", {0xb9909ad329f54142, 0x656bbcebf79b5fe3}},
    {"replay_stream", {0x5d0ae3f2ed181b1c, 0xcaad2ae04dfdbb62}},
    {"replay_strays", {0xb3db8ea03f3162bb, 0x20cdcf1d1fbb2157}},
    {"replay_strays_stream", {0x3ae3d48d9a167795, 0x432115884c608e84}},
    {"mixed_rows", {0x3dc57dd34ec6b72d, 0x53e7159022c1d18e}},
    {"mixed_rows_stream", {0xc8f2ed3caee7f9b4, 0xffc9a56d87df12d6}},
    {"unmarked", {0x7d67d44faec70011, 0x56ea0cc4acfaf09d}},
    {"steps_and_extras", {0x89dd4626093caaa6, 0xb3170a8fdc2fa4e9}},
    {"steps_and_extras_stream", {0xd58eb87cfc9acde1, 0x2e85804168ab97c1}},
    {"steps_that_stand_alone", {0x89dd4626093caaa6, 0x86fd76e040d31de2}},
    {"bundles", {0x2ba00a27aa7cd624, 0xb5e1243d5e842fdd}},
    {"bundles_stream", {0xd2fd355c4c47f1fc, 0x94f0c017aa44114f}},
    {"bundles_scaled", {0x2ba00a27aa7cd624, 0xa039b92d0ffb7f97}},
    {"bounded_steps", {0xb8bdce34f64ef121, 0x61ab12842867b0f8}},
    {"bounded_steps_best", {0xd4e82e4abab00552, 0x653ff8134b88fdbf}},
    {"bounded_steps_fast", {0xce42e9e78462e39c, 0xdc9e2f159fef3cc1}},
    {"filled", {0x5931f92c91d599e5, 0x4c6f8fa21f76bd70}},
    {"filled_stream", {0xe708aeb82bdb3c44, 0x8f61a3bd6267d362}},
    {"filled_patterns", {0xe815b7df808cc83a, 0x4076cd6f35b7673a}},
    {"filled_shifts", {0x60650d59ef90e843, 0x847c6dd157ea2dd8}},
    {"filled_steps", {0x4ce001f5877ed423, 0xa0ddaf933ce6198f}},
    {"filled_steps_best", {0xa04cfc5d81897ce9, 0x9c4e9e5a4f72244d}},
    {"filled_steps_fast", {0x2f8045e8bc28c4ad, 0x42f13c92b2cfd5af}},
    {"filled_bundles", {0x098b123e2dd4f9e5, 0x17315162fc6263e4}},
    {"weighted_steps", {0x60cfa1e9ece8cab8, 0x53720b770e3a7327}},
    {"weighted_mirrored", {0x178826c1bb261e13, 0x27d07e13ab349acf}},
    {"weighted_history", {0x32cdecceeb4bfd7d, 0x81f21d133258836a}},
    {"step_times", {0x8a5f548d1c84bb7f, 0x399ab10cbe8c1fdd}},
    {"tensors", {0x361a7d956b68d67a, 0x87001055497dd793}},
    {"tensors_best", {0x1613dd882f85f97c, 0xef0e4d3b2482a406}},
    {"tensors_shifts", {0x1e019a7a604c89fa, 0xe6d2076d9a7abd99}},
    {"tensors_patterns", {0x12c0e6c1e959aa60, 0x7da3a865a0f6ab7f}},
    {"tensor_steps", {0x155332815089df2b, 0x2599f341d1618738}},
    {"tensor_steps_best", {0x473819631c79b5e0, 0x2befa7bb7a341fa0}},
    {"tensor_steps_fast", {0x041503fbcd403625, 0x146d10a9c45353df}},
    {"steps_on_bases", {0xb60e91b9dfa2bfa5, 0xd3a2315e98bd08b3}},
    {"steps_on_bases_fast", {0xf14547ea337a8e33, 0xa85704bbe5e0ba0c}},
    {"steps_beside_mesh", {0xfe7d90ba08e738a1, 0x3e9cf5be254bc443}},
    {"steps_beside_mesh_fast", {0xea150241796eebf4, 0x471cfb2b49cd6dff}},
    {"steps_beside_mesh_bundles", {0x9ea09127a379c131, 0xd533668e81da7607}},
    {"relative_steps", {0x155332815089df2b, 0x3be2000f0e87c4cc}},
    {"relative_steps_best", {0x473819631c79b5e0, 0xa3d2625ee51e2237}},
    {"relative_steps_fast", {0x041503fbcd403625, 0x359ee94e3ab3e0fe}},
    {"relative_bundles", {0xf77b2403934dbb29, 0x5a38eca7085365cd}},
    {"relative", {0xf01885626b044277, 0x5a3bf36cd9a896d9}},
    {"relative_best", {0x67f10d8f301a25e0, 0xa69c02ca02133a5c}},
    {"relative_shifts", {0x259571764ff985e0, 0x95117c8eb3f5d730}},
    {"relative_patterns", {0x8502d3e0720066b7, 0xbc29d8586dde23cc}},
    {"large_extras", {0x9db655f5913473fa, 0xad0e70f689cd0cc8}},
    {"mirrored", {0xea96b028ae07c0e1, 0xa7f8c302721008e7}},
    {"mirrored_best", {0x2cb53ca5faa5a104, 0x59369273d9dbe2ea}},
    {"broken", {0x91f1de91b4c4333c, 0xbc5dd82c42a73fba}},
    {"broken_stream", {0x18585c5b056f1ae4, 0xf18203a44f3014de}},
    {"broken_shapes", {0x55850448ef9b0b55, 0x78dda528715866b4}},
    {"shifts_broken", {0x4581c486927b001f, 0x1a5e2886d4a965d2}},
    {"segments", {0xb1c7088764fbe208, 0xf6e65e70b0fd6b41}},
    {"segments_stream", {0x036bbb6d6220a91c, 0x5bff7f4c078700d7}},
    {"shifts", {0x435d72cc870d39e8, 0x69e08761af4fc11e}},
    {"shifts_stream", {0x2ba7ead486e7b3a6, 0xb10aa2f805517a51}},
    {"shifts_shuffled", {0x5c3d3fd9242dc700, 0x1575b9fe0f68ca25}},
    {"shifts_arrays", {0xa9fb5a2379928a59, 0xe8f502b469dfed61}},
    {"shifts_quantized", {0xad52bf2474669079, 0x46e844e8342b58de}},
    {"shifts_special_values", {0x8fdc01ddeb945c21, 0x2322c2d936bd3f0a}},
    {"shifts_columns", {0x491a2d4b353c94b4, 0xd17049befeba751e}},
    {"shifts_columns_arrays", {0x3a8742b2c9b134aa, 0xe48da0fac86c125b}},
    {"shifts_mixed_columns", {0x404bddb7b7312bc7, 0x717c1f91d423a0a4}},
    {"shifts_steps", {0x92d0ddb42cc7f9ba, 0x0af0c0beb033fd70}},
    {"shifts_columns_quads", {0x27bb2befeb7757f9, 0xfb5ae13efe2a67f3}},
    {"patterns", {0x46aed81a1e8009a8, 0x9afdab2a7fe526ea}},
    {"patterns_stream", {0xaedf5d5a0c9d06c9, 0xda6f7da402199116}},
    {"patterns_shuffled", {0xb07e565be2c66806, 0x5ca5104de9293d68}},
    {"patterns_shapes", {0xdcc6769c1b56e46b, 0x0db8a6d41f5432ff}},
    {"patterns_second_order", {0x7bebb87a21842287, 0xd57ee8863e8493d9}},
    {"patterns_grid_nodes", {0xd17858fed093e39b, 0xb6dcdb77ea966684}},
    {"patterns_broken", {0x0120e0a200fb1736, 0x9715abca88dfa87c}},
    {"patterns_arrays", {0x851186d0d9583a8b, 0xdc2d8f672ae928b6}},
    {"patterns_quantized", {0xaee46e31077776b0, 0x4ce3e3dc88f1818a}},
    {"patterns_special_values", {0x7a85327b38876c5a, 0x769b5aa41313e52c}},
    {"patterns_steps", {0xf27afdd8708d476c, 0xb33ce12c10189067}},
    {"patterns_steps_that_rise", {0x95a1d77e227a89f3, 0x2071f01f97b3a053}},
    {"copied_vertices", {0xc4877222ba0b94d8, 0x71fd608948b4bf31}},
    {"rounding_best", {0x65575b13d9855a22, 0x54e01d9cbb6e00d4}},
    {"rounding_fast", {0x89cd649742991280, 0xf55896b6836a469e}},
    {"digests", {0x42f87cfd73fde86d, 0x1d34be6f8c9b5eda}},
    {"digests_fast", {0xa55a35c8b45709d2, 0x613ce131ea13f900}},
    {"digests_stream", {0xa8cce2d1820dc085, 0x27a375f6c110e92a}},
    {"large grid", {0x185f676ca1689259, 0xf7cfddc6dd8dcf1e}},
    {"large grid, doubles, groups", {0xda3442c98fe8f49d, 0x7ce9efef98a11269}},
    {"large grid, shuffled, stream, delay", {0x83e9df88069bd1fb, 0xde95f2a0391bd6d0}},
    {"large grid, shuffled, keep, delay", {0x84be13052e5d21ca, 0x3379946cb7fc9400}},
    {"large holes", {0xc78e0bb1892724be, 0xaaf50668c468211b}},
    {"large ring", {0x8629edcd60451401, 0xbaec226a9d0e3632}},
    {"large segments", {0x7e2e3df9f87ec4cb, 0xc3bf9d6220d0a1ac}},
    {"large segments, stream", {0xb404663aec81b9b3, 0xc2fedb64a2626244}},
    {"large cells of every shape", {0xb516d49c678412fa, 0x1eec870dd834cd7c}},
    {"large cells of every shape, shuffled, stream", {0x128882696829b64b, 0x29d904d582b91dee}},
    {"large arrays", {0x1809f4f05c202754, 0x53f9f13f071a954e}},
    {"large quantized", {0x2d9c6c379b12b9de, 0x6c9832dafc7193fb}},
    {"changing arrays", {0x8f54c0b68b9a0eea, 0xbf296401e800e9db}},
    {"changing arrays, best", {0x0d601a017784bbe5, 0x1fd1df5ab5671fe9}},
    {"changing arrays, shifts", {0xf8a2ee803b257a6a, 0x31c80427a387f7d0}},
    {"large shifts", {0x1ecd2eee88dab74a, 0xede5acfab6b03651}},
    {"large shifts, columns", {0x301f00575ddbee0d, 0x458b16fe9d0d8438}},
    {"large shifts, doubles", {0xf5f6569b5196ca39, 0x7c6b2965156b7891}},
    {"large shifts, doubles, columns", {0x57556cfbd0cdd750, 0x0389f8799fcfa1df}},
    {"large shifts, arrays", {0x334869a8a3112425, 0x64be9148eeb2983a}},
    {"large shifts, arrays, columns", {0x18379e9f71b04dc9, 0xd78f2d98f430a19e}},
    {"large shifts, quantized", {0x8e2ad54427f805aa, 0x0c7fa42970e06c1b}},
    {"large shifts, quantized, columns", {0x3ca6dc4c24d20386, 0x1de100130a8e485d}},
    {"large shifts, stream", {0x3cf931314a537da7, 0x46d292ffb7b5e259}},
    {"large shifts, stream, columns", {0xdce9d78809208558, 0x7d0cb3fd9475fa7d}},
    {"large patterns", {0x2dbdf1e4621f931d, 0x75c5bd8302bebc21}},
    {"large patterns, arrays", {0x27388e2f2867ab34, 0xfa04fd3480c532bb}},
    {"large patterns, quantized", {0x48b3a3e33c93ff6d, 0xc16262bf11f81bbf}},
    {"large patterns, stream", {0xc099bc9cf2f2e9c4, 0xa54c4c48d4163997}},
};

std::vector<FeatureFile> all_files() {
  auto files = feature_files();
  for (FeatureFile& file : larger_files()) files.push_back(std::move(file));
  return files;
}

TEST(Determinism, PinnedHashes) {
  const auto files = all_files();
  const bool is_whole = ZSTD_versionNumber() == kZstdOfPins;
  std::map<std::string, Pins> found;
  for (const FeatureFile& file : files) {
    const Pins pins = found[file.name] = pins_of(file.bytes);
    const auto pinned = kPinned.find(file.name);
    if (pinned == kPinned.end()) {
      ADD_FAILURE() << file.name;
      continue;
    }
    EXPECT_EQ(pins.groups, pinned->second.groups) << "mesh groups of " << file.name;
    if (is_whole) {
      EXPECT_EQ(pins.file, pinned->second.file) << file.name;
    }
  }
  EXPECT_EQ(files.size(), kPinned.size());
  if (!HasFailure()) return;
  std::printf("const std::map<std::string, Pins> kPinned = {\n");
  for (const FeatureFile& file : files)
    std::printf("    {\"%s\", {0x%016" PRIx64 ", 0x%016" PRIx64 "}},\n", file.name.c_str(),
                found[file.name].groups, found[file.name].file);
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
