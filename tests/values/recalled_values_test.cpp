// Tests of SortedValues, a sorted list of the magnitudes of earlier values. Compares SortedValues
// with a simple list: the rank of each magnitude, the nearest magnitude, and the value stored with
// each magnitude must be equal.
#include "codecs/surface/values/column_state.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace shm {
namespace {

using Plain = std::map<std::uint64_t, double>;

std::uint64_t distance(std::uint64_t a, std::uint64_t b) { return a < b ? b - a : a - b; }

void expect_alike(const SortedValues& values, const Plain& plain, std::uint64_t wanted) {
  ASSERT_EQ(values.size(), plain.size());
  const auto below =
      static_cast<std::size_t>(std::distance(plain.begin(), plain.lower_bound(wanted)));
  EXPECT_EQ(values.rank_of(wanted), below);
  const auto nearest = std::min_element(plain.begin(), plain.end(), [&](auto& a, auto& b) {
    return distance(a.first, wanted) < distance(b.first, wanted);
  });
  const auto* found = values.nearest(wanted);
  ASSERT_EQ(found == nullptr, plain.empty());
  if (found == nullptr) return;
  EXPECT_EQ(found->magnitude, nearest->first);
  EXPECT_EQ(found->value, nearest->second);
}

TEST(SortedValues, AreAsAPlainListHasThem) {
  std::mt19937_64 random(1);
  for (std::uint64_t most : {std::uint64_t{7}, std::uint64_t{3000}, ~std::uint64_t{0}}) {
    SortedValues values;
    Plain plain;
    for (int i = 0; i < 3000; ++i) {
      if (i % 7 == 0) expect_alike(values, plain, random() % most);
      const std::uint64_t magnitude = random() % most;
      values.add(magnitude, i);
      plain[magnitude] = i;
      if (i % 500 != 0) continue;
      std::size_t rank = 0;
      for (const auto& [its, value] : plain) {
        EXPECT_EQ(values.at(rank).magnitude, its);
        EXPECT_EQ(values.at(rank).value, value);
        ++rank;
      }
    }
  }
}

TEST(SortedValues, BeginAnewWhereTheyAreTooMany) {
  SortedValues values;
  for (std::uint64_t i = 0; i < SortedValues::kMost; ++i) values.add(i * 3, 1.0);
  EXPECT_EQ(values.size(), SortedValues::kMost);
  values.add(6, 2.0);  // an existing magnitude
  EXPECT_EQ(values.size(), SortedValues::kMost);
  EXPECT_EQ(values.nearest(6)->value, 2.0);
  values.add(7, 2.0);
  EXPECT_EQ(values.size(), 1u);
  EXPECT_EQ(values.at(0).magnitude, 7u);
}

TEST(SortedValues, MagnitudesAscendWithNumbers) {
  EXPECT_EQ(SortedValues::magnitude_of(-0.0), 0u);
  EXPECT_EQ(SortedValues::magnitude_of(-2.5), SortedValues::magnitude_of(2.5));
  EXPECT_LT(SortedValues::magnitude_of(1.0), SortedValues::magnitude_of(-1.5));
}

}  // namespace
}  // namespace shm
