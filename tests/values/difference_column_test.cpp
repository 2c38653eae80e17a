// Tests of values that are coded as differences along vertex or cell numbers. All values must be
// restored bit for bit, whatever the numbers are. Smooth values must need few bytes, error bounds
// must hold, and damaged bytes must be handled safely.
#include "codecs/shifts/difference_column.h"
#include "codecs/shared/codec_id.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "support/sanitized.h"
#include "values/appended_value.h"

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;
using Numbers = std::vector<std::uint64_t>;
using Lags = std::vector<std::uint32_t>;

ArrayInfo info_of(ScalarType type, std::uint32_t components = 1) {
  ArrayInfo info;
  info.type = type;
  info.components = components;
  return info;
}
std::size_t stride_of(const ArrayInfo& info) { return scalar_bytes(info.type) * info.components; }

struct Group {
  Numbers numbers;
  Bytes values;
  Lags lags;
};

constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 30;

DifferenceScratch& scratch() {
  static DifferenceScratch it;
  return it;
}

DifferenceColumn::Encoded encode(DifferenceColumn& column, const Group& group, std::size_t stride) {
  static ZstdCompressor packing;
  return column.encode(group.numbers, group.values.data(), stride, group.lags, scratch(), packing);
}
bool begin(DifferenceColumn& column, Codec codec, std::span<const std::byte> bytes,
           std::uint64_t limit = kNoLimit) {
  static ZstdDecompressor unpacking;
  return column.begin_group(codec, bytes, limit, unpacking);
}
bool decode_some(DifferenceColumn& column, std::span<const std::uint64_t> numbers, Bytes& out) {
  return column.decode(numbers, out, scratch());
}

/// Decodes the values in several pieces, as a reader does. Returns an empty optional if the bytes
/// are invalid.
std::optional<Bytes> decode(DifferenceColumn& column, const DifferenceColumn::Encoded& encoded,
                            const Numbers& numbers) {
  if (!begin(column, encoded.codec, encoded.bytes)) return std::nullopt;
  Bytes out;
  std::size_t piece = 1;
  for (std::size_t at = 0; at < numbers.size(); at += std::exchange(piece, 3 * piece % 5000 + 1))
    if (!decode_some(column, std::span(numbers).subspan(at, std::min(piece, numbers.size() - at)),
                     out))
      return std::nullopt;
  if (!column.at_end()) return std::nullopt;
  return out;
}

/// Encodes the groups and checks that they decode correctly. Returns the encoded groups.
std::vector<DifferenceColumn::Encoded> expect_back(const ArrayInfo& info,
                                                   const std::vector<Group>& groups,
                                                   bool may_differ = true) {
  DifferenceColumn encoder(info, may_differ), decoder(info, may_differ);
  std::vector<DifferenceColumn::Encoded> all;
  for (const Group& group : groups) {
    all.push_back(encode(encoder, group, stride_of(info)));
    EXPECT_TRUE(decoder.takes(all.back().codec));
    const auto back = decode(decoder, all.back(), group.numbers);
    EXPECT_TRUE(back.has_value());
    if (back) {
      EXPECT_TRUE(*back == group.values)
          << scalar_name(info.type) << " x " << info.components << ", group " << all.size() - 1;
    }
  }
  return all;
}

// --- numbers

constexpr std::uint64_t kRow = 21, kLayer = 21 * 17;
const Lags kLags = {1, kRow, kLayer};

/// Returns consecutive numbers for the elements of a grid with rows and layers.
Numbers in_rows(std::uint64_t layers = 13, std::uint64_t first = 0) {
  Numbers numbers(kLayer * layers);
  std::iota(numbers.begin(), numbers.end(), first);
  return numbers;
}
Numbers shuffled(Numbers numbers) {
  std::mt19937_64 random(1);
  std::shuffle(numbers.begin(), numbers.end(), random);
  return numbers;
}
/// Returns element numbers that are far apart, so that the coder knows few elements with numbers
/// close to that of the current element. Some numbers occur more than once. Some numbers use the
/// same place in the coder's table of kMostPlaces recent numbers and overwrite each other.
Numbers sparse() {
  Numbers numbers;
  std::mt19937_64 random(2);
  for (std::uint64_t n = 0; n < 600; ++n) {
    numbers.push_back(n);
    numbers.push_back(n + kMostPlaces);
    numbers.push_back(n * (kMostPlaces + 1));
    numbers.push_back(~n);
    numbers.push_back(random());
    numbers.push_back(n / 2);
  }
  return numbers;
}
std::vector<Numbers> all_numbers() {
  return {in_rows(),
          shuffled(in_rows()),
          sparse(),
          in_rows(13, ~std::uint64_t{0} - 2000),
          {~std::uint64_t{0}},
          {0},
          {5, 5, 5}};
}

// --- values

template <class Value>
Bytes values_of(const ArrayInfo& info, const Numbers& numbers, Value&& value) {
  Bytes bytes;
  for (std::uint64_t number : numbers)
    for (std::uint32_t c = 0; c < info.components; ++c)
      append_value(bytes, info.type, value(number, c));
  return bytes;
}
Bytes noise(std::size_t size) {
  std::mt19937_64 random(3);
  Bytes bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random());
  return bytes;
}

double place(std::uint64_t number, std::uint64_t lag, std::uint64_t end) {
  return static_cast<double>(number / lag % end);
}
/// Stays in the range of every type.
double smooth(std::uint64_t number, std::uint32_t c) {
  const double x = place(number, 1, kRow), y = place(number, kRow, 17),
               z = place(number, kLayer, 99);
  return 40.0 * std::sin(0.1 * x + 0.05 * y + c) + 0.01 * z * y - 2.0 * c;
}

template <class T>
T scalar_at(const Bytes& values, std::size_t at) {
  T value;
  std::memcpy(&value, values.data() + at * sizeof value, sizeof value);
  return value;
}

/// Head of a stream of differences.
struct Head {
  std::uint64_t count = 0;
  std::vector<Factor> factors;
  struct Component {
    DomainKind kind = DomainKind::floats;
    std::int64_t exponent = 0;
    std::uint8_t width = 0;
  };
  std::vector<Component> components;
};
Head head_of(const DifferenceColumn::Encoded& encoded, std::uint32_t components) {
  EXPECT_EQ(encoded.codec, Codec::differences);
  ByteReader in(encoded.bytes);
  Head head;
  head.count = in.get_varint();
  head.factors.resize(in.get_u8());
  for (Factor& factor : head.factors) {
    factor.lag = in.get_varint32();
    factor.order = in.get_u8();
  }
  head.components.resize(components);
  for (Head::Component& it : head.components) {
    it.kind = static_cast<DomainKind>(in.get_u8());
    it.exponent = in.get_signed();
    it.width = in.get_u8();
  }
  EXPECT_TRUE(in.ok());
  return head;
}
std::vector<DomainKind> kinds_of(const DifferenceColumn::Encoded& encoded,
                                 std::uint32_t components) {
  std::vector<DomainKind> kinds;
  for (const auto& it : head_of(encoded, components).components) kinds.push_back(it.kind);
  return kinds;
}

// --- taps

/// List of pairs (distance, weight). A prediction is a weighted sum of earlier values. Each
/// distance states how far back a value is.
using Taps = std::vector<std::pair<std::uint64_t, std::int64_t>>;
Taps taps(const std::vector<Factor>& factors) {
  Taps list;
  for (const Tap& tap : taps_of(factors)) list.push_back({tap.back, tap.count});
  return list;
}

TEST(Taps, AreProductsOfDifferences) {
  EXPECT_EQ(taps({}), Taps());
  EXPECT_EQ(taps({{1, 1}}), (Taps{{1, 1}}));
  EXPECT_EQ(taps({{5, 1}}), (Taps{{5, 1}}));
  EXPECT_EQ(taps({{5, 2}}), (Taps{{10, -1}, {5, 2}}));
  EXPECT_EQ(taps({{1, 3}}), (Taps{{3, 1}, {2, -3}, {1, 3}}));
  EXPECT_EQ(taps({{1, 1}, {10, 1}}), (Taps{{11, -1}, {10, 1}, {1, 1}}));
  EXPECT_EQ(taps({{10, 1}, {1, 1}}), (Taps{{11, -1}, {10, 1}, {1, 1}}));
  EXPECT_EQ(taps({{1, 1}, {1, 1}}), (Taps{{2, -1}, {1, 2}}));
  // Terms whose factors cancel are left out.
  EXPECT_EQ(taps({{1, 2}, {2, 1}}), (Taps{{4, 1}, {3, -2}, {1, 2}}));
  // The longest lags that can be encoded.
  const std::uint64_t longest = 0xffffffff;
  EXPECT_EQ(taps({{0xffffffff, 3}}), (Taps{{3 * longest, 1}, {2 * longest, -3}, {longest, 3}}));
  // If all earlier values are equal, the prediction must be the same value. The weights of the taps
  // must therefore add up to 1.
  for (std::uint32_t a = 1; a <= kMostOrder; ++a)
    for (std::uint32_t b = 1; b <= kMostOrder; ++b)
      for (std::uint32_t c = 1; c <= kMostOrder; ++c) {
        std::int64_t sum = 0;
        for (const auto& [back, count] : taps({{1, a}, {kRow, b}, {kLayer, c}})) sum += count;
        EXPECT_EQ(sum, 1);
      }
}

TEST(KnownNumbers, UntilOneTakesTheirPlace) {
  KnownNumbers known;
  known.clear(kMostPlaces);
  EXPECT_FALSE(known.has(0));
  known.add(7);
  EXPECT_TRUE(known.has(7));
  EXPECT_FALSE(known.has(7 + kMostPlaces));
  known.add(7 + kMostPlaces);
  EXPECT_FALSE(known.has(7));
  EXPECT_TRUE(known.has(7 + kMostPlaces));
  known.clear(kMostPlaces);
  EXPECT_FALSE(known.has(7 + kMostPlaces));
}

// --- round trips

TEST(DifferenceColumn, EveryBitOfEveryType) {
  for (int t = 1; t <= 10; ++t)
    for (std::uint32_t components : {1u, 2u, 3u, 9u}) {
      if (kSanitized && components == 2) continue;
      const ArrayInfo info = info_of(static_cast<ScalarType>(t), components);
      for (const Numbers& numbers : all_numbers())
        for (const Lags& lags : {kLags, Lags{}, Lags{2, kMostPlaces - 1}}) {
          if (components > 1 && lags.size() != 3) continue;
          const Group wild{numbers, noise(numbers.size() * stride_of(info)), lags};
          const Group tame{numbers, values_of(info, numbers, smooth), lags};
          expect_back(info, {tame});
          expect_back(info, {wild, tame, wild});
        }
    }
}

TEST(DifferenceColumn, WithoutDifferences) {
  for (int t = 1; t <= 10; ++t)
    for (std::uint32_t components : {1u, 3u}) {
      const ArrayInfo info = info_of(static_cast<ScalarType>(t), components);
      const Group tame{in_rows(), values_of(info, in_rows(), smooth), kLags};
      for (const auto& encoded : expect_back(info, {tame, tame}, false))
        EXPECT_EQ(encoded.codec, Codec::shuffled_zstd);
      EXPECT_FALSE(DifferenceColumn(info, false).takes(Codec::differences));
    }
}

TEST(DifferenceColumn, ManyComponents) {
  const ArrayInfo info = info_of(ScalarType::int16, 31);
  const Group tame{in_rows(3), values_of(info, in_rows(3), smooth), kLags};
  expect_back(info, {tame, tame});
}

/// Encodes and decodes these values, repeated many times in every component, and checks that they
/// are restored.
template <class T>
void expect_back_all(ScalarType type, const std::vector<T>& odd) {
  for (std::uint32_t components : {1u, 2u, 3u}) {
    const ArrayInfo info = info_of(type, components);
    for (const Numbers& numbers : {in_rows(2), shuffled(in_rows(2)), sparse()}) {
      std::mt19937_64 random(4);
      Group any{numbers, {}, kLags}, some = any;
      any.values.resize(numbers.size() * stride_of(info));
      some.values = values_of(info, numbers, smooth);
      for (std::size_t i = 0; i < numbers.size() * components; ++i) {
        const T value = odd[random() % odd.size()];
        std::memcpy(any.values.data() + i * sizeof(T), &value, sizeof(T));
        if (random() % 50 == 0) std::memcpy(some.values.data() + i * sizeof(T), &value, sizeof(T));
      }
      expect_back(info, {some, any, some});
    }
  }
}

TEST(DifferenceColumn, ValuesAtTheEnds) {
  expect_back_all<std::int8_t>(ScalarType::int8, {-128, 127, 0, -1});
  expect_back_all<std::uint8_t>(ScalarType::uint8, {0, 255, 128});
  expect_back_all<std::int16_t>(ScalarType::int16, {-32768, 32767, 0});
  expect_back_all<std::uint16_t>(ScalarType::uint16, {0, 65535, 32768});
  constexpr auto kLeast32 = std::numeric_limits<std::int32_t>::min();
  expect_back_all<std::int32_t>(ScalarType::int32, {kLeast32, ~kLeast32, 0, -1});
  expect_back_all<std::uint32_t>(ScalarType::uint32, {0, ~0u, 1u << 31});
  constexpr auto kLeast64 = std::numeric_limits<std::int64_t>::min();
  expect_back_all<std::int64_t>(ScalarType::int64, {kLeast64, ~kLeast64, 0, -1, kLargestIndex + 1});
  expect_back_all<std::uint64_t>(ScalarType::uint64,
                                 {0, ~std::uint64_t{0}, std::uint64_t{1} << 63, 1});
}

TEST(DifferenceColumn, OddFloats) {
  std::vector<std::uint32_t> narrow = {0x80000000, 0x00000000, 0x7f800000, 0xff800000,
                                       0x7fc00000, 0xffc00123, 0x7f800001, 0x00000001,
                                       0x80000001, 0x7f7fffff, 0xff7fffff, 0xffffffff};
  std::vector<std::uint64_t> wide;
  for (const std::uint32_t it : narrow)
    wide.push_back(std::uint64_t{it} << 32 | (it & 1 ? 0xffffffff : 0));
  expect_back_all(ScalarType::float32, narrow);
  expect_back_all(ScalarType::float64, wide);
  // In the first call below, all doubles can be represented exactly as float32. In the second call,
  // some cannot. In the third call, the values are multiples of 0.1, and -0.0.
  expect_back_all<double>(ScalarType::float64, {1.5f, .1f, 3e38f, 1e-40f, -0.0});
  expect_back_all<double>(ScalarType::float64, {1.5f, .1f, 1e39, 1e-50});
  expect_back_all<double>(ScalarType::float64, {.1, .2, -0.0});
  expect_back_all<float>(ScalarType::float32, {.5f, .25f, -0.0f, 3e7f});
}

// --- domains

struct DomainCase {
  const char* name;
  ScalarType type;
  double (*value)(double smooth);
  DomainKind kind;
};
double whole(double v) { return std::floor(1000 * v); }
const DomainCase kDomainCases[] = {
    {"decimal", ScalarType::float64, [](double v) { return whole(v) / 100; }, DomainKind::decimal},
    {"decimal, float32", ScalarType::float32, [](double v) { return whole(v) / 100; },
     DomainKind::decimal},
    {"thousands", ScalarType::float64, [](double v) { return whole(v) * 1000; },
     DomainKind::decimal},
    {"binary", ScalarType::float64, [](double v) { return whole(v) / 4096; }, DomainKind::binary},
    {"binary, float32", ScalarType::float32, [](double v) { return whole(v) / 1024; },
     DomainKind::binary},
    {"float32 in float64", ScalarType::float64,
     [](double v) { return static_cast<double>(static_cast<float>(std::exp(v / 2))); },
     DomainKind::narrow},
    {"floats", ScalarType::float64, [](double v) { return v; }, DomainKind::floats},
    {"floats, float32", ScalarType::float32, [](double v) { return v; }, DomainKind::floats},
    {"integers", ScalarType::int32, whole, DomainKind::integers},
    {"integers, 64 bits", ScalarType::uint64, whole, DomainKind::integers},
};

TEST(DifferenceColumn, DomainsAreFound) {
  for (const DomainCase& domain_case : kDomainCases) {
    SCOPED_TRACE(domain_case.name);
    for (const std::uint32_t components : {1u, 3u}) {
      const ArrayInfo info = info_of(domain_case.type, components);
      Group group{in_rows(), {}, kLags};
      group.values = values_of(info, group.numbers, [&](std::uint64_t number, std::uint32_t c) {
        return domain_case.value(smooth(number, c));
      });
      const auto encoded = expect_back(info, {group})[0];
      EXPECT_EQ(kinds_of(encoded, components),
                std::vector<DomainKind>(components, domain_case.kind));
      EXPECT_EQ(head_of(encoded, components).count, group.numbers.size());
      EXPECT_LE(3 * encoded.bytes.size(), 2 * group.values.size());
    }
  }
}

TEST(DifferenceColumn, ComponentsArePredictedInOneWay) {
  const ArrayInfo info = info_of(ScalarType::float64, 3);
  const auto with = [&](std::array<const DomainCase*, 3> cases) {
    Group group{in_rows(), {}, kLags};
    group.values = values_of(info, group.numbers, [&](std::uint64_t number, std::uint32_t c) {
      return cases[c]->value(smooth(number, c));
    });
    return kinds_of(expect_back(info, {group})[0], 3);
  };
  using enum DomainKind;
  const auto& decimals = kDomainCases[0];
  const auto& binaries = kDomainCases[3];
  const auto& narrows = kDomainCases[5];
  const auto& any = kDomainCases[6];
  EXPECT_EQ(with({&decimals, &binaries, &decimals}),
            (std::vector<DomainKind>{decimal, binary, decimal}));
  const std::vector<DomainKind> all_floats(3, floats);
  EXPECT_EQ(with({&decimals, &any, &decimals}), all_floats);
  EXPECT_EQ(with({&any, &decimals, &decimals}), all_floats);
  EXPECT_EQ(with({&any, &narrows, &narrows}), all_floats);
  EXPECT_EQ(with({&decimals, &decimals, &narrows}), all_floats);
}

TEST(DifferenceColumn, GroupsWhoseDomainsChange) {
  for (const ScalarType type : {ScalarType::float64, ScalarType::float32, ScalarType::int32}) {
    std::vector<const DomainCase*> cases;
    for (const DomainCase& domain_case : kDomainCases)
      if (domain_case.type == type) cases.push_back(&domain_case);
    std::mt19937_64 random(5);
    for (const std::uint32_t components : {1u, 2u, 3u}) {
      const ArrayInfo info = info_of(type, components);
      std::vector<Group> groups;
      for (int g = 0; g < 24; ++g) {
        Group group{in_rows(1 + random() % 3, random() % 5 * kLayer), {}, kLags};
        const std::size_t which = g / 2 % (cases.size() + 1);
        if (which == cases.size())
          group.values = noise(group.numbers.size() * stride_of(info));
        else
          group.values = values_of(info, group.numbers, [&](std::uint64_t number, std::uint32_t c) {
            return cases[which]->value(smooth(number, c));
          });
        groups.push_back(std::move(group));
      }
      expect_back(info, groups);
    }
  }
}

TEST(DifferenceColumn, WhatIsKnownServesTheNextGroup) {
  const ArrayInfo info = info_of(ScalarType::float64, 3);
  const auto layers = [&](std::uint64_t first, std::uint64_t count) {
    Group group{in_rows(count, first * kLayer), {}, kLags};
    group.values = values_of(info, group.numbers, smooth);
    return group;
  };
  const std::size_t alone = expect_back(info, {layers(8, 1)})[0].bytes.size();
  const auto in_turn = expect_back(info, {layers(0, 8), layers(8, 1)});
  EXPECT_LE(10 * in_turn[1].bytes.size(), 9 * alone);
}

TEST(DifferenceColumn, TheSameBytesTwice) {
  for (const DomainCase& domain_case : kDomainCases) {
    const ArrayInfo info = info_of(domain_case.type, 2);
    Group group{shuffled(in_rows()), {}, kLags};
    group.values = values_of(info, group.numbers, [&](std::uint64_t number, std::uint32_t c) {
      return domain_case.value(smooth(number, c));
    });
    const auto one = expect_back(info, {group, group}), two = expect_back(info, {group, group});
    for (std::size_t g = 0; g < 2; ++g) {
      EXPECT_EQ(one[g].codec, two[g].codec);
      EXPECT_EQ(one[g].bytes, two[g].bytes);
    }
  }
}

// --- sizes

TEST(DifferenceColumn, SmoothValuesCostLittle) {
  const auto share = [](const ArrayInfo& info, const Group& group) {
    return static_cast<double>(expect_back(info, {group})[0].bytes.size()) /
           static_cast<double>(group.values.size());
  };
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64}) {
    const ArrayInfo info = info_of(type, 3);
    Group group{in_rows(), {}, kLags};
    // The values are the coordinates of the vertices of a box with a grid spacing of 0.01.
    group.values = values_of(info, group.numbers, [](std::uint64_t number, std::uint32_t c) {
      return (c == 0   ? place(number, 1, kRow)
              : c == 1 ? place(number, kRow, 17)
                       : place(number, kLayer, 99)) /
             100;
    });
    EXPECT_LE(share(info, group), .01);
    // Predictions from several distances back (lags) must not increase the size of smooth values.
    group.values = values_of(info, group.numbers, smooth);
    const double in_order = share(info, group);
    EXPECT_LE(in_order, type == ScalarType::float32 ? .55 : .75);
    group.lags = {};
    EXPECT_LE(in_order, share(info, group));
  }
  const ArrayInfo info = info_of(ScalarType::int32);
  Group group{in_rows(), {}, kLags};
  group.values = values_of(info, group.numbers, [](std::uint64_t number, std::uint32_t) {
    return 1000 * place(number, 1, kRow) * place(number, kRow, 17) - static_cast<double>(number);
  });
  EXPECT_LE(share(info, group), .02);
}

TEST(DifferenceColumn, NamesOfMaterialsAreLeftToZstd) {
  const ArrayInfo info = info_of(ScalarType::int32);
  std::mt19937_64 random(6);
  Group group{in_rows(), {}, kLags};
  std::array<std::int32_t, 4> names = {7000001, -5, 123456789, 4};
  for (std::size_t e = 0; e < group.numbers.size(); ++e) {
    const std::int32_t name = names[random() % 4];
    const auto bytes = std::as_bytes(std::span(&name, 1));
    group.values.insert(group.values.end(), bytes.begin(), bytes.end());
  }
  Group tame = group;
  tame.values = values_of(info, tame.numbers, smooth);
  const auto encoded = expect_back(info, {tame, group, tame});
  EXPECT_EQ(encoded[0].codec, Codec::differences);
  EXPECT_EQ(encoded[1].codec, Codec::shuffled_zstd);
  EXPECT_LE(2 * encoded[1].bytes.size(), group.values.size());
  EXPECT_EQ(encoded[2].codec, Codec::differences);
}

// --- quantized values

/// Checks that errors are within the bound, and that NaNs and infinities are restored bit for bit.
template <class T>
void expect_bound(const ArrayInfo& info, const std::vector<Group>& groups) {
  DifferenceColumn encoder(info, true), decoder(info, true);
  const double bound = info.quantization.max_error(info.type);
  for (const Group& group : groups) {
    const auto encoded = encode(encoder, group, stride_of(info));
    const auto back = decode(decoder, encoded, group.numbers);
    ASSERT_TRUE(back.has_value());
    ASSERT_EQ(back->size(), group.values.size());
    for (std::size_t i = 0; i < group.values.size() / sizeof(T); ++i) {
      const T was = scalar_at<T>(group.values, i), is = scalar_at<T>(*back, i);
      if (std::isfinite(was)) {
        ASSERT_LE(std::fabs(static_cast<double>(is) - static_cast<double>(was)), bound) << was;
      } else {
        ASSERT_EQ(std::memcmp(&was, &is, sizeof(T)), 0);
      }
    }
  }
}

template <class T>
void expect_bounds(ScalarType type) {
  std::mt19937_64 random(7);
  const std::vector<T> odd = {
      std::numeric_limits<T>::infinity(),   -std::numeric_limits<T>::infinity(),
      std::numeric_limits<T>::quiet_NaN(),  -std::numeric_limits<T>::quiet_NaN(),
      std::numeric_limits<T>::max(),        static_cast<T>(-0.0),
      std::numeric_limits<T>::denorm_min(), static_cast<T>(1e20)};
  for (const std::uint32_t components : {1u, 2u, 3u}) {
    ArrayInfo info = info_of(type, components);
    Group tame{in_rows(4), values_of(info, in_rows(4), smooth), kLags}, wild = tame;
    for (int n = 0; n < 60; ++n) {
      const T value = odd[random() % odd.size()];
      const std::size_t at = random() % (wild.values.size() / sizeof(T));
      std::memcpy(wild.values.data() + at * sizeof(T), &value, sizeof(T));
    }
    const std::vector<Group> groups = {tame, wild, wild, tame, tame};
    for (const std::uint32_t bits : {1u, 8u, 16u, 24u, 40u, 52u}) {
      info.quantization = {bits, std::vector<double>(components, -50),
                           std::vector<double>(components, 50)};
      expect_bound<T>(info, groups);
      if (bits > 16) continue;
      DifferenceColumn column(info, true);
      const auto encoded = encode(column, tame, stride_of(info));
      EXPECT_EQ(kinds_of(encoded, components),
                std::vector<DomainKind>(components, DomainKind::quantized));
      EXPECT_LE(encoded.bytes.size(), tame.values.size() * bits / (8 * sizeof(T)));
    }
    for (const double bound : {10.0, .1, 1e-4, 1e-9, 1e-13}) {
      info.quantization = Quantization::absolute(bound, components);
      expect_bound<T>(info, groups);
      info.quantization.spacing = 1.3 * bound;
      info.quantization.minimum.assign(components, -3);
      expect_bound<T>(info, groups);
    }
  }
}

TEST(DifferenceColumn, BoundsHold) {
  expect_bounds<float>(ScalarType::float32);
  expect_bounds<double>(ScalarType::float64);
}

// --- damage

/// Decodes all values and tries to read beyond the last value.
void read_all(const ArrayInfo& info, Codec codec, std::span<const std::byte> bytes,
              const Numbers& numbers) {
  DifferenceColumn column(info, true);
  // An exact-size copy, so that a read past the end is detected.
  const Bytes copy(bytes.begin(), bytes.end());
  if (!begin(column, codec, copy, 2 * numbers.size() * stride_of(info))) return;
  Bytes out;
  for (const std::uint64_t& number : numbers)
    if (!decode_some(column, {&number, 1}, out)) break;
  ASSERT_EQ(out.size() % stride_of(info), 0u);
  (void)column.at_end();
}

TEST(DifferencesDamaged, CutsAndChanges) {
  const Numbers numbers = in_rows(1);
  for (const auto& [type, components] :
       {std::pair(ScalarType::float64, 3u), std::pair(ScalarType::float32, 1u),
        std::pair(ScalarType::int16, 2u)}) {
    ArrayInfo info = info_of(type, components);
    for (const bool quantized : {false, true}) {
      if (quantized && !is_float(type)) continue;
      if (quantized) info.quantization = Quantization::absolute(.01, components);
      const Group group{numbers, values_of(info, numbers, smooth), kLags};
      for (const bool may_differ : {true, false}) {
        if (quantized && !may_differ) continue;
        DifferenceColumn encoder(info, may_differ);
        auto encoded = encode(encoder, group, stride_of(info));
        for (std::size_t size = 0; size < encoded.bytes.size(); ++size) {
          DifferenceColumn column(info, true);
          EXPECT_FALSE(begin(column, encoded.codec, std::span(encoded.bytes).first(size))) << size;
        }
        encoded.bytes.push_back(std::byte{0});
        DifferenceColumn column(info, true);
        EXPECT_FALSE(begin(column, encoded.codec, encoded.bytes));
        encoded.bytes.pop_back();
        for (std::size_t at = 0; at < encoded.bytes.size(); at += at < 40 ? 1 : 17)
          for (int change = 1; change < 256; change *= at < 40 ? 2 : 8) {
            encoded.bytes[at] ^= static_cast<std::byte>(change);
            read_all(info, encoded.codec, encoded.bytes, numbers);
            encoded.bytes[at] ^= static_cast<std::byte>(change);
          }
        // Decodes with the other codec.
        const Codec other =
            encoded.codec == Codec::differences ? Codec::shuffled_zstd : Codec::differences;
        read_all(info, other, encoded.bytes, numbers);
      }
    }
  }
}

/// A valid head, to be changed.
struct Words {
  std::uint64_t count = 4;
  std::vector<std::pair<std::uint64_t, int>> factors = {{1, 1}};
  std::optional<int> factor_count = {};
  struct Component {
    int kind = 5;
    std::int64_t exponent = 0;
    int width = 2;
  };
  std::vector<Component> components = {{}};
  std::size_t planes = 8;

  Bytes bytes() const {
    ByteWriter out;
    out.put_varint(count);
    out.put_u8(static_cast<std::uint8_t>(factor_count.value_or(static_cast<int>(factors.size()))));
    for (const auto& [lag, order] : factors) {
      out.put_varint(lag);
      out.put_u8(static_cast<std::uint8_t>(order));
    }
    for (const Component& it : components) {
      out.put_u8(static_cast<std::uint8_t>(it.kind));
      out.put_signed(it.exponent);
      out.put_u8(static_cast<std::uint8_t>(it.width));
    }
    out.put_bytes(zstd_compress(Bytes(planes, std::byte{1}), 1));
    return std::move(out.bytes);
  }
};

bool is_taken(const ArrayInfo& info, const Words& words, std::uint64_t limit = kNoLimit) {
  DifferenceColumn column(info, true);
  const Bytes bytes = words.bytes();
  if (!begin(column, Codec::differences, bytes, limit)) return false;
  Bytes out;
  const Numbers numbers = {1, 0, ~std::uint64_t{0}, 1 << 20};
  EXPECT_TRUE(decode_some(column, numbers, out));
  EXPECT_TRUE(column.at_end());
  EXPECT_FALSE(decode_some(column, std::span(numbers).first(1), out));
  return true;
}

TEST(DifferencesDamaged, LyingHeads) {
  const ArrayInfo info = info_of(ScalarType::int32);
  EXPECT_TRUE(is_taken(info, {}));
  EXPECT_TRUE(is_taken(info, {.factors = {}}));
  EXPECT_TRUE(is_taken(info, {.factors = {{0xffffffff, 3}, {1, 3}, {0xffffffff, 3}}}));
  EXPECT_TRUE(is_taken(info, {.components = {{.width = 0}}, .planes = 0}));
  EXPECT_TRUE(is_taken(info, {.components = {{.width = 4}}, .planes = 16}));

  EXPECT_FALSE(is_taken(info, {.factors = {{1, 1}, {2, 1}, {3, 1}, {4, 1}}}));
  EXPECT_FALSE(is_taken(info, {.factor_count = 255}));
  EXPECT_FALSE(is_taken(info, {.factors = {{0, 1}}}));
  EXPECT_FALSE(is_taken(info, {.factors = {{1, 0}}}));
  EXPECT_FALSE(is_taken(info, {.factors = {{1, 4}}}));
  EXPECT_FALSE(is_taken(info, {.factors = {{std::uint64_t{1} << 32, 1}}}));
  for (const int kind : {0, 1, 2, 3, 4, 6, 7, 255})
    EXPECT_FALSE(is_taken(info, {.components = {{.kind = kind}}})) << kind;
  EXPECT_FALSE(is_taken(info, {.components = {{.exponent = 1}}}));
  EXPECT_FALSE(is_taken(info, {.components = {{.width = 5}}, .planes = 20}));
  EXPECT_FALSE(is_taken(info, {.components = {{.width = 9}}, .planes = 36}));
  EXPECT_FALSE(is_taken(info, {.components = {{.width = 255}}, .planes = 1020}));
  for (const std::size_t planes : {0u, 7u, 9u})
    EXPECT_FALSE(is_taken(info, {.planes = planes})) << planes;
  EXPECT_FALSE(is_taken(info, {.components = {}}));

  EXPECT_TRUE(is_taken(info, {}, 16));
  EXPECT_FALSE(is_taken(info, {}, 15));
  for (const std::uint64_t count : {kNoLimit / 4, kNoLimit, ~std::uint64_t{0}}) {
    DifferenceColumn column(info, true);
    EXPECT_FALSE(begin(column, Codec::differences, Words{.count = count}.bytes())) << count;
  }
}

TEST(DifferencesDamaged, LyingDomains) {
  const auto taken = [](const ArrayInfo& info, int kind, std::int64_t exponent, int width = 2) {
    Words words;
    words.components[0] = {kind, exponent, width};
    words.planes = static_cast<std::size_t>(4 * width);
    return is_taken(info, words);
  };
  const ArrayInfo wide = info_of(ScalarType::float64), narrow = info_of(ScalarType::float32);
  EXPECT_TRUE(taken(wide, 0, 0, 8));
  EXPECT_FALSE(taken(wide, 0, 0, 9));
  EXPECT_TRUE(taken(narrow, 0, 0, 4));
  EXPECT_FALSE(taken(narrow, 0, 0, 5));
  EXPECT_FALSE(taken(wide, 0, 1));
  EXPECT_TRUE(taken(wide, 1, 0, 4));
  EXPECT_FALSE(taken(wide, 1, 0, 5));
  EXPECT_FALSE(taken(narrow, 1, 0));
  for (const ArrayInfo& info : {wide, narrow}) {
    for (const std::int64_t exponent : {-971, 0, 1074}) EXPECT_TRUE(taken(info, 2, exponent, 8));
    for (const std::int64_t exponent : {-22, 0, 22}) EXPECT_TRUE(taken(info, 3, exponent, 8));
    constexpr auto kLeast = std::numeric_limits<std::int64_t>::min();
    for (const std::int64_t exponent :
         {std::int64_t{-972}, std::int64_t{1075}, kLeast, ~kLeast, (std::int64_t{1} << 32) + 1}) {
      EXPECT_FALSE(taken(info, 2, exponent)) << exponent;
      EXPECT_FALSE(taken(info, 3, exponent)) << exponent;
    }
    EXPECT_FALSE(taken(info, 3, 23));
    EXPECT_FALSE(taken(info, 4, 5)) << "digits are not evenly spaced";
    EXPECT_FALSE(taken(info, 5, 0)) << "integers";
    EXPECT_FALSE(taken(info, 6, 0)) << "nothing is quantized";
  }
  ArrayInfo coarse = info_of(ScalarType::float32);
  coarse.quantization = Quantization::absolute(.5, 1);
  EXPECT_TRUE(taken(coarse, 6, 0, 8));
  EXPECT_TRUE(taken(coarse, 0, 0, 4)) << "values that are not quantized";
  for (const int kind : {1, 2, 3, 4, 5}) EXPECT_FALSE(taken(coarse, kind, 0)) << kind;
  // Both components must use the same kind of prediction; otherwise the values are refused.
  const ArrayInfo two = info_of(ScalarType::float64, 2);
  const auto both = [&](int a, int b) {
    return is_taken(two, {.components = {{a, 0, 1}, {b, 0, 1}}});
  };
  EXPECT_TRUE(both(0, 0));
  EXPECT_TRUE(both(1, 1));
  EXPECT_TRUE(both(2, 3));
  for (const auto& [a, b] : {std::pair(0, 1), std::pair(1, 0), std::pair(0, 2), std::pair(3, 0),
                             std::pair(1, 2), std::pair(2, 1)})
    EXPECT_FALSE(both(a, b)) << a << " and " << b;
}

TEST(DifferencesDamaged, AGroupThatHasNone) {
  const ArrayInfo info = info_of(ScalarType::float32, 3);
  DifferenceColumn column(info, true);
  Bytes out;
  column.begin_empty_group();
  EXPECT_TRUE(decode_some(column, {}, out));
  EXPECT_TRUE(column.at_end());
  const Numbers one = {1};
  EXPECT_FALSE(decode_some(column, one, out));
  EXPECT_TRUE(out.empty());
}

}  // namespace
}  // namespace shm
