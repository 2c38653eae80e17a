#include "base/number_map.h"

#include <gtest/gtest.h>

#include <random>
#include <unordered_map>
#include <vector>

namespace shm {
namespace {

TEST(IdMap, EmptyFindsNothing) {
  const IdMap map;
  EXPECT_EQ(map.size(), 0u);
  EXPECT_EQ(map.find(0), kNone);
  EXPECT_EQ(map.find(~std::uint64_t{0}), kNone);
}

/// Runs the same operations on an IdMap and on a standard map, and compares the results. `draw`
/// returns the next number.
template <class Draw>
void expect_like_standard_map(Draw&& draw, std::size_t most) {
  std::mt19937_64 random(1);
  IdMap map;
  std::unordered_map<std::uint64_t, std::uint32_t> twin;
  std::vector<std::uint64_t> alive;
  for (int n = 0; n < 60000; ++n) {
    const std::uint64_t id = draw(random);
    const auto found = twin.find(id);
    ASSERT_EQ(map.find(id), found == twin.end() ? kNone : found->second);
    if (found == twin.end() && alive.size() < most) {
      const auto slot = static_cast<std::uint32_t>(n);
      map.insert(id, slot);
      twin.emplace(id, slot);
      alive.push_back(id);
    }
    if (!alive.empty() && random() % 3 == 0) {
      std::swap(alive[random() % alive.size()], alive.back());
      map.erase(alive.back());
      twin.erase(alive.back());
      alive.pop_back();
    }
    ASSERT_EQ(map.size(), twin.size());
  }
  for (const auto& [id, slot] : twin) EXPECT_EQ(map.find(id), slot);
  while (!alive.empty()) {
    map.erase(alive.back());
    EXPECT_EQ(map.find(alive.back()), kNone);
    alive.pop_back();
  }
  EXPECT_EQ(map.size(), 0u);
}

TEST(IdMap, NumbersThatRise) {
  expect_like_standard_map([next = std::uint64_t{0}](auto&) mutable { return next++; }, 5000);
}
TEST(IdMap, FewNumbersAgainAndAgain) {
  expect_like_standard_map([](auto& random) { return random() % 40; }, 40);
}
TEST(IdMap, AnyNumbers) {
  expect_like_standard_map([](auto& random) { return random(); }, 30000);
}
// The hashes of these numbers are equal in all bits that the hash table uses. The numbers form one
// long run of entries in the table. Erasing an entry of this run moves the largest possible number
// of entries.
TEST(IdMap, NumbersThatCollide) {
  constexpr std::uint64_t kInverse = 0xf1de83e19937733d;  // of 0x9e3779b97f4a7c15 modulo 2^64
  static_assert(kInverse * 0x9e3779b97f4a7c15u == 1);
  expect_like_standard_map([](auto& random) { return (random() % 60 << 50) * kInverse; }, 60);
  expect_like_standard_map(
      [](auto& random) { return (random() % 60 << 50 | random() % 3 << 20) * kInverse; }, 180);
}

}  // namespace
}  // namespace shm
