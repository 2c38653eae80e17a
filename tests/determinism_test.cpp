// The same input gives the same mesh groups: on every machine, with every compiler, in every
// version that does not change the coders on purpose. On a mismatch the new table is printed, to be
// put in place of the old one where the change is meant (the commit says which stream gained or
// lost). What passes through zstd (schema, extras, steps) may change with zstd's version and is
// left out.
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
  add("large grid", bent_grid(16, 15, 14));
  add("large grid, doubles, groups", bent_grid(16, 15, 14, ScalarType::float64), 500);
  add("large grid, shuffled, stream, delay",
      with_order(shuffled(bent_grid(12, 12, 12)), stream, false, 300));
  add("large grid, shuffled, keep, delay",
      with_order(shuffled(bent_grid(12, 12, 12)), keep, true, 300));
  add("large holes", grid(16, 16, 16, ScalarType::float32, straight, porous));
  add("large ring", exact_ring(40, 6, 8));
  add("large arrays", with_arrays_of_every_type(bent_grid(9, 9, 9)));
  TestMesh coarse = bent_grid(12, 12, 12);
  coarse.schema.coordinate_quantization = {14, {0, 0, -.0625}, {1.125, 1.25, 1}};
  add("large quantized", coarse);
  return files;
}

const std::map<std::string, std::uint64_t> kPinned = {
    {"no_blocks", 0xef46db3751d8e999},
    {"no_cells", 0xef46db3751d8e999},
    {"one_hexahedron", 0xa894f72673b8e62b},
    {"keep", 0x3e3ff12d2af3c101},
    {"keep_delay", 0xfc4d305b01724be6},
    {"stream", 0x158de4e8c843da94},
    {"stream_turned", 0x3c7b91c9b8222364},
    {"free", 0x158de4e8c843da94},
    {"groups", 0x8b79e01fedda1cb9},
    {"paper_codec", 0xf9075a9f41850e08},
    {"paper_codec_stream", 0xbaf715d1cd60b882},
    {"holes", 0xfabb52cf66ec4dfa},
    {"ring", 0xdf37dae4f50f0d24},
    {"mixed_cells", 0x191275b22d914f02},
    {"mixed_cells_stream", 0x97c5b9c348008476},
    {"degenerate", 0x20f3ad07a4f8ca75},
    {"arrays", 0xd0927b1fea2cc527},
    {"arrays_on_some_blocks", 0x99d0781a16c73b0f},
    {"quantized", 0xc07b2a4f5734b00a},
    {"special_values", 0x5394b4f75ca3d816},
    {"replay_keep", 0x27b93f06da6fcf9},
    {"replay_stream", 0x210b8cf1f9d35b42},
    {"mixed_rows", 0x3df434e396b4fdf6},
    {"mixed_rows_stream", 0xb150438e48ed87bd},
    {"unmarked", 0xdf6debbdce0f5338},
    {"steps_and_extras", 0xf7895473885ed1f5},
    {"steps_and_extras_stream", 0xf530266f9dad01d1},
    {"segments", 0xa442ebae27bbccad},
    {"segments_stream", 0x500b629e6a48d6aa},
    {"large grid", 0x78e9fc735c8b5eb5},
    {"large grid, doubles, groups", 0x264efc1ab13a2c32},
    {"large grid, shuffled, stream, delay", 0x46c09a97f847ba8c},
    {"large grid, shuffled, keep, delay", 0x5207a0d927df2335},
    {"large holes", 0xab12def16caed182},
    {"large ring", 0x9add9e0b5668dee5},
    {"large arrays", 0xd5a54a40bab389e8},
    {"large quantized", 0xad8d7b0977ed6c25},
};

TEST(Determinism, PinnedHashes) {
  auto files = feature_files();
  for (FeatureFile& file : larger_files()) files.push_back(std::move(file));
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

TEST(Determinism, TwiceInOneProcess) {
  const auto first = feature_files(), second = feature_files();
  for (std::size_t i = 0; i < first.size(); ++i)
    EXPECT_EQ(first[i].bytes, second[i].bytes) << first[i].name;
}

}  // namespace
}  // namespace shm
