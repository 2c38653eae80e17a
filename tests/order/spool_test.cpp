// Tests of the spool, which stores data in memory or on disk. It must return data unchanged. If the
// data does not fit into memory, it must keep in memory the data that will be needed again soon.
#include "base/spool.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "mesh/cell_store.h"
#include "mesh/coding_order.h"
#include "support/temporary_folder.h"

namespace shm::converters {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

TEST(Spool, KeepsWhatManyArraysHold) {
  TemporaryFolder folder;
  Spool spool(folder / ".", 10 * Spool::kPageBytes);  // half of it for pages
  PagedArray bytes(spool, 1), numbers(spool, 8), triples(spool, 12);
  std::map<std::uint64_t, std::uint64_t> expected;
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t at = random() % 300000, value = random();
    expected[at] = value;
    numbers.set(at, value);
    bytes.set(at, static_cast<std::uint8_t>(value));
    const std::uint32_t triple[3] = {static_cast<std::uint32_t>(value), 7, 9};
    triples.write(at, 1, reinterpret_cast<const std::byte*>(triple));
  }
  EXPECT_EQ(numbers.size(), expected.rbegin()->first + 1);
  EXPECT_EQ(spool.resident_bytes(), 5 * Spool::kPageBytes);
  for (const auto& [at, value] : expected) {
    ASSERT_EQ(numbers.get<std::uint64_t>(at), value);
    ASSERT_EQ(bytes.get<std::uint8_t>(at), static_cast<std::uint8_t>(value));
    std::uint32_t triple[3];
    triples.read(at, 1, reinterpret_cast<std::byte*>(triple));
    ASSERT_EQ(triple[0], static_cast<std::uint32_t>(value));
    ASSERT_EQ(triple[2], 9u);
    if (!expected.contains(at + 1)) {
      ASSERT_EQ(numbers.get<std::uint64_t>(at + 1), 0u) << "never written";
    }
  }
}

TEST(Spool, WhatIsReadFrontToBackStaysSmall) {
  TemporaryFolder folder;
  Spool spool(folder / ".", 256 * kMiB);
  PagedArray numbers(spool, 8);
  constexpr std::uint64_t kCount = 64 * kMiB / 8;
  for (int pass = 0; pass < 2; ++pass)
    for (std::uint64_t i = 0; i < kCount; i += 512) numbers.set(i, i);
  for (std::uint64_t i = 0; i < kCount; i += 512) ASSERT_EQ(numbers.get<std::uint64_t>(i), i);
  EXPECT_EQ(spool.resident_bytes(), Spool::kStartBytes);
}

TEST(Spool, WhatIsReadInAnyOrderGetsItsBudget) {
  TemporaryFolder folder;
  Spool spool(folder / ".", 48 * kMiB);  // half of it for pages
  PagedArray numbers(spool, 8);
  constexpr std::uint64_t kCount = 20 * kMiB / 8;
  for (std::uint64_t i = 0; i < kCount; i += 512) numbers.set(i, i);
  EXPECT_EQ(spool.resident_bytes(), Spool::kStartBytes);
  std::mt19937_64 random(1);
  for (int n = 0; n < 20000; ++n) {
    const std::uint64_t i = random() % kCount / 512 * 512;
    ASSERT_EQ(numbers.get<std::uint64_t>(i), i);
  }
  EXPECT_GE(spool.resident_bytes(), 18 * kMiB);
  EXPECT_LE(spool.resident_bytes(), 24 * kMiB);
}

TEST(PageCache, FetchesAPageOnceWhileItIsWanted) {
  std::uint64_t fetched = 0;
  PageCache cache(1 << 20, 8, 64 * kMiB, [&](std::uint64_t first, std::uint64_t count, auto* out) {
    ++fetched;
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t value = 3 * (first + i);
      std::memcpy(out + 8 * i, &value, 8);
    }
  });
  for (std::uint64_t i = 0; i < 1 << 20; ++i) {
    std::uint64_t value;
    std::memcpy(&value, cache[i], 8);
    ASSERT_EQ(value, 3 * i);
  }
  EXPECT_EQ(fetched, (1u << 20) / 4096);
}

TEST(NumberList, HoldsNumbersThatCountUpThenNarrowThenWideOnes) {
  TemporaryFolder folder;
  Spool spool(folder / ".", 10 * Spool::kPageBytes);
  constexpr std::uint64_t kWide = std::uint64_t{1} << 40;
  for (const std::uint64_t counted : {0u, 5u, 20000u}) {
    NumberList list(spool);
    std::vector<std::uint64_t> expected, some;
    std::mt19937_64 random(counted);
    for (std::uint64_t i = 0; i < counted; ++i) expected.push_back(i);
    for (int i = 0; i < 30000; ++i) expected.push_back(random() >> 32 | 1u << 31);
    for (int i = 0; i < 30000; ++i) expected.push_back(i % 2 == 0 ? kWide + i : i);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      list.push_back(expected[i]);
      if (i % 997 != 0) continue;
      list.read(i / 2, i - i / 2 + 1, some);  // while the list grows
      ASSERT_TRUE(std::equal(some.begin(), some.end(),
                             expected.begin() + static_cast<std::ptrdiff_t>(i / 2)));
    }
    ASSERT_EQ(list.size(), expected.size());
    list.for_each([&](std::uint64_t at, std::uint64_t number) {
      ASSERT_EQ(number, expected[at]) << at << " of " << counted;
    });
  }
}

TEST(NumberTable, HoldsTheLargestNumberThatItWasMadeFor) {
  TemporaryFolder folder;
  Spool spool(folder / ".", 10 * Spool::kPageBytes);
  for (const std::uint64_t most :
       {std::uint64_t{0xffffffff}, std::uint64_t{0x100000000}, NumberTable::kAnyNumber}) {
    NumberTable table(spool, 100000, most);
    for (std::uint64_t i = 0; i < 100000; i += 7) table.set(i, most - i);
    for (std::uint64_t i = 0; i < 100000; ++i)
      ASSERT_EQ(table.get(i), i % 7 == 0 ? most - i : 0) << most;
  }
}

TEST(CellStore, GivesCellsBackInAnyOrder) {
  TemporaryFolder folder;
  Spool spool(folder / ".", 4 * Spool::kPageBytes);
  CellStore store(spool);
  std::mt19937_64 random(3);
  std::vector<std::pair<std::uint32_t, std::vector<std::uint64_t>>> cells;
  for (int i = 0; i < 50000; ++i) {
    const bool odd = i > 20000 && i < 30000 && random() % 3 == 0;
    std::vector<std::uint64_t> corners(odd ? random() % 6 : 8);
    for (std::uint64_t& corner : corners) corner = random() >> (i % 97 == 0 ? 20 : 40);
    cells.emplace_back(odd ? 1 : 0, corners);
    store.append(cells.back().first, corners);
    if (i % 1000 == 0) {  // while the store grows
      CellBatch one;
      one.clear();
      store.read(static_cast<std::uint64_t>(i), one);
      ASSERT_EQ(one.corners, corners);
    }
  }
  ASSERT_EQ(store.size(), cells.size());
  for (int n = 0; n < 2000; ++n) {
    const std::uint64_t first = random() % cells.size();
    const std::uint64_t count = std::min<std::uint64_t>(random() % 50, cells.size() - first);
    CellBatch some;
    some.clear();
    store.read_run(first, count, some);
    ASSERT_EQ(some.size(), count);
    for (std::uint64_t i = 0; i < count; ++i) {
      ASSERT_EQ(some.blocks[i], cells[first + i].first);
      const auto corners = some.cell(i);
      ASSERT_TRUE(std::equal(corners.begin(), corners.end(), cells[first + i].second.begin(),
                             cells[first + i].second.end()));
    }
  }
}

}  // namespace
}  // namespace shm::converters
