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

/// Returns the number of bytes of values in a row, after checking that they are restored. `last`:
/// the values of the step before, if the reference values are their trend.
std::size_t bytes_of(const ArrayInfo& info, std::span<const double> values,
                     std::span<const double> reference = {}, std::span<const double> last = {}) {
  const ReferenceValues from{std::as_bytes(reference), std::as_bytes(last)};
  const auto count = static_cast<std::uint32_t>(values.size());
  const TiledItems elements = row(count);
  WeightedEncoder encoder(info, {});
  WeightedDecoder decoder(info, {});
  encoder.make_room(count);
  decoder.make_room(count);
  const Bytes coded = encoder.encode(elements, std::as_bytes(values), from);
  Bytes back;
  EXPECT_TRUE(decoder.decode(elements, coded, from, back));
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

// Each value is the mean of the values around it at the step before, later elements included. The
// noise needs 8 bits.
TEST(Weighted, AHistoryPredictsFromLaterElements) {
  PlainRandom random(8);
  std::vector<double> reference, values;
  for (int i = 0; i < 10000; ++i) reference.push_back(static_cast<double>(random.below(1u << 30)));
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const double before = reference[i == 0 ? i : i - 1];
    const double after = reference[i + 1 == reference.size() ? i : i + 1];
    values.push_back(std::floor((before + 2 * reference[i] + after) / 4) +
                     static_cast<double>(random.below(256)));
  }
  EXPECT_LT(bytes_of(doubles(), values, reference), 10000 * 11 / 8u);
}

// A wave moves by one element at each step: the next value is the sum of the values around it,
// minus its value two steps before.
TEST(Weighted, AHistoryPredictsFromTwoSteps) {
  PlainRandom random(9);
  constexpr std::size_t kCount = 10000;
  std::vector<double> wave, back, first, last, trend, values;
  for (std::size_t i = 0; i < kCount + 2; ++i) {
    wave.push_back(static_cast<double>(random.below(1u << 26)));
    back.push_back(static_cast<double>(random.below(1u << 26)));
  }
  for (std::size_t i = 0; i < kCount; ++i) {
    first.push_back(wave[i] + back[i + 2]);
    last.push_back(wave[i + 1] + back[i + 1]);
    values.push_back(wave[i + 2] + back[i]);
    trend.push_back(2 * last[i] - first[i]);
  }
  EXPECT_GT(bytes_of(doubles(), values, last), kCount * 20 / 8);
  EXPECT_LT(bytes_of(doubles(), values, trend, last), kCount * 2 / 8);
}

TEST(Weighted, ADamagedHistoryIsRefused) {
  PlainRandom random(10);
  std::vector<double> reference, values;
  for (int i = 0; i < 2000; ++i) reference.push_back(static_cast<double>(random.below(1u << 30)));
  for (std::size_t i = 0; i < reference.size(); ++i)
    values.push_back((reference[i] + reference[i == 0 ? i : i - 1]) / 2);
  const TiledItems elements = row(2000);
  WeightedEncoder encoder(doubles(), {});
  encoder.make_room(2000);
  const ReferenceValues from{std::as_bytes(std::span<const double>(reference)), {}};
  const Bytes coded =
      encoder.encode(elements, std::as_bytes(std::span<const double>(values)), from);
  constexpr std::size_t kHead = 2;  // after the number of elements
  ASSERT_NE(std::to_integer<std::uint32_t>(coded[kHead]) & kHistoryBit, 0u);
  const auto is_read = [&](const Bytes& bytes, const ReferenceValues& reference_values) {
    WeightedDecoder decoder(doubles(), {});
    decoder.make_room(2000);
    Bytes back;
    return decoder.decode(elements, bytes, reference_values, back);
  };
  EXPECT_TRUE(is_read(coded, from));
  EXPECT_FALSE(is_read(coded, {}));
  Bytes unknown_bit = coded;
  unknown_bit[kHead] |= std::byte{2 * kHistoryBit};
  EXPECT_FALSE(is_read(unknown_bit, from));
  ByteWriter weight;
  weight.put_signed(WeightedHistory::kMostCoded + 1);
  Bytes too_large(coded.begin(), coded.begin() + kHead + 2);
  too_large.insert(too_large.end(), weight.bytes.begin(), weight.bytes.end());
  too_large.insert(too_large.end(), coded.begin() + kHead + 2, coded.end());
  EXPECT_FALSE(is_read(too_large, from));
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
  bytes_of(doubles(), values, reference, values);
}

}  // namespace
}  // namespace shm
