// Tests that the external sorter returns the same result as std::stable_sort, whatever its memory
// limit is.
#include "base/external_sorter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <random>

#include "support/temporary_folder.h"

namespace shm::converters {
namespace {

struct Item {
  std::uint64_t key;
  std::uint32_t number;
  bool operator==(const Item&) const = default;
};

std::vector<Item> items(std::size_t count, std::uint64_t keys, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Item> list;
  for (std::size_t i = 0; i < count; ++i)
    list.push_back({keys == 0 ? random() : random() % keys, static_cast<std::uint32_t>(i)});
  return list;
}

std::vector<Item> sorted(const std::vector<Item>& list, std::size_t memory,
                         const std::string& directory) {
  ExternalSorter sorter(directory, sizeof(std::uint32_t), memory);
  for (const Item& item : list)
    sorter.add(item.key, reinterpret_cast<const std::byte*>(&item.number));
  EXPECT_EQ(sorter.size(), list.size());
  std::vector<Item> out;
  std::uint64_t key;
  const std::byte* record;
  while (sorter.next(key, record)) {
    out.push_back({key, 0});
    std::memcpy(&out.back().number, record, sizeof out.back().number);
  }
  EXPECT_FALSE(sorter.next(key, record));
  return out;
}

// A record needs 20 bytes of memory, so a memory limit of 20,000 bytes allows sorted runs of 1000
// records. The tested lists include one that is a record shorter than such a run, one that is
// exactly as long, and longer ones. Other memory limits result in several rounds of merging, or in
// runs of a single record.
TEST(ExternalSorter, SortsAsAStableSortWhateverTheMemory) {
  TemporaryFolder folder;
  for (const std::uint64_t keys : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{50}})
    for (const std::size_t count : {0u, 1u, 2u, 999u, 1000u, 1001u, 2000u, 2001u, 7777u}) {
      const std::vector<Item> list = items(count, keys, count);
      std::vector<Item> expected = list;
      std::stable_sort(expected.begin(), expected.end(),
                       [](const Item& a, const Item& b) { return a.key < b.key; });
      for (const std::size_t memory : {0u, 20u, 500u, 20u * 1000, 200'000u, 10'000'000u})
        EXPECT_EQ(sorted(list, memory, folder / "."), expected) << count << " in " << memory;
    }
  EXPECT_TRUE(std::filesystem::is_empty(folder / ".")) << "a temporary file is left";
}

TEST(ExternalSorter, MergesInSeveralRounds) {
  TemporaryFolder folder;
  // With 320 kB of memory, the sorter divides the list into about 19 sorted runs, and it can merge
  // five runs at a time.
  const std::vector<Item> list = items(300'000, 1000, 3);
  std::vector<Item> expected = list;
  std::stable_sort(expected.begin(), expected.end(),
                   [](const Item& a, const Item& b) { return a.key < b.key; });
  EXPECT_EQ(sorted(list, 320'000, folder / "."), expected);
}

TEST(ExternalSorter, KeysAlone) {
  TemporaryFolder folder;
  ExternalSorter sorter(folder / ".", 0, 1000);
  for (const Item& item : items(5000, 0, 9)) sorter.add(item.key, nullptr);
  std::uint64_t key, before = 0, count = 0;
  for (const std::byte* record; sorter.next(key, record); before = key, ++count)
    ASSERT_LE(before, key);
  EXPECT_EQ(count, 5000u);
}

TEST(ExternalSorter, ADiskThatFailsIsTold) {
  ExternalSorter sorter("/no/such/folder", 8, 100);
  const std::uint64_t record = 0;
  EXPECT_ANY_THROW({
    for (std::uint64_t i = 0; i < 1'000'000; ++i)
      sorter.add(i, reinterpret_cast<const std::byte*>(&record));
  });
}

}  // namespace
}  // namespace shm::converters
