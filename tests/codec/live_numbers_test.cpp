#include "codecs/shifts/live_numbers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

namespace shm {
namespace {

using State = LiveNumbers::State;
using Twin = std::map<std::uint64_t, bool>;  // value: true if the number is imported

State state_in(const Twin& twin, std::uint64_t number) {
  const auto it = twin.find(number);
  if (it == twin.end()) return State::dead;
  return it->second ? State::imported : State::own;
}

void expect_same(const LiveNumbers& numbers, const Twin& twin) {
  EXPECT_EQ(numbers.count(), twin.size());
  std::vector<std::uint64_t> own;
  for (const auto& [number, imported] : twin) {
    EXPECT_EQ(numbers.state(number), imported ? State::imported : State::own) << number;
    if (!imported) own.push_back(number);
  }
  auto listed = numbers.own();
  std::sort(listed.begin(), listed.end());
  EXPECT_EQ(listed, own);
}

void expect_same_run(const LiveNumbers& numbers, const Twin& twin, std::uint64_t first,
                     std::uint32_t length) {
  if (first > ~std::uint64_t{0} - length) return;
  LiveNumbers::Run expected;
  for (auto it = twin.lower_bound(first); it != twin.end() && it->first < first + length; ++it) {
    expected.live |= std::uint64_t{1} << (it->first - first);
    if (it->second) expected.imported |= std::uint64_t{1} << (it->first - first);
  }
  const LiveNumbers::Run run = numbers.run(first, length);
  ASSERT_EQ(run.live, expected.live) << first << " " << length;
  ASSERT_EQ(run.imported, expected.imported) << first << " " << length;
}

TEST(LiveNumbers, NothingLivesAtFirst) {
  LiveNumbers numbers;
  for (std::uint64_t number : {std::uint64_t{0}, ~std::uint64_t{0}}) {
    std::size_t hint = 5;
    EXPECT_FALSE(numbers.is_live(number, hint));
    EXPECT_EQ(numbers.state(number), State::dead);
    EXPECT_EQ(numbers.remove(number), State::dead);
  }
  expect_same(numbers, {});
}

TEST(LiveNumbers, ANumberHasOneOwner) {
  LiveNumbers numbers;
  EXPECT_TRUE(numbers.add(7, false));
  EXPECT_FALSE(numbers.add(7, true));
  EXPECT_EQ(numbers.state(7), State::own);
  EXPECT_TRUE(numbers.add(8, true));
  EXPECT_FALSE(numbers.add(8, false));
  EXPECT_EQ(numbers.state(8), State::imported);
  EXPECT_EQ(numbers.remove(8), State::imported);
  EXPECT_EQ(numbers.remove(8), State::dead);
  // If a removed number is added again, its previous state must have no effect.
  EXPECT_TRUE(numbers.add(8, false));
  EXPECT_EQ(numbers.state(8), State::own);
  expect_same(numbers, {{7, false}, {8, false}});
}

/// Runs the same operations on LiveNumbers and on a standard map, and compares the results. `draw`
/// returns the next number.
template <class Draw>
void expect_like_standard_map(Draw&& draw, std::size_t most) {
  std::mt19937_64 random(1);
  LiveNumbers numbers;
  Twin twin;
  std::vector<std::uint64_t> alive;
  std::size_t hint = 0;
  for (int n = 0; n < 60000; ++n) {
    const std::uint64_t number = draw(random);
    const bool imported = random() % 3 == 0;
    ASSERT_EQ(numbers.state(number), state_in(twin, number));
    // The hint may be the table position of the most recent lookup or any other value.
    ASSERT_EQ(numbers.is_live(number, hint), twin.contains(number));
    std::size_t any = random();
    ASSERT_EQ(numbers.is_live(number, any), twin.contains(number));
    if (!alive.empty()) {
      ASSERT_TRUE(numbers.is_live(alive[random() % alive.size()], any));
    }
    expect_same_run(numbers, twin, number - std::min<std::uint64_t>(number, random() % 70),
                    static_cast<std::uint32_t>(1 + random() % 64));
    if (twin.contains(number) || alive.size() < most) {
      const bool added = twin.emplace(number, imported).second;
      ASSERT_EQ(numbers.add(number, imported), added);
      if (added) alive.push_back(number);
    }
    if (!alive.empty() && random() % 3 == 0) {
      std::swap(alive[random() % alive.size()], alive.back());
      ASSERT_EQ(numbers.remove(alive.back()), state_in(twin, alive.back()));
      ASSERT_EQ(numbers.remove(alive.back()), State::dead);
      twin.erase(alive.back());
      alive.pop_back();
    }
    ASSERT_EQ(numbers.count(), twin.size());
    if (n % 10000 == 0) expect_same(numbers, twin);
  }
  expect_same(numbers, twin);
  for (; !alive.empty(); alive.pop_back()) {
    ASSERT_EQ(numbers.remove(alive.back()), state_in(twin, alive.back()));
    twin.erase(alive.back());
    if (alive.size() % 5000 == 0 || alive.size() < 50) expect_same(numbers, twin);
  }
  expect_same(numbers, {});
}

TEST(LiveNumbers, NumbersThatRise) {
  expect_like_standard_map([next = std::uint64_t{0}](auto&) mutable { return next++; }, 5000);
}
TEST(LiveNumbers, NumbersThatFall) {
  expect_like_standard_map([next = ~std::uint64_t{0}](auto&) mutable { return next--; }, 5000);
}
TEST(LiveNumbers, FewNumbersAgainAndAgain) {
  expect_like_standard_map([](auto& random) { return random() % 200; }, 150);
}
TEST(LiveNumbers, AnyNumbers) {
  expect_like_standard_map([](auto& random) { return random(); }, 30000);
}
TEST(LiveNumbers, NumbersFarApart) {
  expect_like_standard_map([next = std::uint64_t{0}](auto&) mutable { return next += 1 << 20; },
                           3000);
}

// All these numbers hash to the same position of the table, or to its last position. They form long
// runs of entries, some of which continue at the beginning of the table. Removing a number from
// such a run moves the largest possible number of entries.
TEST(LiveNumbers, WordsThatCollide) {
  for (const std::uint64_t mask : {0xfff, 0xffe}) {
    std::vector<std::uint64_t> words;
    for (std::uint64_t word = 0; words.size() < 60; ++word)
      if (((word * 0x9e3779b97f4a7c15u) >> 32 & mask) == mask) words.push_back(word);
    expect_like_standard_map([&](auto& random) { return words[random() % 60] << 6; }, 60);
    expect_like_standard_map([&](auto& random) { return words[random() % 60] << 6 | random() % 3; },
                             120);
  }
}

TEST(LiveNumbers, Runs) {
  for (const std::uint64_t base :
       {std::uint64_t{0}, std::uint64_t{1} << 32, ~std::uint64_t{0} - 2000}) {
    std::mt19937_64 random(3);
    LiveNumbers numbers;
    Twin twin;
    for (int n = 0; n < 20000; ++n) {
      const std::uint64_t first = base + random() % 1900;
      const auto length = static_cast<std::uint32_t>(1 + random() % 64);
      if (n % 3 == 0) {
        for (std::uint64_t i = 0; i < length; ++i) twin.erase(first + i);
        numbers.remove_run(first, length);
      } else if (numbers.run(first, length).live == 0) {
        for (std::uint64_t i = 0; i < length; ++i)
          ASSERT_TRUE(twin.emplace(first + i, false).second);
        numbers.add_run(first, length);
      } else {
        const bool imported = random() % 2 == 0;
        ASSERT_EQ(numbers.add(first, imported), twin.emplace(first, imported).second);
      }
      expect_same_run(numbers, twin, base + random() % 1900, length);
      ASSERT_EQ(numbers.count(), twin.size());
      if (n % 1000 == 0) expect_same(numbers, twin);
    }
  }
}

/// All numbers are multiples of kStride. A plain multiplicative hash would map all of them to the
/// same table position, and the test would run for minutes.
TEST(LiveNumbers, NumbersOfAnEnemy) {
  constexpr std::uint64_t kStride = 0x77a0f8664ddccf40u, kCount = std::uint64_t{1} << 18;
  LiveNumbers numbers;
  for (std::uint64_t k = 0; k < kCount; ++k) ASSERT_TRUE(numbers.add(k * kStride, false));
  for (std::uint64_t k = 0; k < kCount; ++k)
    ASSERT_EQ(numbers.remove(k * kStride), LiveNumbers::State::own);
  EXPECT_EQ(numbers.count(), 0u);
}

}  // namespace
}  // namespace shm
