// Tests of the codec `weighted`: lengths and low bits of residuals are restored, and predictions
// suit the values. sparse_elements_test.cpp tests whole columns.
#include "codecs/weighted/weighted_column.h"

#include <gtest/gtest.h>

#include "codecs/weighted/length_encoder.h"
#include "codecs/weighted/weighted_encoder.h"
#include "support/feature_files.h"

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;

/// Returns `count` lengths. In each context, a few lengths are frequent.
std::vector<LengthInContext> some_lengths(std::size_t count, std::uint32_t seed) {
  PlainRandom random(seed);
  std::vector<LengthInContext> lengths;
  for (std::size_t i = 0; i < count; ++i) {
    const auto context = static_cast<std::uint8_t>(random.below(kLengthContexts));
    const std::uint64_t length =
        random.below(20) == 0 ? random.below(kLengths) : (context + random.below(4)) % kLengths;
    lengths.push_back({context, static_cast<std::uint8_t>(length)});
  }
  return lengths;
}

TEST(Weighted, LengthsAreRestored) {
  for (const std::size_t count : {1u, 2u, 100u, 5000u, 100000u}) {
    const auto lengths = some_lengths(count, static_cast<std::uint32_t>(count));
    ByteWriter out;
    put_lengths(out, lengths);
    out.put_u8(7);
    ByteReader in(out.bytes);
    LengthDecoder decoder;
    ASSERT_TRUE(decoder.begin(in));
    EXPECT_EQ(in.left(), 1u);
    for (const LengthInContext& it : lengths) ASSERT_EQ(decoder.next(it.context), it.length);
    EXPECT_TRUE(decoder.at_end());
  }
}

TEST(Weighted, FrequentLengthsNeedFewBits) {
  std::vector<LengthInContext> lengths(100000);
  for (std::size_t i = 0; i < lengths.size(); i += 1000) lengths[i].length = 9;
  ByteWriter out;
  put_lengths(out, lengths);
  EXPECT_LT(out.bytes.size(), 200u);  // the entropy is 142 bytes
}

TEST(Weighted, LowBitsAreRestored) {
  PlainRandom random(3);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> numbers;
  BitWriter writer;
  for (int i = 0; i < 20000; ++i) {
    const auto bits = static_cast<std::uint32_t>(random.below(65));
    const std::uint64_t all = random.below(~std::uint64_t{0});
    numbers.emplace_back(bits == 0 ? 0 : all >> (64 - bits), bits);
    writer.put(numbers.back().first, bits);
  }
  const Bytes bytes = writer.finish();
  BitReader reader(bytes);
  EXPECT_FALSE(reader.at_end());
  for (const auto& [number, bits] : numbers) ASSERT_EQ(reader.get(bits), number);
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(reader.get(64), 0u);
  EXPECT_FALSE(reader.at_end());
}

TEST(Weighted, LowBitsAfterTheLastNumberAreRefused) {
  BitWriter writer;
  writer.put(5, 3);
  Bytes bytes = writer.finish();
  BitReader reader(bytes);
  reader.get(3);
  EXPECT_TRUE(reader.at_end());
  bytes[0] |= std::byte{8};
  EXPECT_FALSE(reader.at_end());
}

/// Returns the elements of a row: each has the previous element as its near element.
TiledItems row(std::uint32_t count) {
  TiledItems elements;
  for (std::uint32_t i = 0; i < count; ++i) {
    Neighbourhood& item = elements.items.emplace_back();
    item.kind = Neighbourhood::lattice;
    item.self = i;
    if (i == 0) continue;
    item.known = 1;
    item.at[0] = i - 1;
    if (i == 1) continue;
    item.known |= Neighbourhood::kBeyond;
    item.at[kAtBeyond] = i - 2;
  }
  return elements;
}

/// Returns the number of bytes of values in a row, after checking that they are restored.
std::size_t bytes_of(const ArrayInfo& info, std::span<const double> values,
                     std::span<const double> reference = {}) {
  const auto count = static_cast<std::uint32_t>(values.size());
  const TiledItems elements = row(count);
  WeightedEncoder encoder(info, {});
  WeightedDecoder decoder(info, {});
  encoder.make_room(count);
  decoder.make_room(count);
  const Bytes coded = encoder.encode(elements, std::as_bytes(values), std::as_bytes(reference));
  Bytes back;
  EXPECT_TRUE(decoder.decode(elements, coded, std::as_bytes(reference), back));
  EXPECT_TRUE(std::ranges::equal(back, std::as_bytes(values)));
  return coded.size();
}

ArrayInfo doubles() {
  ArrayInfo info;
  info.type = ScalarType::float64;
  return info;
}

TEST(Weighted, ConstantValuesNeedNoBits) {
  EXPECT_LT(bytes_of(doubles(), std::vector<double>(10000, 1 / 3.)), 100u);
}

// Each value changes by .99 times the change before it, plus noise. The noise needs 26 bits, the
// changes need 32.
TEST(Weighted, WeightsAreFitted) {
  PlainRandom random(5);
  std::vector<double> values;
  double value = 1, change = 0;
  for (int i = 0; i < 10000; ++i) {
    change = .99 * change + static_cast<double>(random.below(1u << 20)) * 0x1p-46;
    values.push_back(value += change);
  }
  EXPECT_LT(bytes_of(doubles(), values), 10000 * 28 / 8u);
}

TEST(Weighted, ReferencesAreUsed) {
  PlainRandom random(6);
  std::vector<double> reference, values;
  for (int i = 0; i < 10000; ++i) {
    reference.push_back(static_cast<double>(random.below(1u << 30)));
    values.push_back(reference.back() + static_cast<double>(random.below(16)));
  }
  EXPECT_LT(bytes_of(doubles(), values, reference), 10000u);
}

TEST(Weighted, EveryBitPatternIsRestored) {
  PlainRandom random(7);
  std::vector<double> values;
  for (int i = 0; i < 3000; ++i)
    values.push_back(std::bit_cast<double>(random.below(~std::uint64_t{0})));
  values[100] = -0.0;
  bytes_of(doubles(), values);
  std::vector<double> reference(values.rbegin(), values.rend());
  bytes_of(doubles(), values, reference);
}

}  // namespace
}  // namespace shm
