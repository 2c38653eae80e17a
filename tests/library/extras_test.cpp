// Tests of encoded extras (typed values with keys). Several extras that are packed together must be
// restored unchanged, whatever their contents. The library's zstd dictionary must equal the
// dictionary in the specification.
#include "format/schema.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <random>
#include <span>
#include <string>

#include "base/binary.h"
#include "base/dictionary.h"
#include "base/packing.h"

namespace shm {
namespace {

template <class T>
Extra extra_of(std::string key, ScalarType type, std::vector<std::uint64_t> shape,
               const std::vector<T>& values) {
  Extra extra;
  extra.key = std::move(key);
  extra.type = type;
  extra.shape = std::move(shape);
  extra.data.resize(values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(extra.data.data(), values.data(), extra.data.size());
  return extra;
}

/// Returns integers of type T: the smallest and the largest number of the type, and numbers whose
/// differences are small or large.
template <class T>
std::vector<T> integers(std::size_t count) {
  std::mt19937_64 random(sizeof(T));
  std::vector<T> all = {std::numeric_limits<T>::max(), std::numeric_limits<T>::min(), T{0},
                        std::numeric_limits<T>::max()};
  while (all.size() < count) {
    const auto next = static_cast<std::uint64_t>(all.back()) + 1;
    all.push_back(static_cast<T>(all.size() % 3 == 0 ? random() : next));
  }
  return all;
}

std::vector<Extra> of_every_kind() {
  Extra to_vertices = extra_of<std::int64_t>("a/vertices", ScalarType::int64, {2, 2},
                                             {-1, 5, std::int64_t{1} << 40, 7});
  to_vertices.refers = Reference::vertex;
  std::vector<std::int32_t> rows(300);
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] = static_cast<std::int32_t>(i % 3 == 0 ? 1000 * i : i % 3);
  return {extra_of<std::int8_t>("a", ScalarType::int8, {5}, {1, -1, 0, 127, -128}),
          extra_of<std::uint8_t>("text", ScalarType::uint8, {3}, {'x', 'y', 'z'}),
          extra_of("b", ScalarType::int16, {40}, integers<std::int16_t>(40)),
          extra_of("c", ScalarType::uint16, {40}, integers<std::uint16_t>(40)),
          extra_of("d", ScalarType::int32, {20, 2}, integers<std::int32_t>(40)),
          extra_of("e", ScalarType::uint32, {40}, integers<std::uint32_t>(40)),
          extra_of("f", ScalarType::int64, {40}, integers<std::int64_t>(40)),
          extra_of("g", ScalarType::uint64, {2, 20}, integers<std::uint64_t>(40)),
          extra_of<float>("h", ScalarType::float32, {2}, {0.5f, -0.f}),
          extra_of<double>("i", ScalarType::float64, {1, 1, 1}, {0.1}),
          extra_of("rows", ScalarType::int32, {100, 3}, rows),
          extra_of<double>("nothing", ScalarType::float64, {0, 7}, {}),
          extra_of<std::int32_t>("no numbers", ScalarType::int32, {0}, {}),
          extra_of<std::int32_t>("one number", ScalarType::int32, {}, {-3}),
          to_vertices};
}

constexpr std::uint64_t kMuch = std::uint64_t{1} << 30;

TEST(Extras, ComeBackTogetherAndAlone) {
  const std::vector<Extra> all = of_every_kind();
  const auto back = get_extras(extras_payload(all), 1, kMuch);
  ASSERT_TRUE(back) << back.error().detail;
  ASSERT_EQ(back->size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ((*back)[i], all[i]) << all[i].key;
    const auto alone = get_extras(extra_payload(all[i]), 0, kMuch);
    ASSERT_TRUE(alone) << all[i].key;
    EXPECT_EQ(*alone, std::vector<Extra>{all[i]});
  }
  const auto none = get_extras(extras_payload({}), 1, kMuch);
  EXPECT_TRUE(none && none->empty());
}

// Ascending numbers are coded as differences: 50000 consecutive numbers need less than 100 bytes.
TEST(Extras, IntegersAreDifferences) {
  std::vector<std::int64_t> map(50000);
  std::iota(map.begin(), map.end(), 1);
  const std::vector<Extra> one = {extra_of("map", ScalarType::int64, {map.size()}, map)};
  EXPECT_LT(extras_payload(one).size(), 100u);
  EXPECT_LT(10 * extras_payload(one).size(), extra_payload(one[0]).size());
}

TEST(Extras, StayWithinTheLimit) {
  const std::vector<Extra> one = {
      extra_of("zeros", ScalarType::int64, {1000}, std::vector<std::int64_t>(1000))};
  EXPECT_TRUE(get_extras(extras_payload(one), 1, bytes_of(one[0])));
  for (const std::uint64_t limit : {bytes_of(one[0]) - 1, std::uint64_t{7999}, std::uint64_t{0}}) {
    const auto over = get_extras(extras_payload(one), 1, limit);
    ASSERT_FALSE(over);
    EXPECT_EQ(over.error().code, ErrorCode::over_limit);
  }
}

TEST(Extras, CutOnesAreRefused) {
  const std::vector<std::byte> whole = extras_payload(of_every_kind());
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(get_extras(std::span(whole).first(size), 1, kMuch)) << size;
}

TEST(Dictionary, IsThatOfTheSpecification) {
  std::string bytes;
  for (const char* name : {"dictionary_tables.bin", "dictionary.txt"}) {
    std::ifstream in(std::string(SHM_SOURCE_DIR "/spec/") + name, std::ios::binary);
    bytes.append(std::istreambuf_iterator<char>(in), {});
  }
  EXPECT_EQ(bytes.size(), 13890u);
  EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(bytes)), dictionary()));
  EXPECT_EQ(checksum(dictionary()), 0x5a330498u);
}

TEST(Dictionary, PacksSmallBlobs) {
  const std::string words = "mesh/node_set/0/members mesh/side_set/0/members mesh/side_set/0/sides";
  const auto blob = std::as_bytes(std::span(words));
  ByteWriter with, without;
  put_packed(with, blob, Packing::with_dictionary);
  put_packed(without, blob);
  EXPECT_LT(2 * with.bytes.size(), without.bytes.size());
  ByteReader in(with.bytes);
  const auto back = get_packed(in, blob.size());
  ASSERT_TRUE(back);
  EXPECT_TRUE(std::equal(back->begin(), back->end(), blob.begin(), blob.end()));
}

}  // namespace
}  // namespace shm
