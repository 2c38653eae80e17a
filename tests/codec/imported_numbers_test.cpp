#include "codecs/shifts/imported_numbers.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <random>

namespace shm {
namespace {

// The class agrees with a standard map while entries come and go.
TEST(ImportedNumbers, AreFoundWhileEntriesComeAndGo) {
  ImportedNumbers numbers;
  std::map<std::uint64_t, std::uint64_t> twin;
  std::mt19937 random(1);
  EXPECT_TRUE(numbers.empty());
  for (std::uint64_t import = 0; import < 2000; ++import) {
    numbers.add(import, 7 * import);
    twin[import] = 7 * import;
    // At most 20 entries remain, so that new entries take the places of removed ones.
    while (twin.size() > random() % 20) {
      auto gone = twin.begin();
      std::advance(gone, random() % twin.size());
      numbers.remove(gone->first);
      twin.erase(gone);
    }
    ASSERT_EQ(numbers.empty(), twin.empty());
    for (const auto& [key, number] : twin) ASSERT_EQ(numbers[key], number);
  }
}

}  // namespace
}  // namespace shm
