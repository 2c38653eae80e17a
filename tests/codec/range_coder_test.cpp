// Tests of encoding and decoding with the range coder, its adaptive bits, and the models that are
// built from adaptive bits.
#include "entropy/range_coder.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "entropy/models.h"

namespace shm {
namespace {

/// Runs `work(coder)` with an encoder, then with a decoder of the encoded bytes.
template <class Work>
std::vector<std::byte> both_ways(Work&& work) {
  RangeEncoder encoder;
  work(encoder);
  std::vector<std::byte> bytes = encoder.finish();
  RangeDecoder decoder(bytes);
  work(decoder);
  return bytes;
}

TEST(AdaptiveBit, BeginsEvenAndFollowsWhatItSees) {
  AdaptiveBit bit;
  EXPECT_EQ(bit.probability_of_one(), 32768u);
  bit.update(true);
  EXPECT_GT(bit.probability_of_one(), 50000u);
  for (int i = 0; i < 100000; ++i) bit.update(true);
  EXPECT_LE(bit.probability_of_one(), 65535u);
  EXPECT_GT(bit.probability_of_one(), 65400u);
  for (int i = 0; i < 100000; ++i) bit.update(false);
  EXPECT_GE(bit.probability_of_one(), 1u);
  EXPECT_LT(bit.probability_of_one(), 100u);
}

TEST(AdaptiveBit, FindsTheShare) {
  std::mt19937_64 random(1);
  AdaptiveBit bit;
  double sum = 0;
  for (int i = 0; i < 20000; ++i) {
    bit.update(random() % 10 < 3);
    if (i >= 10000) sum += bit.probability_of_one();
  }
  EXPECT_NEAR(sum / 10000 / 65536, .3, .02);
}

// Frozen: files depend on every step.
TEST(AdaptiveBit, PinnedSteps) {
  AdaptiveBit bit;
  std::vector<std::uint32_t> steps;
  for (bool one : {true, true, false, true, false, false, false, true}) {
    bit.update(one);
    steps.push_back(bit.probability_of_one());
  }
  EXPECT_EQ(steps,
            (std::vector<std::uint32_t>{54612, 58982, 42130, 47331, 38726, 32768, 28399, 32768}));
}

TEST(RangeCoder, NothingIsNoBytes) {
  RangeEncoder encoder;
  EXPECT_TRUE(encoder.finish().empty());
}

TEST(RangeCoder, BitsOfEveryShare) {
  for (unsigned share : {0u, 1u, 50u, 500u, 950u, 999u, 1000u}) {
    std::mt19937_64 random(share);
    std::vector<bool> values(20000);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = random() % 1000 < share;
    const auto bytes = both_ways([&, model = AdaptiveBit()](auto& coder) mutable {
      model = {};
      for (bool value : values) ASSERT_EQ(coder.bit(model, value), value);
    });
    const double p = share / 1000.0;
    const double entropy = share % 1000 == 0 ? 0 : -(p * std::log2(p) + (1 - p) * std::log2(1 - p));
    EXPECT_LE(static_cast<double>(bytes.size()), (entropy * 1.02 + .01) * 20000 / 8 + 20) << share;
  }
}

TEST(RangeCoder, RawBitsOfEveryCount) {
  std::mt19937_64 random(2);
  std::vector<std::pair<std::uint64_t, int>> values;
  for (int n = 0; n < 3000; ++n) {
    const int count = n % 65;
    values.emplace_back(count == 0 ? 0 : random() >> (64 - count), count);
  }
  for (int count = 1; count <= 64; ++count) {
    values.emplace_back(~std::uint64_t{0} >> (64 - count), count);
    values.emplace_back(0, count);
  }
  std::size_t bits = 0;
  for (const auto& [value, count] : values) bits += static_cast<std::size_t>(count);
  const auto bytes = both_ways([&](auto& coder) {
    for (const auto& [value, count] : values) ASSERT_EQ(coder.raw(value, count), value) << count;
  });
  EXPECT_LE(bytes.size(), bits / 8 * 1001 / 1000 + 8);
}

// Tests long runs of 0xFF bytes, with and without a carry at the end of the run.
TEST(RangeCoder, CarriesThroughLongRuns) {
  for (std::uint64_t last : {0u, 1u, 0xffffu})
    for (int ones = 0; ones < 40; ++ones)
      both_ways([&](auto& coder) {
        AdaptiveBit model;
        ASSERT_EQ(coder.raw(0x7fff, 16), 0x7fffu);
        for (int i = 0; i < ones; ++i) ASSERT_EQ(coder.raw(0xffff, 16), 0xffffu);
        for (int i = 0; i < 5; ++i) ASSERT_FALSE(coder.bit(model, false));
        ASSERT_EQ(coder.raw(last, 16), last);
      });
}

TEST(RangeCoder, TheEncoderStartsAnewAfterFinish) {
  RangeEncoder encoder;
  const auto once = [&] {
    AdaptiveBit model;
    for (int i = 0; i < 100; ++i) encoder.bit(model, i % 3 == 0);
    return encoder.finish();
  };
  const auto first = once();
  EXPECT_EQ(once(), first);
}

// Any number of symbols can be decoded from arbitrary bytes, but the decoder never reads beyond the
// last byte.
TEST(RangeCoder, AnyBytesDecode) {
  std::mt19937_64 random(3);
  for (int n = 0; n < 200; ++n) {
    std::vector<std::byte> bytes(random() % 20);
    for (auto& b : bytes) b = static_cast<std::byte>(n % 3 == 0 ? 0xff : random());
    RangeDecoder decoder(bytes);
    NumberModel numbers;
    SignedModel<ResidualModel> residuals;
    TreeModel<3> tree;
    for (int i = 0; i < 100; ++i) {
      EXPECT_LT(code_tree(decoder, tree, 0), 8u);
      code_number(decoder, numbers, 0);
      code_signed(decoder, residuals, 0);
      EXPECT_LT(decoder.raw(0, 13), 1u << 13);
    }
  }
}

TEST(Models, NumbersOfEveryLength) {
  std::vector<std::uint64_t> values;
  std::mt19937_64 random(4);
  for (int bits = 0; bits <= 64; ++bits)
    for (int n = 0; n < 20; ++n) {
      const std::uint64_t low = bits == 0 ? 0 : std::uint64_t{1} << (bits - 1);
      values.push_back(n == 0      ? low
                       : n == 1    ? low | (low - (low > 0))
                       : bits == 0 ? 0
                                   : low | (random() & (low - 1)));
    }
  both_ways([&](auto& coder) {
    const auto numbers = std::make_unique<NumberModel>();
    const auto residuals = std::make_unique<ResidualModel>();
    for (std::uint64_t value : values) {
      ASSERT_EQ(code_number(coder, *numbers, value), value);
      ASSERT_EQ(code_number(coder, *residuals, value), value);
    }
  });
}

TEST(Models, SignedNumbers) {
  std::vector<std::int64_t> values = {0, 1, -1, std::numeric_limits<std::int64_t>::min(),
                                      std::numeric_limits<std::int64_t>::max()};
  std::mt19937_64 random(5);
  for (int n = 0; n < 2000; ++n)
    values.push_back(static_cast<std::int64_t>(random()) >> (random() % 64));
  both_ways([&](auto& coder) {
    const auto numbers = std::make_unique<SignedModel<NumberModel>>();
    const auto residuals = std::make_unique<SignedModel<ResidualModel>>();
    for (std::int64_t value : values) {
      ASSERT_EQ(code_signed(coder, *numbers, value), value);
      ASSERT_EQ(code_signed(coder, *residuals, value), value);
    }
  });
}

TEST(Models, TreesAndChoices) {
  std::mt19937_64 random(6);
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      choices;  // number of choices, and the choice
  for (int n = 0; n < 3000; ++n) {
    const auto count = static_cast<std::uint32_t>(1 + random() % 40);
    choices.emplace_back(count, random() % count);
  }
  both_ways([&](auto& coder) {
    TreeModel<1> one;
    TreeModel<6> six;
    ChoiceModel<4> four;
    for (const auto& [count, index] : choices) {
      ASSERT_EQ(code_tree(coder, one, index & 1), index & 1);
      ASSERT_EQ(code_tree(coder, six, index), index);
      ASSERT_EQ(code_choice(coder, four, count, index), index);
    }
  });
}

TEST(Models, TheOnlyCandidateCostsNothing) {
  RangeEncoder encoder;
  ChoiceModel<4> model;
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(code_choice(encoder, model, 1, 0), 0u);
  EXPECT_TRUE(encoder.finish().empty());
}

std::string hex(const std::vector<std::byte>& bytes) {
  std::string text;
  for (std::byte b : bytes)
    for (int shift : {4, 0}) text += "0123456789abcdef"[std::to_integer<unsigned>(b) >> shift & 15];
  return text;
}

// Frozen: the exact bytes of one stream that uses every model. Readers of old files depend on them.
TEST(Models, PinnedStream) {
  std::mt19937_64 random(7);
  std::vector<std::uint64_t> values;
  for (int n = 0; n < 24; ++n) values.push_back(random() >> (random() % 64));
  const auto bytes = both_ways([&](auto& coder) {
    const auto number = std::make_unique<NumberModel>();
    const auto residual = std::make_unique<SignedModel<ResidualModel>>();
    TreeModel<3> tree;
    ChoiceModel<2> choice;
    for (std::uint64_t value : values) {
      ASSERT_EQ(code_number(coder, *number, value % 1000), value % 1000);
      ASSERT_EQ(code_signed(coder, *residual, static_cast<std::int64_t>(value)),
                static_cast<std::int64_t>(value));
      ASSERT_EQ(code_tree(coder, tree, static_cast<std::uint32_t>(value & 7)), value & 7);
      ASSERT_EQ(code_choice(coder, choice, 5, static_cast<std::uint32_t>(value % 5)), value % 5);
      ASSERT_EQ(coder.raw(value & 0x1f, 5), value & 0x1f);
    }
  });
  EXPECT_EQ(hex(bytes),
            "f4bbc847d94cbc42f6871a2f0ed9979ebe7556236b017bc7cdf105fd853e011f068285f16b86fb19"
            "3ff75487637519857ab2d30d933918e355ccde41e413f83d06e591388bff378ac4f01a8f2bbab51b"
            "bf90b1c3c7df932ba5ab22b283be3be20284b22d5f7b42a31ec3b3b9c3be02bff1a5b74488942f79"
            "cb0735cd686f09253a42f700478c20048b07f4e33d2b0a7a0f16f7676e964f32f9b345ff40862f1a"
            "ba3ddba2b0514e1a79fe71c792d9cc2ef3184987466a206f98");
}

}  // namespace
}  // namespace shm
