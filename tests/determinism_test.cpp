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
    {"one_hexahedron", 0x35c554ec7c239ec8},
    {"keep", 0x8d60c1f6c60a9947},
    {"keep_delay", 0xc36546a785c731a4},
    {"stream", 0x6ee372feb0942d36},
    {"stream_turned", 0x86f7e01285ee739c},
    {"free", 0x6ee372feb0942d36},
    {"groups", 0x47274431576a7976},
    {"holes", 0xc77fc0569a27eb4d},
    {"ring", 0x5beb2845d7b37c51},
    {"mixed_cells", 0x1ba69daaba98e13e},
    {"mixed_cells_stream", 0x6b006e0440744ebe},
    {"degenerate", 0x4497009781e74671},
    {"arrays", 0xa83b3b365fec5b00},
    {"arrays_on_some_blocks", 0x68bb027784c19fa7},
    {"quantized", 0xbe77e4348984cf9e},
    {"special_values", 0x561e06d1dd952133},
    {"unmarked", 0xf71019d993f59ef3},
    {"steps_and_extras", 0x5f9e5001413097e8},
    {"steps_and_extras_stream", 0x62d17db53fe3f8c},
    {"large grid", 0x64213d0d86bed800},
    {"large grid, doubles, groups", 0x81ccdc979959909},
    {"large grid, shuffled, stream, delay", 0x96170a946fba46c0},
    {"large grid, shuffled, keep, delay", 0x26870b2f141004ec},
    {"large holes", 0x8c603cc5e5a77a12},
    {"large ring", 0x5042024cd0417133},
    {"large arrays", 0xa28a563ac7e90aba},
    {"large quantized", 0x4f190f37a1309d13},
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
