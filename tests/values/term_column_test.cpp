// Tests of values that are predicted from terms (known vertices of the same cell). At the beginning
// of each group, the state inherited from the previous group must be the same in encoder and
// decoder.
#include "codecs/patterns/term_column.h"
#include "codecs/shared/codec_id.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "codecs/patterns/term_columns.h"

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;

/// Returns `count` new vertices in consecutive slots, beginning with slot `first`. Each vertex has
/// one term, the vertex from which its value is predicted: the vertex before it, or the vertex in
/// slot 0 for the first new vertex. A vertex in slot 0 has no term.
std::vector<VertexTerms> chain(std::uint32_t first, std::uint32_t count) {
  std::vector<VertexTerms> vertices(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    vertices[i].slot = first + i;
    if (first + i == 0) continue;
    vertices[i].count = 1;
    vertices[i].slots[0] = i == 0 ? 0 : first + i - 1;
  }
  return vertices;
}

/// Encodes groups of one column, decodes them, and checks that all values are restored bit for bit.
/// Returns the codecs of the groups.
template <class T>
std::vector<Codec> there_and_back(ScalarType type, const std::vector<std::vector<T>>& groups) {
  ArrayInfo info;
  info.type = type;
  TermColumn encoder(info, true), decoder(info, true);
  TermScratch scratch;
  std::vector<Codec> codecs;
  std::uint32_t slots = 0;
  for (const std::vector<T>& values : groups) {
    const auto count = static_cast<std::uint32_t>(values.size());
    const std::vector<VertexTerms> vertices = chain(slots, count);
    slots += count;
    const TermColumn::Elements elements{vertices, count, slots};
    const auto bytes = std::as_bytes(std::span(values));
    const auto encoded = encoder.encode(elements, bytes.data(), sizeof(T), scratch);
    codecs.push_back(encoded.codec);
    Bytes decoded;
    EXPECT_TRUE(decoder.begin_group(encoded.codec, encoded.bytes, bytes.size(), scratch));
    EXPECT_TRUE(decoder.decode(elements, decoded, scratch)) << "group " << codecs.size();
    EXPECT_TRUE(decoder.at_end());
    EXPECT_EQ(decoded, Bytes(bytes.begin(), bytes.end())) << "group " << codecs.size();
  }
  return codecs;
}

/// Returns `count` values, each chosen pseudorandomly from `words`, so that terms cannot predict
/// them.
template <class T>
std::vector<T> some_of(std::span<const T> words, std::size_t count) {
  std::vector<T> values;
  std::uint32_t state = 1;
  for (std::size_t i = 0; i < count; ++i) {
    state = state * 1664525 + 1013904223;
    values.push_back(words[(state >> 16) % words.size()]);
  }
  return values;
}

TEST(TermColumn, StatesBehindAShuffledGroupAreTranslatedToATable) {
  // The second group stores each value as its rank in a table, in which the value 0 has rank 1.
  // After the first group, which is coded with shuffled_zstd, a vertex can also have the state 1,
  // but with another meaning. This state must therefore be translated.
  using Limits = std::numeric_limits<std::int64_t>;
  const std::vector<std::int64_t> words{Limits::min(), 0, 1, Limits::max() / 2, Limits::max()};
  std::vector<std::int64_t> names;
  for (int i = 0; i < 200; ++i)
    names.push_back((i & 1) != 0 ? 0x123456789abcdef : -0x76543210fedcba);
  const auto codecs =
      there_and_back<std::int64_t>(ScalarType::int64, {names, some_of<std::int64_t>(words, 300)});
  EXPECT_EQ(codecs, (std::vector<Codec>{Codec::shuffled_zstd, Codec::terms}));
}

TEST(TermColumn, NansPassFromTableToTable) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> words{0.0, -0.0, 1.5, nan, 1e300, -2.25, 1 / 3.0};
  std::vector<double> first = some_of<double>(words, 200);
  first.front() = first.back() = nan;
  const auto codecs =
      there_and_back<double>(ScalarType::float64, {first, some_of<double>(words, 200)});
  EXPECT_EQ(codecs, (std::vector<Codec>{Codec::terms, Codec::terms}));
}

/// Encodes and decodes elements without terms, which can be predicted only from `reference`, the
/// values at an earlier step. Checks that all values are restored bit for bit. Returns true if the
/// encoder used the reference.
bool refers(const std::vector<float>& values, const std::vector<float>& reference) {
  ArrayInfo info;
  info.type = ScalarType::float32;
  TermColumn encoder(info, true), decoder(info, true);
  TermScratch scratch;
  TermColumn::Elements elements;
  elements.count = values.size();
  elements.reference = std::as_bytes(std::span(reference));
  const auto bytes = std::as_bytes(std::span(values));
  const Bytes encoded = encoder.encode_terms(elements, bytes.data(), 4, scratch);
  Bytes decoded;
  EXPECT_TRUE(decoder.begin_group(Codec::terms, encoded, bytes.size(), scratch));
  EXPECT_TRUE(decoder.decode(elements, decoded, scratch));
  EXPECT_EQ(decoded, Bytes(bytes.begin(), bytes.end()));
  EXPECT_EQ(decoder.refers(), encoder.refers());
  // If the values of a group are coded relative to the reference values, the group cannot be
  // decoded without them. Any other group can.
  elements.reference = {};
  decoded.clear();
  EXPECT_TRUE(decoder.begin_group(Codec::terms, encoded, bytes.size(), scratch));
  EXPECT_EQ(decoder.decode(elements, decoded, scratch), !encoder.refers());
  return encoder.refers();
}

TEST(TermColumn, ReferencesAreTakenWhereTheyHelp) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> before, now, shifted;
  std::uint32_t state = 5;
  for (int i = 0; i < 400; ++i) {
    state = state * 1664525 + 1013904223;
    before.push_back(1024 + static_cast<float>(state >> 8) * 0x1p-20f);
    now.push_back(before.back() + 0x1p-10f);
    shifted.push_back(before.back() + 100 + static_cast<float>(i) * .25f);
  }
  EXPECT_TRUE(refers(now, before));
  EXPECT_TRUE(refers(shifted, before));  // from the change of the previous element
  now[7] = before[8] = kNan;
  EXPECT_TRUE(refers(now, before));
  std::vector<float> ramp, noise;
  for (const float value : before) {
    ramp.push_back(static_cast<float>(ramp.size()) * 1e-3f);
    noise.push_back(value - 1024);
  }
  EXPECT_FALSE(refers(ramp, noise));
}

/// Returns 3 * count values. Most values differ little from the previous value; about one in 37 is
/// a special value such as NaN, infinity or -0.
template <class T>
std::vector<T> special_walk(std::size_t count, std::uint32_t seed) {
  using Limits = std::numeric_limits<T>;
  const std::vector<T> special{T(-0.0),
                               Limits::quiet_NaN(),
                               Limits::infinity(),
                               -Limits::infinity(),
                               Limits::denorm_min(),
                               Limits::lowest()};
  std::vector<T> values;
  T at = 1;
  for (std::size_t i = 0; i < 3 * count; ++i) {
    seed = seed * 1664525 + 1013904223;
    at += static_cast<T>(static_cast<std::int32_t>(seed) / 65536) / 65536;
    values.push_back(seed % 37 == 0 ? special[seed / 37 % special.size()] : at);
  }
  return values;
}

/// Encodes and decodes the values in pieces of several hundred and of several thousand elements.
/// Checks that all values are restored bit for bit.
template <class T>
void expect_back_in_pieces(ScalarType type, bool of_vertices) {
  constexpr std::size_t kCount = 5000;
  ArrayInfo info;
  info.type = type;
  info.components = 3;
  TermColumn encoder(info, true), decoder(info, true);
  TermScratch scratch;
  const std::vector<T> reference = special_walk<T>(kCount, 1);
  std::vector<T> values = special_walk<T>(kCount, 2);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (i % 50 != 0) values[i] = reference[i] * T(1.25);
  const std::vector<VertexTerms> vertices = chain(0, kCount);
  const auto elements = [&](std::size_t first, std::size_t count) {
    TermColumn::Elements of;
    of.count = count;
    if (of_vertices) {
      of.vertices = std::span(vertices).subspan(first, count);
      of.slots = static_cast<std::uint32_t>(kCount);
    } else {
      of.reference = std::as_bytes(std::span(reference).subspan(3 * first, 3 * count));
    }
    return of;
  };
  const auto bytes = std::as_bytes(std::span(values));
  const Bytes encoded =
      encoder.encode_terms(elements(0, kCount), bytes.data(), 3 * sizeof(T), scratch);
  EXPECT_EQ(encoder.refers(), !of_vertices);
  Bytes decoded;
  ASSERT_TRUE(decoder.begin_group(Codec::terms, encoded, bytes.size(), scratch));
  for (std::size_t first = 0, count = 300; first < kCount; first += count, count = 1900)
    ASSERT_TRUE(decoder.decode(elements(first, std::min(count, kCount - first)), decoded, scratch));
  EXPECT_TRUE(decoder.at_end());
  EXPECT_EQ(decoded, Bytes(bytes.begin(), bytes.end()));
}

TEST(TermColumn, ComponentsComeBackInPieces) {
  for (const bool of_vertices : {false, true}) {
    expect_back_in_pieces<float>(ScalarType::float32, of_vertices);
    expect_back_in_pieces<double>(ScalarType::float64, of_vertices);
  }
}

TEST(TermColumn, CopiedVerticesCostAlmostNothing) {
  // Every vertex of the first quarter occurs three more times, in another order. The distance from
  // most sources to their copies is therefore the same.
  constexpr std::size_t kCount = 40000, kOwn = kCount / 4;
  std::vector<std::array<float, 3>> points;
  std::uint32_t state = 3;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (i >= kOwn) {
      points.push_back(points[i - kOwn - (i % 100 == 50 ? 7 : 0)]);
      continue;
    }
    points.emplace_back();
    for (float& value : points.back()) {
      state = state * 1664525 + 1013904223;
      value = static_cast<float>(state >> 8);
    }
  }
  ArrayInfo info;
  info.type = ScalarType::float32;
  info.components = 3;
  TermColumn encoder(info, true), decoder(info, true);
  TermScratch scratch;
  const std::vector<VertexTerms> vertices = chain(0, kCount);
  const auto bytes = std::as_bytes(std::span(points));
  const Bytes encoded = encoder.encode_terms({vertices, kCount, kCount}, bytes.data(), 12, scratch);
  EXPECT_LT(encoded.size(), kOwn * 12);
  Bytes decoded;
  ASSERT_TRUE(decoder.begin_group(Codec::terms, encoded, bytes.size(), scratch));
  for (std::size_t begin = 0; begin < kCount; begin += 1000)
    ASSERT_TRUE(
        decoder.decode({std::span(vertices).subspan(begin, 1000), 1000, kCount}, decoded, scratch));
  EXPECT_TRUE(decoder.at_end());
  EXPECT_EQ(decoded, Bytes(bytes.begin(), bytes.end()));
}

// For each component, the coder would need memory for every live vertex. Wide arrays are therefore
// coded with zstd only.
TEST(TermColumn, WideArraysAreLeftToZstd) {
  Schema schema;
  schema.blocks = {{1, "", CellShape::hexahedron, 8}};
  for (const std::uint32_t components :
       {28u, 2u, 1u}) {  // 3 more components belong to the coordinates
    ArrayInfo& info = schema.arrays.emplace_back();
    info.name = "a" + std::to_string(components);
    info.type = ScalarType::float32;
    info.components = components;
  }
  const std::vector<TermColumn> columns = term_columns(schema);
  ASSERT_EQ(columns.size(), 4u);
  EXPECT_TRUE(columns[0].takes(Codec::terms) && columns[1].takes(Codec::terms));
  EXPECT_FALSE(columns[2].takes(Codec::terms));
  EXPECT_TRUE(columns[3].takes(Codec::terms));
  for (const TermColumn& column : columns) EXPECT_TRUE(column.takes(Codec::shuffled_zstd));
}

}  // namespace
}  // namespace shm
