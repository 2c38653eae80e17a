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
    {"one_hexahedron", 0x3c0908b169b1c04f},
    {"keep", 0xe7bd68f0bad34115},
    {"keep_delay", 0x517d97d2fa710b0d},
    {"stream", 0x87437c9546b2e62c},
    {"stream_turned", 0x4c7cce506cc299fa},
    {"free", 0x87437c9546b2e62c},
    {"groups", 0xc6fd3c02bfc1946b},
    {"paper_codec", 0x37584aabd054b847},
    {"paper_codec_stream", 0x202272d7ecc4c164},
    {"holes", 0xa7b4461bc9bdd9d0},
    {"ring", 0x262aaafb52934d5f},
    {"mixed_cells", 0x1651c0aff3e1f697},
    {"mixed_cells_stream", 0xa06c8df5ca6ca169},
    {"degenerate", 0xebd3f28b6afe5709},
    {"arrays", 0xa700eb33d20070aa},
    {"arrays_on_some_blocks", 0x73966164697ddba8},
    {"quantized", 0x19bf0f602e92ea2b},
    {"special_values", 0xafefcd6a0d7bb0d2},
    {"unmarked", 0xa93cb9eced990d99},
    {"steps_and_extras", 0x46b30edd6749d3ea},
    {"steps_and_extras_stream", 0x263981879a0855b2},
    {"large grid", 0x1328dea42c7ae38d},
    {"large grid, doubles, groups", 0xa52742dfb24ec18d},
    {"large grid, shuffled, stream, delay", 0x78bd0891bfc66b8f},
    {"large grid, shuffled, keep, delay", 0x5dab0c2e68b92784},
    {"large holes", 0x2fd1a16dba4bb7d1},
    {"large ring", 0x5dab6eba2cab4fd6},
    {"large arrays", 0xa598bb7c1f896265},
    {"large quantized", 0x5549f60b1e6a6bd6},
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
