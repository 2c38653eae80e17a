// Tests of the mixing coder: the functions stretch and squash, encoding and decoding, the encoded
// size of noise and of patterns, and the exact bytes.
#include "entropy/mixing.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "base/binary.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"

namespace shm {
namespace {

TEST(Mixing, SquashAndStretchAreEachOthersInverse) {
  using namespace mixing;
  EXPECT_EQ(squash(0), 32768u);
  EXPECT_EQ(squash(kStretchLimit), 65535u);
  EXPECT_EQ(squash(-kStretchLimit), 1u);
  EXPECT_EQ(stretch(32768), 0);
  EXPECT_EQ(stretch(1), -stretch(65535));
  for (std::int32_t x = -kStretchLimit; x < kStretchLimit; ++x) {
    EXPECT_LE(squash(x), squash(x + 1));
    EXPECT_NEAR(squash(x), 65536 / (1 + std::exp(-x / 256.)), 1.5) << x;
  }
  for (std::uint32_t p = 1; p < 65535; ++p) EXPECT_LE(stretch(p), stretch(p + 1)) << p;
  for (std::uint32_t p : {3u, 100u, 2047u, 2048u, 9000u, 32767u, 40000u, 65000u})
    EXPECT_NEAR(squash(stretch(p)), p, 1 + p / 200.) << p;
}

/// Runs `code(coder)` with an encoder, then with a decoder of the encoded bytes. Returns these
/// bytes.
template <class Code>
std::vector<std::byte> both_ways(Code code) {
  RangeEncoder out;
  MixingCoder<RangeEncoder> encoder(2);
  encoder.use(out);
  code(encoder);
  const std::vector<std::byte> bytes = out.finish();
  RangeDecoder in{std::span<const std::byte>(bytes)};
  MixingCoder<RangeDecoder> decoder(2);
  decoder.use(in);
  code(decoder);
  return bytes;
}

/// Encodes and decodes `decisions` in a single context. The two clues for decision i are two hashes
/// of the return value of of(i). Returns the encoded bytes.
template <class Of>
std::vector<std::byte> coded(const std::vector<bool>& decisions, Of&& of) {
  return both_ways([&](auto& coder) {
    MixedBit model;
    for (std::size_t i = 0; i < decisions.size(); ++i) {
      coder.about(0, clue(of(i)), clue(of(i), 7));
      const bool wanted = decisions[i];
      ASSERT_EQ(coder.bit(model, std::decay_t<decltype(coder)>::kDecodes ? false : wanted), wanted);
    }
  });
}

std::vector<bool> random_bits(std::size_t count, double share) {
  std::mt19937_64 random(5);
  std::vector<bool> bits(count);
  for (std::size_t i = 0; i < count; ++i)
    bits[i] = static_cast<double>(random() >> 11) < share * 0x1p53;
  return bits;
}

TEST(Mixing, NoiseCostsLittleMoreThanNoise) {
  for (const double share : {.5, .1, .01}) {
    const auto bits = random_bits(100000, share);
    const double entropy = -share * std::log2(share) - (1 - share) * std::log2(1 - share);
    const auto bytes = coded(bits, [](std::size_t i) { return i % 5; });
    EXPECT_LT(8. * static_cast<double>(bytes.size()), 1.02 * 100000 * entropy + 800) << share;
  }
  EXPECT_LT(coded(random_bits(100000, 0), [](std::size_t) { return 0; }).size(), 40u);
}

TEST(Mixing, CluesAndHistoryArePutToUse) {
  const auto noise = random_bits(20000, .5);
  std::vector<bool> copies(noise.size()), waves(noise.size());
  for (std::size_t i = 0; i < noise.size(); ++i) {
    copies[i] = noise[i];
    waves[i] = i / 3 % 2 == 0;
  }
  // Each decision in `copies` can be predicted from its clue. Each decision in `waves` can be
  // predicted from the previous decisions.
  EXPECT_LT(coded(copies, [&](std::size_t i) { return noise[i] ? 1 : 2; }).size(), 60u);
  EXPECT_LT(coded(waves, [](std::size_t) { return 0; }).size(), 60u);
}

TEST(Mixing, NumbersInTreesAndRunsBothWays) {
  std::mt19937_64 random(3);
  std::vector<std::uint64_t> numbers(3000);
  for (auto& it : numbers) it = random() >> (random() % 64);
  both_ways([&](auto& coder) {
    using Coder = std::decay_t<decltype(coder)>;
    const auto number = std::make_unique<NumberModelOf<MixedBit>>();
    TreeModel<3, MixedBit> tree;
    ChoiceModel<4, MixedBit> choice;
    for (const std::uint64_t it : numbers) {
      coder.about(1, clue(it % 3));
      ASSERT_EQ(code_number(coder, *number, Coder::kDecodes ? 0 : it), it);
      const auto small = static_cast<std::uint32_t>(it % 8);
      coder.about(0);
      ASSERT_EQ(code_tree(coder, tree, Coder::kDecodes ? 0 : small), small);
      ASSERT_EQ(code_choice(coder, choice, 8, Coder::kDecodes ? 0 : small), small);
    }
  });
}

TEST(Mixing, EveryClueIsATableEntryOfItsOwnUntilTheTableIsFull) {
  // The test uses more different clues than the coder's table has entries. Table entries are
  // therefore replaced, but decoding must still be correct.
  const auto bits = random_bits(300000, .3);
  const auto bytes = coded(bits, [](std::size_t i) { return i; });
  EXPECT_LT(8. * static_cast<double>(bytes.size()), 300000 * .8813 * 1.03);
}

TEST(Mixing, PinnedBytes) {
  const auto bits = random_bits(5000, .2);
  const auto bytes = coded(bits, [&](std::size_t i) { return i % 7 + (bits[i] ? 1u : 0u); });
  EXPECT_EQ(checksum(bytes), 1238585550u) << bytes.size();
}

}  // namespace
}  // namespace shm
