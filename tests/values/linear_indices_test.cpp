// Tests the loops that compute the linear-domain indices of many values in one call. The results
// must equal those of a ValueTranslator for each single value.
#include "codecs/patterns/linear_indices.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <vector>

namespace shm {
namespace {

constexpr double kMost = 1125899906842624.0;  // 2^50

const std::vector<ValueDomain> kDomains = {{DomainKind::binary, -20}, {DomainKind::binary, 0},
                                           {DomainKind::binary, 3},   {DomainKind::binary, 30},
                                           {DomainKind::binary, 900}, {DomainKind::decimal, 0},
                                           {DomainKind::decimal, 2},  {DomainKind::decimal, 22}};

ArrayInfo array_of(ScalarType type) {
  ArrayInfo info;
  info.type = type;
  return info;
}

std::uint64_t bits_of(ScalarType type, double value) {
  return type == ScalarType::float32 ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                                     : std::bit_cast<std::uint64_t>(value);
}

/// Returns values of a domain at random indices, values midway between two indices, and the floats
/// next to all of these values.
std::vector<std::uint64_t> values_of(ScalarType type, const ValueTranslator& translator) {
  std::mt19937_64 random(7);
  std::vector<std::uint64_t> values;
  for (int i = 0; i < 4000; ++i) {
    const auto index = static_cast<std::int64_t>(random()) >> (14 + i % 50);
    const double below = translator.as_value(static_cast<double>(index)),
                 above = translator.as_value(static_cast<double>(index + 1));
    for (const double value : {below, below + (above - below) / 2})
      for (const double side : {value, std::nextafter(value, 1e300), std::nextafter(value, -1e300)})
        values.push_back(bits_of(type, side));
  }
  return values;
}

TEST(LinearIndices, ReferencesAreThoseOfATranslator) {
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (const ValueDomain& domain : kDomains) {
      const ValueTranslator translator(array_of(type), 0, domain);
      const auto nearest = [&](std::uint64_t bits) {
        return static_cast<std::int64_t>(translator.from_value(scalar_as_double(type, bits)));
      };
      std::vector<std::uint64_t> small;
      for (const std::uint64_t bits : values_of(type, translator))
        if (std::fabs(static_cast<double>(nearest(bits))) < kMost) small.push_back(bits);
      ASSERT_GT(small.size(), 1000u);
      std::vector<std::int64_t> all(small.size());
      ASSERT_TRUE(linear_references(type, small, domain, all));
      for (std::size_t i = 0; i < small.size(); ++i)
        ASSERT_EQ(all[i], nearest(small[i])) << "of " << scalar_as_double(type, small[i]);
    }
}

TEST(LinearIndices, ReferencesOfLargeOnesAreLeftToATranslator) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (const double odd : {kMost, -kMost, -6 * kMost, -6.5 * kMost, 1e30, infinity, -infinity,
                             std::numeric_limits<double>::quiet_NaN()}) {
      const std::vector<std::uint64_t> values = {bits_of(type, 1), bits_of(type, odd),
                                                 bits_of(type, 2)};
      std::vector<std::int64_t> nearest(values.size());
      EXPECT_FALSE(linear_references(type, values, {DomainKind::binary, 0}, nearest)) << odd;
    }
  const std::vector<std::uint64_t> one = {bits_of(ScalarType::float32, 1)};
  std::vector<std::int64_t> its(1);
  for (const ValueDomain& other :
       {ValueDomain{DomainKind::binary, 1000}, ValueDomain{DomainKind::decimal, -2},
        ValueDomain{DomainKind::narrow}, ValueDomain{DomainKind::quantized}})
    EXPECT_FALSE(linear_references(ScalarType::float32, one, other, its));
}

TEST(LinearIndices, ValuesAreThoseOfATranslator) {
  std::mt19937_64 random(11);
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (const ValueDomain& domain : kDomains)
      for (const int unused : {14, 0}) {  // without 14 unused bits, the loop declines
        const ValueTranslator translator(array_of(type), 0, domain);
        std::vector<std::uint64_t> words, indices;
        for (int i = 0; i < 1000; ++i)
          indices.push_back(static_cast<std::uint64_t>(static_cast<std::int64_t>(random()) >>
                                                       (unused + i % (64 - unused))));
        words = indices;
        ASSERT_EQ(linear_values(type, domain, words), unused > 0);
        if (unused == 0) {
          ASSERT_EQ(words, indices);
          continue;
        }
        for (std::size_t i = 0; i < words.size(); ++i)
          ASSERT_EQ(words[i], translator.bits(static_cast<std::int64_t>(indices[i])));
      }
}

TEST(LinearIndices, IndicesAreThoseOfATranslator) {
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (const ValueDomain& domain : kDomains) {
      const ValueTranslator translator(array_of(type), 0, domain);
      for (const std::uint64_t bits : values_of(type, translator)) {
        std::int64_t its = 0;
        const bool is_one = linear_indices(type, std::span(&bits, 1), domain, std::span(&its, 1));
        const auto index = translator.index(bits);
        // linear_indices() may refuse a value whose index is kMost or more. Its callers then use a
        // ValueTranslator instead.
        if (is_one || (index && std::fabs(static_cast<double>(*index)) < kMost)) {
          ASSERT_TRUE(is_one && index) << scalar_as_double(type, bits);
          ASSERT_EQ(translator.bits(its), bits);  // several indices may represent the same float
        }
      }
    }
}

}  // namespace
}  // namespace shm
