#include "coders/step_values.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;

ArrayInfo info_of(ScalarType type, std::uint32_t components) {
  ArrayInfo info;
  info.type = type;
  info.components = components;
  info.per_step = true;
  return info;
}

TEST(StepValues, EveryBitOfEveryType) {
  std::mt19937_64 random(1);
  for (int t = 1; t <= 10; ++t)
    for (std::uint32_t components : {1u, 3u})
      for (std::uint32_t count : {1u, 2u, 500u})
        for (const bool wild : {true, false}) {
          const ArrayInfo info = info_of(static_cast<ScalarType>(t), components);
          Bytes values(count * components * scalar_bytes(info.type));
          for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = static_cast<std::byte>(wild ? random() : i / 64);
          const StepBytes coded = encode_step_values(info, values);
          const auto back = decode_step_values(info, coded.codec, coded.bytes, count);
          ASSERT_TRUE(back);
          EXPECT_EQ(*back, values);
          EXPECT_LE(coded.bytes.size(), values.size() + values.size() / 16 + 40);
        }
}

TEST(StepValues, TheSmallerCodecWins) {
  const ArrayInfo info = info_of(ScalarType::float64, 1);
  std::mt19937_64 random(2);
  std::vector<double> words(3000), line(3000);
  for (std::size_t i = 0; i < words.size(); ++i) {
    words[i] = static_cast<double>(i % 100) * 1.1e10 / 7;  // a pattern that comes again and again
    line[i] = 1 + static_cast<double>(i) * 0x1p-52;
  }
  const auto bytes = [](const std::vector<double>& v) { return std::as_bytes(std::span(v)); };
  EXPECT_EQ(encode_step_values(info, bytes(words)).codec, container::Codec::shuffled_zstd);
  EXPECT_EQ(encode_step_values(info, bytes(line)).codec, container::Codec::local);
}

TEST(StepValues, DamageIsRefused) {
  const ArrayInfo info = info_of(ScalarType::float32, 2);
  EXPECT_FALSE(decode_step_values(info, static_cast<container::Codec>(0), {}, 1));
  EXPECT_FALSE(decode_step_values(info, container::Codec::predictive, {}, 1));
  EXPECT_FALSE(decode_step_values(info, container::Codec::shuffled_zstd, {}, 1));
  std::vector<float> values(2000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 50) * .37f;
  const StepBytes coded = encode_step_values(info, std::as_bytes(std::span(values)));
  ASSERT_EQ(coded.codec, container::Codec::shuffled_zstd);
  EXPECT_TRUE(decode_step_values(info, coded.codec, coded.bytes, 1000));
  EXPECT_FALSE(decode_step_values(info, coded.codec, coded.bytes, 999));
  EXPECT_FALSE(decode_step_values(info, coded.codec, coded.bytes, 1001));
  EXPECT_FALSE(decode_step_values(info, coded.codec,
                                  std::span(coded.bytes).first(coded.bytes.size() - 1), 1000));
}

}  // namespace
}  // namespace shm
