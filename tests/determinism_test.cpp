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
    {"one_hexahedron", 0x673465d16d4b91f},
    {"keep", 0x74d29f0b5a2ea3cf},
    {"keep_delay", 0x9a0e058669c02008},
    {"stream", 0x249d578dd157a4b4},
    {"stream_turned", 0xba4e2005cbe7a7e},
    {"groups", 0xeae0cd98df6dc351},
    {"holes", 0x588082f4854997d7},
    {"ring", 0xfbd910c037a99ee4},
    {"mixed_cells", 0x924345bdd230d28c},
    {"mixed_cells_stream", 0x4ece74dcd88cd47f},
    {"degenerate", 0x9208587c422323f0},
    {"arrays", 0x5e9b3a63a8513407},
    {"arrays_on_some_blocks", 0x9d8fedd8f376422a},
    {"quantized", 0xdf19aa264d9174b7},
    {"special_values", 0x709500c8fd6d7b9d},
    {"unmarked", 0x891f3ade4d725a82},
    {"steps_and_extras", 0x83722655e9b81a9e},
    {"steps_and_extras_stream", 0xade981a39ff5e29d},
    {"segments", 0xc2fe42ca958a73c5},
    {"segments_stream", 0xf2635eb85b0d4232},
    {"large grid", 0x543409c07fcdd353},
    {"large grid, doubles, groups", 0xa557a519581d5289},
    {"large grid, shuffled, stream, delay", 0x37033c942337d116},
    {"large grid, shuffled, keep, delay", 0x69eac841f64628d0},
    {"large holes", 0x4d4c395330e195d1},
    {"large ring", 0xc9cacf45b8cadf87},
    {"large arrays", 0xf64780f85f719fe8},
    {"large quantized", 0xb0c44e347f2cfe94},
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
