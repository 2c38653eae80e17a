// Golden files: what earlier versions wrote is read for ever, to the very same content. A twin in
// text stands beside each. New ones: make_golden.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "item_text.h"

namespace shm {
namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  EXPECT_TRUE(in) << path;
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<fs::path> golden_files() {
  std::vector<fs::path> files;
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(SHM_SOURCE_DIR) / "tests/golden"))
    if (entry.path().extension() == ".shm") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

TEST(Golden, EveryFileDecodesToItsTwin) {
  const auto files = golden_files();
  EXPECT_GE(files.size(), 20u);
  for (const fs::path& path : files) {
    const std::string bytes = content(path);
    const auto text = text_of_file(std::as_bytes(std::span(bytes)));
    ASSERT_TRUE(text) << path << ": " << text.error().message();
    EXPECT_EQ(*text, content(fs::path(path).replace_extension(".txt"))) << path;
  }
}

TEST(Golden, NoTwinStandsAlone) {
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(SHM_SOURCE_DIR) / "tests/golden"))
    if (entry.path().extension() == ".txt") {
      EXPECT_TRUE(fs::exists(fs::path(entry.path()).replace_extension(".shm"))) << entry.path();
    }
}

}  // namespace
}  // namespace shm
