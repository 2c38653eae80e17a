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
    {"no_blocks", {0xef46db3751d8e999, 0x3ee888e365d8b07b}},
    {"no_cells", {0xef46db3751d8e999, 0x07309e8fdc000e3e}},
    {"one_hexahedron", {0xfb1f930b48a3053e, 0x28dea25b6e5a43c4}},
    {"keep", {0xb0361c30346ba5f5, 0x2ef41ab51fffe97a}},
    {"keep_delay", {0x91febe9b19f527ab, 0x4cfd8980132c7e9c}},
    {"stream", {0x9884cdaf6f1afae3, 0x01b67031f6d40701}},
    {"stream_turned", {0xb804cf986c940069, 0x58339febf4a507e0}},
    {"free", {0x9884cdaf6f1afae3, 0x370bfd8ae8135c73}},
    {"groups", {0x03c46a13c7857948, 0x1224854f0c5eccba}},
    {"paper_codec", {0x33eb543e77f35dc0, 0xdce0fc62306f9dfa}},
    {"paper_codec_stream", {0x4d0af516f08d53ae, 0xacad8bf099de19df}},
    {"holes", {0x56d3c98c531d1d98, 0x32e101b20f8b50bc}},
    {"ring", {0x2d3e9629506473be, 0x4626abd2597a2e1b}},
    {"mixed_cells", {0x937cf14b48590a01, 0x608a4adb92bfb562}},
    {"mixed_cells_stream", {0x190ff046227c5290, 0x51427e6ab321f616}},
    {"every_shape", {0x224409722a3719a3, 0x89ae091cd3d86a6b}},
    {"every_shape_stream", {0xa18f4bb9a19f9466, 0x84fcd957df329bf0}},
    {"every_shape_values", {0xb171fc7f7459fc55, 0xf0d8dfe75993081c}},
    {"polyhedra", {0x457f1b1eaadea2cf, 0x19f3a4ca836e564e}},
    {"polyhedra_stream", {0xa8bc2cd0ccab751a, 0x2959bb09f091c78a}},
    {"polyhedra_values", {0x42c17eeb88adda88, 0xa7730c4499a0ed2d}},
    {"second_order", {0x8595f58e92127716, 0x2b01823a712c4266}},
    {"second_order_stream", {0x7dd2c91b80993d63, 0x4b5e9be7a22a2f4b}},
    {"grid_nodes", {0xcefe632f3db8c673, 0x82e23fd0d34a17c1}},
    {"high_order", {0x2aff2e9bfbf73a98, 0xfcbda1189e77b175}},
    {"grid_nodes_stream", {0x05bc29dc20091d4f, 0xb73667c120db8d06}},
    {"degenerate", {0xa88e9cc480a90d58, 0x6ec1b4039acfa52d}},
    {"arrays", {0xa7e13719ddfdf345, 0x2250bf49a1eeb499}},
    {"arrays_on_some_blocks", {0xb70fd8c66ddf7944, 0x16a05a5a130a3540}},
    {"tables_for_some", {0x0ff2ff990ad7053d, 0xea6f9b0ebbbf365b}},
    {"mixed_columns", {0x3f48030b0dabe3b3, 0x98bcfa4ba32fab52}},
    {"quantized", {0x6182f441af8a9489, 0xd8c1c8a0ee58b418}},
    {"bounded", {0x71ac560a7fbf33bf, 0xb71ee222f6e1ba94}},
    {"special_values", {0x3a5a87b7f5a4d79d, 0x697bdb88607c3577}},
    {"replay_keep", {0xb9909ad329f54142, 0xb93d43d71f5290f6}},
    {"replay_stream", {0x5d0ae3f2ed181b1c, 0x2f878f8cb28aea08}},
    {"replay_strays", {0xb3db8ea03f3162bb, 0xa70e6da6507004f0}},
    {"replay_strays_stream", {0x3ae3d48d9a167795, 0x778a0468632d87b4}},
    {"mixed_rows", {0x3dc57dd34ec6b72d, 0x1aced5cec8f175af}},
    {"mixed_rows_stream", {0xc8f2ed3caee7f9b4, 0x8fccfed2914d7b47}},
    {"unmarked", {0x7d67d44faec70011, 0x816f100996f05bc7}},
    {"steps_and_extras", {0x89dd4626093caaa6, 0xe9e6f6975588ce74}},
    {"steps_and_extras_stream", {0xd58eb87cfc9acde1, 0xce182c57d3e23169}},
    {"steps_that_stand_alone", {0x89dd4626093caaa6, 0x4a958a58ea4d54fc}},
    {"bundles", {0x2ba00a27aa7cd624, 0x9a96bed385e86d07}},
    {"bundles_stream", {0xd2fd355c4c47f1fc, 0xba2266bff5b4901a}},
    {"bundles_scaled", {0x2ba00a27aa7cd624, 0x03e4f22a0b7a1a12}},
    {"bounded_steps", {0xb8bdce34f64ef121, 0x42a5464d5d9aaa23}},
    {"bounded_steps_best", {0xd4e82e4abab00552, 0xf389c09eb7ad187c}},
    {"bounded_steps_fast", {0xce42e9e78462e39c, 0xcaa8cd877e646d8b}},
    {"filled", {0x5931f92c91d599e5, 0xd0411d3aeef5e78d}},
    {"filled_stream", {0xe708aeb82bdb3c44, 0xda7780ab8fc3273d}},
    {"filled_patterns", {0xe815b7df808cc83a, 0x74faf7e15edb32ca}},
    {"filled_shifts", {0x60650d59ef90e843, 0x81d4d2949b8e5227}},
    {"filled_steps", {0x4ce001f5877ed423, 0xc032f0dcd55ff46a}},
    {"filled_steps_best", {0xa04cfc5d81897ce9, 0x50e1be9d51143bab}},
    {"filled_steps_fast", {0x2f8045e8bc28c4ad, 0xb705196796622da2}},
    {"filled_bundles", {0x098b123e2dd4f9e5, 0x6c45c7ce82ac3372}},
    {"weighted_steps", {0x60cfa1e9ece8cab8, 0x7195574f6588d737}},
    {"weighted_mirrored", {0x178826c1bb261e13, 0x8de126a8e2e45700}},
    {"weighted_history", {0x32cdecceeb4bfd7d, 0x98a0bf5c57475d68}},
    {"step_times", {0x8a5f548d1c84bb7f, 0xb5be1afbc808730e}},
    {"tensors", {0x361a7d956b68d67a, 0x7c39e542d17beca5}},
    {"tensors_best", {0x1613dd882f85f97c, 0xf1b0ba727e7ed567}},
    {"tensors_shifts", {0x1e019a7a604c89fa, 0xc955923f52b38e58}},
    {"tensors_patterns", {0x12c0e6c1e959aa60, 0xf1874fc9a862a73a}},
    {"tensor_steps", {0x155332815089df2b, 0xfd1770a9eb5464fc}},
    {"tensor_steps_best", {0x473819631c79b5e0, 0x109d35ba3ce5c8e5}},
    {"tensor_steps_fast", {0x041503fbcd403625, 0x5b780830eb57d785}},
    {"steps_on_bases", {0xb60e91b9dfa2bfa5, 0x49df734dbee3c01f}},
    {"steps_on_bases_fast", {0xf14547ea337a8e33, 0x0ad3d48eaec617b9}},
    {"steps_beside_mesh", {0xfe7d90ba08e738a1, 0x51123fc9fd3e0111}},
    {"steps_beside_mesh_fast", {0xea150241796eebf4, 0xb678e41da1277281}},
    {"steps_beside_mesh_bundles", {0x9ea09127a379c131, 0xfcea880b5fbd0392}},
    {"relative_steps", {0x155332815089df2b, 0x4cc6e3d3c912719e}},
    {"relative_steps_best", {0x473819631c79b5e0, 0xaa057c7d78e30d37}},
    {"relative_steps_fast", {0x041503fbcd403625, 0xf3a58fb83db97f5c}},
    {"relative_bundles", {0xf77b2403934dbb29, 0x54e4ebcc8df21249}},
    {"relative", {0xf01885626b044277, 0x3cbf2195f738eeee}},
    {"relative_best", {0x67f10d8f301a25e0, 0xde27dfa86bbcc3cc}},
    {"relative_shifts", {0x259571764ff985e0, 0x76267b854673f189}},
    {"relative_patterns", {0x8502d3e0720066b7, 0xede74534548a88a5}},
    {"large_extras", {0x9db655f5913473fa, 0x1c47fa2bb5ddd458}},
    {"mirrored", {0xea96b028ae07c0e1, 0x467cf7afc696a600}},
    {"mirrored_best", {0x2cb53ca5faa5a104, 0x61cea2ec6b262043}},
    {"broken", {0x91f1de91b4c4333c, 0x13ee08c93e497a18}},
    {"broken_stream", {0x18585c5b056f1ae4, 0xfb2a78c5fae66e58}},
    {"broken_shapes", {0x55850448ef9b0b55, 0x4dfefee0ac9d2377}},
    {"shifts_broken", {0x4581c486927b001f, 0x8f8d311732efe739}},
    {"segments", {0xb1c7088764fbe208, 0x96aa328dfa803a75}},
    {"segments_stream", {0x036bbb6d6220a91c, 0xccafb7b287ed8c88}},
    {"shifts", {0x435d72cc870d39e8, 0x72ceac57082f8929}},
    {"shifts_stream", {0x2ba7ead486e7b3a6, 0x6464f242118cd8cb}},
    {"shifts_shuffled", {0x5c3d3fd9242dc700, 0xd526071d90c684f1}},
    {"shifts_arrays", {0xa9fb5a2379928a59, 0xf6a6cf031943a125}},
    {"shifts_quantized", {0xad52bf2474669079, 0xf84d7552c901a801}},
    {"shifts_special_values", {0x8fdc01ddeb945c21, 0x10906cedc2e7a398}},
    {"shifts_columns", {0x491a2d4b353c94b4, 0x88087d4873eb99ff}},
    {"shifts_columns_arrays", {0x3a8742b2c9b134aa, 0xf01d31fc7e0b59f0}},
    {"shifts_mixed_columns", {0x404bddb7b7312bc7, 0x038d741b11e428de}},
    {"shifts_steps", {0x92d0ddb42cc7f9ba, 0xa3df1f166b375667}},
    {"shifts_columns_quads", {0x27bb2befeb7757f9, 0xf329609f8bfeb184}},
    {"patterns", {0x46aed81a1e8009a8, 0x68bbb0e5a01d7451}},
    {"patterns_stream", {0xaedf5d5a0c9d06c9, 0x5444ea10534d9ff7}},
    {"patterns_shuffled", {0xb07e565be2c66806, 0x6f0fad432cc1b1df}},
    {"patterns_shapes", {0xdcc6769c1b56e46b, 0xdc4bc58ac54e0777}},
    {"patterns_second_order", {0x7bebb87a21842287, 0xa43bcc877fa7e2ba}},
    {"patterns_grid_nodes", {0xd17858fed093e39b, 0xdd20a9adda297014}},
    {"patterns_broken", {0x0120e0a200fb1736, 0x908a39526b8dd2ea}},
    {"patterns_arrays", {0x851186d0d9583a8b, 0xe3717fd8cacd5259}},
    {"patterns_quantized", {0xaee46e31077776b0, 0x95d36d55e17b393d}},
    {"patterns_special_values", {0x7a85327b38876c5a, 0x4bd8931f853a109a}},
    {"patterns_steps", {0xf27afdd8708d476c, 0xa853e94c9f298495}},
    {"patterns_steps_that_rise", {0x95a1d77e227a89f3, 0xa2ea5f7f03524ff4}},
    {"copied_vertices", {0xc4877222ba0b94d8, 0xe69aebc5c506b78b}},
    {"rounding_best", {0x65575b13d9855a22, 0x78bd11df9a6d2b0a}},
    {"rounding_fast", {0x89cd649742991280, 0x8a08fe9e457cbd5a}},
    {"digests", {0x42f87cfd73fde86d, 0x300ac84b9afb7e4e}},
    {"digests_fast", {0xa55a35c8b45709d2, 0x45e754638a273c89}},
    {"digests_stream", {0xa8cce2d1820dc085, 0x29ea6b5f71dd7b56}},
    {"live", {0xb0361c30346ba5f5, 0xb441d88665ed7a8c}},
    {"live_finished", {0xb0361c30346ba5f5, 0x2ca708b902068985}},
    {"large grid", {0x185f676ca1689259, 0xa267b8f5fc04f667}},
    {"large grid, doubles, groups", {0xda3442c98fe8f49d, 0x0c58eba3460a2693}},
    {"large grid, shuffled, stream, delay", {0x83e9df88069bd1fb, 0x8b032e25e0d051f6}},
    {"large grid, shuffled, keep, delay", {0x84be13052e5d21ca, 0x1a975b6bde1f3e62}},
    {"large holes", {0xc78e0bb1892724be, 0x6111f2fb674e6d6d}},
    {"large ring", {0x8629edcd60451401, 0xefe36cee196c8b26}},
    {"large segments", {0x7e2e3df9f87ec4cb, 0xf4ec3b9b0e85e31f}},
    {"large segments, stream", {0xb404663aec81b9b3, 0xb64564e1c04f769f}},
    {"large cells of every shape", {0xb516d49c678412fa, 0x1064d828d8f6a3f9}},
    {"large cells of every shape, shuffled, stream", {0x128882696829b64b, 0x6ae1617e168d1d4f}},
    {"large arrays", {0x1809f4f05c202754, 0x2da3ba98ff421c9c}},
    {"large quantized", {0x2d9c6c379b12b9de, 0x5f971c0ee8f553e1}},
    {"changing arrays", {0x8f54c0b68b9a0eea, 0x39af7a9734e9fdb5}},
    {"changing arrays, best", {0x0d601a017784bbe5, 0xde428df90bceb711}},
    {"changing arrays, shifts", {0xf8a2ee803b257a6a, 0x418f10be56cf9ca7}},
    {"large shifts", {0x1ecd2eee88dab74a, 0xd945d7b524a0f26c}},
    {"large shifts, columns", {0x301f00575ddbee0d, 0x95cce320e776a773}},
    {"large shifts, doubles", {0xf5f6569b5196ca39, 0xc6d976adcaffbc72}},
    {"large shifts, doubles, columns", {0x57556cfbd0cdd750, 0xc52ce3dc8d8e1e63}},
    {"large shifts, arrays", {0x334869a8a3112425, 0x80b62baae08702fc}},
    {"large shifts, arrays, columns", {0x18379e9f71b04dc9, 0x3cc26ea215936fd2}},
    {"large shifts, quantized", {0x8e2ad54427f805aa, 0x679473174b9979cf}},
    {"large shifts, quantized, columns", {0x3ca6dc4c24d20386, 0x3479ad4e1de246a9}},
    {"large shifts, stream", {0x3cf931314a537da7, 0xf486f5f2f077dfb1}},
    {"large shifts, stream, columns", {0xdce9d78809208558, 0x412cdd325efa38fc}},
    {"large patterns", {0x2dbdf1e4621f931d, 0xd31315d006885bc5}},
    {"large patterns, arrays", {0x27388e2f2867ab34, 0xefe502a0095e88a0}},
    {"large patterns, quantized", {0x48b3a3e33c93ff6d, 0x60070923d2258165}},
    {"large patterns, stream", {0xc099bc9cf2f2e9c4, 0x316931bdfd827434}},
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
