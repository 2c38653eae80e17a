// Tests of NumberSet: it returns all numbers that were added, and reports a number that was added
// twice.
#include "random/number_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <random>
#include <set>

namespace shm {
namespace {

TEST(NumberSet, HasAllNumbersAndTellsWhichIsThereTwice) {
  std::mt19937_64 random(3);
  for (const std::uint64_t most : {10ull, 1000ull, 1ull << 24, ~0ull}) {
    std::set<std::uint64_t> expected;
    NumberSet numbers;
    for (int i = 0; i < 3000; ++i) {
      const std::uint64_t number = most == ~0ull ? random() : random() % most;
      if (expected.insert(number).second) numbers.add(number);
    }
    EXPECT_EQ(numbers.twice(), std::nullopt);
    EXPECT_EQ(numbers.size(), expected.size());
    const auto all = numbers.numbers();
    EXPECT_TRUE(std::equal(all.begin(), all.end(), expected.begin(), expected.end()));
    const std::uint64_t again = *std::next(expected.begin(), expected.size() / 2);
    numbers.add(again);
    EXPECT_EQ(numbers.twice(), again);
  }
  // NumberSet stores numbers in a bit array, which grows. A large number may be added while the
  // array is too short for it, and added again after the array has grown.
  NumberSet grown;
  constexpr std::uint64_t kFar = 64 * (1 << 14) + 640;
  grown.add(kFar);
  for (std::uint64_t number = 0; number < 100; ++number) grown.add(number);
  EXPECT_EQ(grown.twice(), std::nullopt);
  EXPECT_EQ(grown.numbers().back(), kFar);
  grown.add(kFar);
  EXPECT_EQ(grown.twice(), kFar);
}

}  // namespace
}  // namespace shm
