// Tests of value spaces, translators and the choice of a domain. A domain maps values to integer
// indices. Indices must be in the order of the values, and each value must be computable from its
// index. If a value has no index in the domain, the functions must report it.

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "codecs/shared/value_domain.h"
#include "codecs/surface/plan/mode_choice.h"

namespace shm {
namespace {

using Limits = std::numeric_limits<double>;
constexpr double kNaN = Limits::quiet_NaN(), kInfinity = Limits::infinity();

TEST(NearestInteger, IsTheNearest) {
  EXPECT_EQ(nearest_integer(0.0), 0);
  EXPECT_EQ(nearest_integer(-0.0), 0);
  EXPECT_EQ(nearest_integer(0.5), 1);
  EXPECT_EQ(nearest_integer(-0.5), 0);
  EXPECT_EQ(nearest_integer(-0.6), -1);
  EXPECT_EQ(nearest_integer(-1.5), -1);
  EXPECT_EQ(nearest_integer(std::nextafter(0.5, 0.0)), 0);
  EXPECT_EQ(nearest_integer(-1e-300), 0);
  EXPECT_EQ(nearest_integer(kNaN), 0);
  EXPECT_EQ(nearest_integer(kInfinity), kLargestIndex);
  EXPECT_EQ(nearest_integer(-kInfinity), -kLargestIndex);
  EXPECT_EQ(nearest_integer(1e300), kLargestIndex);
  for (int bits = 0; bits <= 53; ++bits)
    for (std::int64_t by : {-1, 0, 1})
      for (std::int64_t sign : {-1, 1}) {
        const std::int64_t whole = sign * ((std::int64_t{1} << bits) + by);
        if (std::abs(whole) > kLargestIndex) continue;
        EXPECT_EQ(nearest_integer(static_cast<double>(whole)), whole);
        if (bits < 50) {
          EXPECT_EQ(nearest_integer(static_cast<double>(whole) + 0.25), whole);
          EXPECT_EQ(nearest_integer(static_cast<double>(whole) - 0.25), whole);
          EXPECT_EQ(nearest_integer(static_cast<double>(whole) + 0.5), whole + 1);
        }
      }
}

TEST(LinearSpace, IndicesComeBack) {
  const LinearSpace space;
  for (std::int64_t i : {std::int64_t{0}, std::int64_t{1}, std::int64_t{-1}, kLargestIndex - 1,
                         kLargestIndex, -kLargestIndex, (std::int64_t{1} << 52) + 1})
    EXPECT_EQ(space.index(space.state(i)), i);
}

template <class T>
void expect_ordered() {
  using L = std::numeric_limits<T>;
  const std::vector<T> ascending = {
      -L::infinity(), L::lowest(),     T(-1.5),  T(-1), -L::min(), -L::denorm_min(), T(-0.0),
      T(0.0),         L::denorm_min(), L::min(), T(1),  T(1.5),    L::max(),         L::infinity()};
  const FloatSpace<T> space;
  for (std::size_t i = 0; i < ascending.size(); ++i) {
    const std::int64_t index = ordered_index(ascending[i]);
    EXPECT_EQ(space.index(static_cast<double>(ascending[i])), index);
    EXPECT_EQ(space.index(space.state(index)), index);
    const T back = ordered_value<T>(index);
    EXPECT_EQ(std::memcmp(&back, &ascending[i], sizeof(T)), 0) << i;
    if (i > 0) {
      EXPECT_LT(ordered_index(ascending[i - 1]), index) << i;
    }
  }
  EXPECT_EQ(ordered_index(T(0.0)), 0);
  EXPECT_EQ(ordered_index(T(-0.0)), -1);
  EXPECT_EQ(ordered_index(L::denorm_min()), 1);
  EXPECT_EQ(space.index(kNaN), 0);  // as a prediction
  EXPECT_EQ(space.index(-kNaN), 0);
  // A prediction that is NaN has index 0, but a value that is NaN must be restored with the same
  // bits. 32-bit x86 changes the bits of a signalling NaN that a function returns.
  using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  constexpr Bits kQuiet = std::bit_cast<Bits>(L::quiet_NaN());
  constexpr Bits kSignalling = std::bit_cast<Bits>(L::signaling_NaN());
  constexpr Bits kSign = Bits{1} << (8 * sizeof(T) - 1);
  for (const Bits nan : {kQuiet, kSignalling, kQuiet | kSign, kSignalling | kSign})
    EXPECT_EQ(ordered_bits<Bits>(ordered_index_of(nan)), nan);
}
TEST(FloatSpace, IsInTheOrderOfTheValues) {
  expect_ordered<float>();
  expect_ordered<double>();
  EXPECT_EQ(FloatSpace<float>::index(1e300), ordered_index(std::numeric_limits<float>::infinity()));
}

TEST(DecimalSpace, IndicesComeBackInOrder) {
  std::mt19937_64 random(2);
  for (std::int32_t digits = 1; digits <= 15; ++digits) {
    const DecimalSpace space{digits};
    const std::int64_t span =
        9 * static_cast<std::int64_t>(kPowersOfTen[static_cast<std::size_t>(digits) - 1]);
    const std::int64_t most = 45 * span;
    std::vector<std::int64_t> indices = {0, 1, most, most - 1};
    for (std::int64_t k = 1; k < 45; ++k)
      for (std::int64_t by : {-1, 0, 1, 2}) indices.push_back(k * span + by);
    for (int i = 0; i < 300; ++i)
      indices.push_back(static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(most)));
    std::sort(indices.begin(), indices.end());
    indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
    double last = -1.0;
    for (std::int64_t i : indices) {
      const double state = space.state(i);
      EXPECT_EQ(space.index(state), i) << digits << ' ' << state;
      EXPECT_EQ(space.index(-state), -i) << digits << ' ' << state;
      EXPECT_EQ(space.state(-i), -state);
      EXPECT_GT(state, last);
      last = state;
    }
    // Values beyond the limits.
    EXPECT_EQ(space.index(1e300), most);
    EXPECT_EQ(space.index(-kInfinity), -most);
    EXPECT_EQ(space.index(1e-300), 0);
    EXPECT_EQ(space.index(kNaN), 0);
    for (std::int64_t i : {most + 1, std::numeric_limits<std::int64_t>::max()})
      EXPECT_EQ(space.state(i), space.state(most));
    EXPECT_EQ(space.state(std::numeric_limits<std::int64_t>::min()), space.state(-most));
  }
  EXPECT_EQ(DecimalSpace{3}.state(DecimalSpace{3}.index(0.1234)), 0.123);
  EXPECT_EQ(DecimalSpace{3}.state(DecimalSpace{3}.index(99.96)), 100.0);
  EXPECT_EQ(DecimalSpace{3}.state(DecimalSpace{3}.index(-6.02214e20)), -6.02e20);
}

TEST(RankSpace, FindsTheNearest) {
  const std::vector<std::int64_t> table = {std::numeric_limits<std::int64_t>::min(), -5, 0, 10, 13};
  const RankSpace space{{}, table};
  for (std::int64_t i = 1; i < 5; ++i) EXPECT_EQ(space.index(space.state(i)), i);
  EXPECT_EQ(space.index(4.0), 2);
  EXPECT_EQ(space.index(5.0), 2);  // halfway: the lower index
  EXPECT_EQ(space.index(6.0), 3);
  EXPECT_EQ(space.index(1e300), 4);
  EXPECT_EQ(space.index(-1e9), 1);
  EXPECT_EQ(space.state(-7), space.state(0));
  EXPECT_EQ(space.state(99), 13.0);
}

// --- domains

std::uint64_t bits_of(double v) { return std::bit_cast<std::uint64_t>(v); }
std::uint64_t bits_of(float v) { return std::bit_cast<std::uint32_t>(v); }

ArrayInfo info_of(ScalarType type) {
  ArrayInfo info;
  info.type = type;
  return info;
}
const ArrayInfo kDoubles = info_of(ScalarType::float64), kFloats = info_of(ScalarType::float32);

ValueTranslator translator(const ArrayInfo& info, DomainKind kind, std::int32_t exponent = 0,
                           bool negative = false) {
  const ValueDomain domain{kind, exponent, negative, false};
  EXPECT_TRUE(domain.fits(info));
  return {info, 0, domain};
}

void expect_back(const ValueTranslator& it, std::uint64_t bits) {
  const auto index = it.index(bits);
  ASSERT_TRUE(index.has_value()) << bits;
  EXPECT_EQ(it.bits(*index), bits);
}
void expect_odd(const ValueTranslator& it, std::uint64_t bits) {
  EXPECT_FALSE(it.index(bits).has_value()) << bits;
}

TEST(ValueTranslator, Floats) {
  std::mt19937_64 random(6);
  for (int i = 0; i < 1000; ++i) {
    expect_back(translator(kDoubles, DomainKind::floats), random());
    expect_back(translator(kFloats, DomainKind::floats), random() >> 32);
  }
}

TEST(ValueTranslator, Narrow) {
  const auto it = translator(kDoubles, DomainKind::narrow);
  for (double v : {0.0, -0.0, 1.5, -0.1f + 0.0, 1e-40f + 0.0,
                   static_cast<double>(std::numeric_limits<float>::max())})
    expect_back(it, bits_of(v));
  for (double v : {0.1, 1e300, 1e-300, kInfinity, -kInfinity, kNaN}) expect_odd(it, bits_of(v));
}

TEST(ValueTranslator, Binary) {
  for (std::int32_t exponent :
       {-971, -970, -52, -1, 0, 1, 10, 52, 1021, 1022, 1023, 1024, 1073, 1074}) {
    const auto it = translator(kDoubles, DomainKind::binary, exponent);
    for (double whole : {0.0, 1.0, -1.0, 3.0, 12345.0}) {
      const double v = std::ldexp(whole, -exponent);
      if (std::isfinite(v)) expect_back(it, bits_of(v));
    }
    if (exponent < 1000) expect_odd(it, bits_of(std::ldexp(0.5, -exponent)));
    if (exponent > -900) expect_odd(it, bits_of(std::ldexp(1.0, 60 - exponent)));
    for (double v : {-0.0, kNaN, kInfinity}) expect_odd(it, bits_of(v));
  }
  expect_back(translator(kDoubles, DomainKind::binary, 1074), bits_of(Limits::denorm_min()));
  expect_back(translator(kDoubles, DomainKind::binary, -971), bits_of(0x1p1023));
  expect_back(translator(kFloats, DomainKind::binary, 149), bits_of(1e-45f));
}

TEST(ValueTranslator, Decimal) {
  const auto cents = translator(kDoubles, DomainKind::decimal, 2);
  for (double v : {0.0, 0.01, -0.07, 1.1, 123456.78, -1e9}) expect_back(cents, bits_of(v));
  for (double v : {0.001, 1.0 / 3, -0.0, kNaN, -kInfinity, 1e300}) expect_odd(cents, bits_of(v));
  const auto thousands = translator(kDoubles, DomainKind::decimal, -3);
  for (double v : {0.0, 5000.0, -1e15}) expect_back(thousands, bits_of(v));
  expect_odd(thousands, bits_of(500.0));
  expect_back(translator(kDoubles, DomainKind::decimal, 22), bits_of(3e-22));
  expect_back(translator(kDoubles, DomainKind::decimal, -22), bits_of(7e22));
  expect_back(translator(kFloats, DomainKind::decimal, 2), bits_of(0.07f));
  expect_odd(translator(kFloats, DomainKind::decimal, 2), bits_of(0.0701f));
}

TEST(ValueTranslator, Digits) {
  const auto it = translator(kDoubles, DomainKind::digits, 4);
  for (double v : {0.0, 1.0, -1.234, 1.234e-18, 9.999e20, -5e-5}) expect_back(it, bits_of(v));
  for (double v : {1.2345, 1e-30, 1e300, -0.0, kNaN, kInfinity}) expect_odd(it, bits_of(v));
}

TEST(ValueTranslator, ANegativeZeroWhereThereMayBeOne) {
  for (const auto& [kind, exponent] :
       {std::pair{DomainKind::binary, 3}, {DomainKind::decimal, 2}, {DomainKind::digits, 3}}) {
    EXPECT_FALSE(translator(kDoubles, kind, exponent).index(bits_of(-0.0)));
    EXPECT_EQ(translator(kDoubles, kind, exponent, true).index(bits_of(-0.0)), 0);
    EXPECT_EQ(translator(kFloats, kind, exponent, true).index(bits_of(-0.0f)), 0);
  }
}

TEST(ValueTranslator, Integers) {
  const auto wide = translator(info_of(ScalarType::int64), DomainKind::integers);
  for (std::int64_t v : {std::int64_t{0}, std::int64_t{-1}, kLargestIndex, -kLargestIndex})
    expect_back(wide, static_cast<std::uint64_t>(v));
  for (std::int64_t v :
       {kLargestIndex + 1, -kLargestIndex - 1, std::numeric_limits<std::int64_t>::min(),
        std::numeric_limits<std::int64_t>::max()})
    expect_odd(wide, static_cast<std::uint64_t>(v));
  const auto natural = translator(info_of(ScalarType::uint64), DomainKind::integers);
  expect_back(natural, static_cast<std::uint64_t>(kLargestIndex));
  expect_odd(natural, static_cast<std::uint64_t>(kLargestIndex) + 1);
  expect_odd(natural, ~std::uint64_t{0});
  // The value is in the low bytes of the argument; the type determines whether it is signed.
  EXPECT_EQ(translator(info_of(ScalarType::int8), DomainKind::integers).index(0xff), -1);
  EXPECT_EQ(translator(info_of(ScalarType::uint8), DomainKind::integers).index(0xff), 255);
  EXPECT_EQ(translator(info_of(ScalarType::int32), DomainKind::integers).index(0x80000000u),
            std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(translator(info_of(ScalarType::uint32), DomainKind::integers).index(0x80000000u),
            std::int64_t{1} << 31);
}

TEST(ValueTranslator, Quantized) {
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64}) {
    ArrayInfo boxed = info_of(type), bound = info_of(type);
    boxed.quantization = {12, {-1}, {3}, 0, 0};
    bound.quantization = Quantization::absolute(0.01, 1);
    for (const ArrayInfo& info : {boxed, bound}) {
      const ValueTranslator it(info, 0, {DomainKind::quantized, 0, false, false});
      const auto bits = [&](double v) {
        return type == ScalarType::float32 ? bits_of(static_cast<float>(v)) : bits_of(v);
      };
      for (double v : {-1.0, -0.3, 0.0, 1.0 / 3, 2.99999}) {
        const auto index = it.index(bits(v));
        ASSERT_TRUE(index);
        EXPECT_LE(
            std::fabs(scalar_as_double(type, it.bits(*index)) - scalar_as_double(type, bits(v))),
            info.quantization.max_error(type));
        EXPECT_EQ(it.index(it.bits(*index)), index);
      }
      for (double v : {kNaN, kInfinity, 1e30}) expect_odd(it, bits(v));
    }
  }
}

// A coder stores earlier values as indices in a domain. These indices can be translated to another
// domain.
TEST(ValueTranslator, StatesMove) {
  const auto cents = translator(kDoubles, DomainKind::decimal, 2);
  const auto eighths = translator(kDoubles, DomainKind::binary, 3);
  const auto floats = translator(kDoubles, DomainKind::floats);
  EXPECT_EQ(cents.as_value(125.0), 1.25);
  EXPECT_EQ(eighths.from_value(cents.as_value(125.0)), 10.0);
  EXPECT_EQ(floats.from_value(eighths.as_value(10.0)), 1.25);
  EXPECT_EQ(cents.from_value(kNaN), 0.0);
  EXPECT_EQ(cents.from_value(1e300), static_cast<double>(kLargestIndex));
}

TEST(ValueDomain, FitsItsType) {
  const auto fits = [](const ArrayInfo& info, DomainKind kind, std::int32_t exponent) {
    return ValueDomain{kind, exponent, false, false}.fits(info);
  };
  const ArrayInfo integers = info_of(ScalarType::int32);
  ArrayInfo quantized = kDoubles;
  quantized.quantization = Quantization::absolute(1, 1);
  EXPECT_TRUE(fits(integers, DomainKind::integers, 0));
  EXPECT_FALSE(fits(integers, DomainKind::integers, 1));
  EXPECT_FALSE(fits(integers, DomainKind::binary, 0));
  EXPECT_FALSE(fits(kDoubles, DomainKind::integers, 0));
  EXPECT_FALSE(fits(kFloats, DomainKind::narrow, 0));
  EXPECT_FALSE(fits(kDoubles, DomainKind::quantized, 0));
  EXPECT_TRUE(fits(quantized, DomainKind::quantized, 0));
  EXPECT_FALSE(fits(quantized, DomainKind::floats, 0));
  EXPECT_FALSE(fits(kDoubles, DomainKind::binary, 1075));
  EXPECT_FALSE(fits(kDoubles, DomainKind::binary, -972));
  EXPECT_FALSE(fits(kDoubles, DomainKind::decimal, 23));
  EXPECT_FALSE(fits(kDoubles, DomainKind::decimal, -23));
  EXPECT_FALSE(fits(kDoubles, DomainKind::digits, 0));
  EXPECT_FALSE(fits(kDoubles, DomainKind::digits, 16));
}

// --- choice

template <class Make>
std::vector<std::uint64_t> doubles(std::size_t count, Make&& make) {
  std::mt19937_64 random(8);
  std::vector<std::uint64_t> bits;
  for (std::size_t i = 0; i < count; ++i) bits.push_back(bits_of(make(random())));
  return bits;
}
bool has(const std::vector<DomainAndTable>& candidates, DomainKind kind,
         std::int32_t exponent = 0) {
  for (const DomainAndTable& candidate : candidates)
    if (candidate.domain.kind == kind && candidate.domain.exponent == exponent) return true;
  return false;
}

TEST(DomainCandidates, WhereNumbersComeFrom) {
  const auto text =
      doubles(5000, [](std::uint64_t r) { return static_cast<double>(r % 1999993) / 1000; });
  auto candidates = domain_candidates(kDoubles, 0, text);
  EXPECT_EQ(candidates[0].domain, (ValueDomain{DomainKind::decimal, 3, false, false}));

  const auto grid =
      doubles(5000, [](std::uint64_t r) { return static_cast<double>(r % 999983) / 4096; });
  candidates = domain_candidates(kDoubles, 0, grid);
  EXPECT_EQ(candidates[0].domain, (ValueDomain{DomainKind::binary, 12, false, false}));

  const auto narrow = doubles(5000, [](std::uint64_t r) {
    const auto mantissa = static_cast<float>(r % 1000003) / 3.0f;
    return std::ldexp(static_cast<double>(mantissa), -static_cast<int>(r % 80));
  });
  EXPECT_TRUE(has(domain_candidates(kDoubles, 0, narrow), DomainKind::narrow));

  const auto any = doubles(5000, [](std::uint64_t r) { return std::sqrt(static_cast<double>(r)); });
  candidates = domain_candidates(kDoubles, 0, any);
  EXPECT_TRUE(has(candidates, DomainKind::floats));
  for (const DomainAndTable& candidate : candidates) EXPECT_TRUE(candidate.table.empty());

  const auto digits = doubles(5000, [](std::uint64_t r) {
    const auto mantissa = std::to_string(1000 + r % 9000), power = std::to_string(r / 9000 % 20);
    return std::strtod((mantissa + "e-" + power).c_str(), nullptr);
  });
  EXPECT_TRUE(has(domain_candidates(kDoubles, 0, digits), DomainKind::digits, 4));
}

TEST(DomainCandidates, FewValuesMakeATable) {
  const auto few =
      doubles(1000, [](std::uint64_t r) { return std::sqrt(static_cast<double>(r % 9)); });
  bool found = false;
  for (const DomainAndTable& candidate : domain_candidates(kDoubles, 0, few)) {
    if (candidate.table.empty()) continue;
    found = true;
    EXPECT_EQ(candidate.table.size(), 9u);
    EXPECT_TRUE(std::is_sorted(candidate.table.begin(), candidate.table.end()));
  }
  EXPECT_TRUE(found);
  std::vector<std::uint64_t> materials;
  for (std::uint64_t i = 0; i < 1000; ++i) materials.push_back(i * i % 7 * 1000003);
  EXPECT_EQ(domain_candidates(info_of(ScalarType::int32), 0, materials).back().table.size(), 4u);
}

TEST(DomainCandidates, SomeOddOnes) {
  auto text =
      doubles(5000, [](std::uint64_t r) { return static_cast<double>(r % 1999993) / 1000; });
  text[17] = bits_of(kNaN);
  text[18] = bits_of(kInfinity);
  text[19] = bits_of(-0.0);
  auto candidates = domain_candidates(kDoubles, 0, text);
  EXPECT_EQ(candidates[0].domain, (ValueDomain{DomainKind::decimal, 3, true, true}));

  const std::vector<std::uint64_t> large(100, std::uint64_t{1} << 60);
  candidates = domain_candidates(info_of(ScalarType::int64), 0, large);
  EXPECT_EQ(candidates[0].domain.kind, DomainKind::integers);
  EXPECT_TRUE(candidates[0].domain.escapes);
}

/// Each candidate domain must either have an index for every value, or report that some values are
/// odd, i.e. have no index.
TEST(DomainCandidates, EveryCandidateSaysEveryValue) {
  std::mt19937_64 random(9);
  const std::vector<double> special = {
      0.0,  -0.0,  kNaN,  kInfinity, Limits::max(), Limits::denorm_min(), 0.1, 1.0, 1e22,
      1e23, 1e-22, 1e-23, 0.5,       3e-310};
  for (int round = 0; round < 400; ++round) {
    const auto type = static_cast<ScalarType>(1 + random() % 10);
    ArrayInfo info = info_of(type);
    if (is_float(type) && random() % 4 == 0) info.quantization = Quantization::absolute(0.5, 1);
    std::vector<std::uint64_t> bits(1 + random() % 300);
    const std::uint64_t kinds = 1 + random() % special.size();
    const std::uint64_t mask = scalar_bytes(type) == 8
                                   ? ~std::uint64_t{0}
                                   : (std::uint64_t{1} << (8 * scalar_bytes(type))) - 1;
    const std::size_t first = random() % special.size();
    for (auto& it : bits) {
      const double v = special[(first + random() % kinds) % special.size()];
      it = type == ScalarType::float64   ? bits_of(v)
           : type == ScalarType::float32 ? bits_of(static_cast<float>(v))
                                         : random() & mask;
      if (random() % 50 == 0) it = random() & mask;
    }
    const auto candidates = domain_candidates(info, 0, bits);
    ASSERT_FALSE(candidates.empty());
    for (const DomainAndTable& candidate : candidates) {
      ASSERT_TRUE(candidate.domain.fits(info));
      const ValueTranslator it(info, 0, candidate.domain);
      for (std::uint64_t value : bits) {
        const auto index = it.index(value);
        ASSERT_TRUE(index || candidate.domain.escapes) << scalar_name(type) << ' ' << value;
        if (!index) continue;
        if (!candidate.table.empty()) {
          ASSERT_TRUE(std::binary_search(candidate.table.begin(), candidate.table.end(), *index));
        }
        if (!info.quantization.lossy() && value != negative_zero(type)) {
          ASSERT_EQ(it.bits(*index) & mask, value);
        }
      }
    }
  }
}

TEST(EntropyBits, AreThoseOfTheLogarithm) {
  static_assert(log2_steps(0) == 0 && log2_steps(1) == 0 && log2_steps(2) == 1u << 16);
  static_assert(log2_steps(1u << 31) == 31u << 16);
  for (std::uint32_t n = 1; n < 2000; n += 7)
    EXPECT_NEAR(log2_steps(n) / 65536.0, std::log2(static_cast<double>(n)), 2.0 / 65536) << n;
  EXPECT_NEAR(log2_steps(~0u) / 65536.0, 32.0, 2.0 / 65536);
  EXPECT_EQ(binary_entropy(0, 100), 0.0);
  EXPECT_EQ(binary_entropy(100, 100), 0.0);
  EXPECT_EQ(binary_entropy(128, 256), 256.0);
  EXPECT_NEAR(binary_entropy(1, 256), 9.44, 0.02);
  EXPECT_EQ(binary_entropy(0, 0), 0.0);
}

}  // namespace
}  // namespace shm
