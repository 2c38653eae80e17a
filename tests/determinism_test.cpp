// The same input gives the same mesh groups: on every machine, with every compiler, in every
// version that does not change the coders on purpose. It runs under g++ -O0, -O1 and -O3 (presets
// same-gcc-O0, dev, release) and clang -O0 and -O3 (same-clang-O0, fuzz), with one thread and two.
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

#include "feature_files.h"
#include "file_surgery.h"
#include "packing.h"

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
      for (std::vector<std::byte>& stream : group->streams) stream = unpacked(stream);
    const auto bytes = group ? put_group_together(std::move(*group)) : chunk.payload;
    groups.insert(groups.end(), bytes.begin(), bytes.end());
  }
  return XXH64(groups.data(), groups.size(), 0);
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
  add("large arrays", with_arrays_of_every_type(bent_grid(9, 9, 9)));
  TestMesh coarse = bent_grid(12, 12, 12);
  coarse.schema.coordinate_quantization = {14, {0, 0, -.0625}, {1.125, 1.25, 1}};
  add("large quantized", coarse);
  const auto add_shifts = [&](const char* name, const TestMesh& mesh) {
    files.push_back({name, written(mesh, 1500, ConnectivityCodec::shifts)});
  };
  add_shifts("large shifts", bent_grid(16, 15, 14));
  add_shifts("large shifts, doubles", bent_grid(16, 15, 14, ScalarType::float64));
  add_shifts("large shifts, arrays", with_arrays_of_every_type(bent_grid(9, 9, 9)));
  add_shifts("large shifts, quantized", coarse);
  return files;
}

const std::map<std::string, std::uint64_t> kPinned = {
    {"no_blocks", 0xef46db3751d8e999},
    {"no_cells", 0xef46db3751d8e999},
    {"one_hexahedron", 0xed32eebe178def07},
    {"keep", 0xe3831c6c6c96113d},
    {"keep_delay", 0xfb60f0101db322fb},
    {"stream", 0xd2bab0d2bcb9182e},
    {"stream_turned", 0x6ee6bec53a514d5e},
    {"free", 0xd2bab0d2bcb9182e},
    {"groups", 0x6f786fec6c4a34b4},
    {"paper_codec", 0x5e7d24f417be9027},
    {"paper_codec_stream", 0x65bdb9680526b689},
    {"holes", 0x423e7e86269b293d},
    {"ring", 0xdb96167a368ffde4},
    {"mixed_cells", 0xbfb32b9d5a9cbce8},
    {"mixed_cells_stream", 0x1bb7c87852d912ea},
    {"second_order", 0x8d48037af4c0edb1},
    {"second_order_stream", 0x2ce21dcad2f6171c},
    {"degenerate", 0x5364e05c3e31c04e},
    {"arrays", 0x2966d2f715b9e229},
    {"arrays_on_some_blocks", 0xe15b4688ab929582},
    {"tables_for_some", 0x128282453e81d565},
    {"mixed_columns", 0x93e02591a6512f22},
    {"quantized", 0xdcaeefbcd0635c78},
    {"bounded", 0x3ba5410eac9414aa},
    {"special_values", 0x292cafb30a81389f},
    {"replay_keep", 0x3a0f85471b852106},
    {"replay_stream", 0x7e8061ed77ff1fc3},
    {"mixed_rows", 0xc82d172ed970b9a0},
    {"mixed_rows_stream", 0xdacfee0827f71427},
    {"unmarked", 0xd7a9d86834f36fd2},
    {"steps_and_extras", 0x2a71bfa48617a504},
    {"steps_and_extras_stream", 0xe5f2dd7ca759a685},
    {"segments", 0x391ebfab419d6818},
    {"segments_stream", 0xa27d7523783dca77},
    {"shifts", 0x869d203d208c498c},
    {"shifts_shuffled", 0xcf20a82fd378d2a5},
    {"shifts_arrays", 0xac50f46e9ad4ab29},
    {"shifts_quantized", 0x148e08ae355c6b33},
    {"shifts_special_values", 0xaeb7ed5d22477af4},
    {"large grid", 0xbf8efef9aa596631},
    {"large grid, doubles, groups", 0x3ad5556f462b37fb},
    {"large grid, shuffled, stream, delay", 0xb37a6c9cf02cf048},
    {"large grid, shuffled, keep, delay", 0xe94da60f264d154b},
    {"large holes", 0x2fa9f682f7345aab},
    {"large ring", 0x4d26a1afc8a40314},
    {"large segments", 0xd883b56e99b5a381},
    {"large segments, stream", 0xe004f0f6e73e988b},
    {"large arrays", 0x31e14c291d4488b0},
    {"large quantized", 0xbc736c3cf6642e84},
    {"large shifts", 0x11e36126a79c0f46},
    {"large shifts, doubles", 0x1919dd35fe5e45fb},
    {"large shifts, arrays", 0x764fb9ea4e3c13be},
    {"large shifts, quantized", 0xb45ffb289d5b8316},
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
