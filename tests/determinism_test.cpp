// The same input gives the same mesh groups: on every machine, with every compiler, in every
// version that does not change the coders on purpose. It runs under g++ -O0, -O1 and -O3 (presets
// same-gcc-O0, dev, release) and clang -O0 and -O3 (same-clang-O0, fuzz), with one thread and two.
// On a mismatch the new table is printed, to be put in place of the old one where the change is
// meant (the commit says which stream gained or lost). What passes through zstd (schema, extras,
// steps) may change with zstd's version and is left out.
#include <xxhash.h>

#include <charconv>
#include <cstdio>
#include <map>
#include <string>

#include "feature_files.h"
#include "file_surgery.h"

namespace shm {
namespace {

std::uint64_t hash_of(const std::vector<std::byte>& file) {
  std::vector<std::byte> groups;
  for (const Chunk& chunk : take_apart(file).chunks)
    if (chunk.is(container::ChunkKind::group))
      groups.insert(groups.end(), chunk.payload.begin(), chunk.payload.end());
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
  return files;
}

const std::map<std::string, std::uint64_t> kPinned = {
    {"no_blocks", 0xef46db3751d8e999},
    {"no_cells", 0xef46db3751d8e999},
    {"one_hexahedron", 0x78d5b6263ce963bb},
    {"keep", 0xfc86ca6fc717963b},
    {"keep_delay", 0xb30f6dda912bd426},
    {"stream", 0xf1c3758608927c4b},
    {"stream_turned", 0xd5ded3dfe981abd9},
    {"free", 0xf1c3758608927c4b},
    {"groups", 0x45a193e220b96a75},
    {"paper_codec", 0x1bb4c2cc0b0aaf6b},
    {"paper_codec_stream", 0x46742c8d74787d47},
    {"holes", 0xc0959db95f2c3edc},
    {"ring", 0x483dd6ad7e13e70f},
    {"mixed_cells", 0x895f19302b03d835},
    {"mixed_cells_stream", 0x97c5b9c348008476},
    {"degenerate", 0xebb394cd138a0e8b},
    {"arrays", 0x6082d312066d00da},
    {"arrays_on_some_blocks", 0x8402b1d8258f6cea},
    {"quantized", 0x2ebf8d01231ab6c8},
    {"bounded", 0x915627c92b414b68},
    {"special_values", 0x99d9df369a5c978f},
    {"replay_keep", 0x8b8eaccea6eec392},
    {"replay_stream", 0xac97440a669960a8},
    {"mixed_rows", 0xad2988df87021597},
    {"mixed_rows_stream", 0xb150438e48ed87bd},
    {"unmarked", 0xe16c67c88c2cc9bd},
    {"steps_and_extras", 0xe3edaa7f6470fa2a},
    {"steps_and_extras_stream", 0xf2d2e889aa4de1ae},
    {"segments", 0x79a659105742ec06},
    {"segments_stream", 0xaf62be1a3caf0db7},
    {"large grid", 0xe7cc0995fd84956f},
    {"large grid, doubles, groups", 0x871e3bbdbf07aeb5},
    {"large grid, shuffled, stream, delay", 0x4e058a877b0b06fa},
    {"large grid, shuffled, keep, delay", 0xf91dc8e88c690bb2},
    {"large holes", 0x2b83655df80b2024},
    {"large ring", 0x40cfec259e7f677a},
    {"large segments", 0x78da7633b69fa2e3},
    {"large segments, stream", 0x33f8eb824376ff8f},
    {"large arrays", 0x79ecb13c7675b325},
    {"large quantized", 0xb1f1865f35694fa5},
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
