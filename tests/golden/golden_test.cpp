// Tests of golden files. Every version of the library must be able to read the files of all earlier
// versions, with exactly the same contents. A text file next to each golden file states its
// contents. Every version must also refuse the faulty files; list.txt states the reason for each of
// them. make_golden.cpp adds new files.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <sstream>
#include <string>

#include "support/faulty_files.h"
#include "support/golden_files.h"
#include "support/item_text.h"

namespace shm {
namespace {

namespace fs = std::filesystem;

TEST(Golden, EveryFileDecodesToItsTwin) {
  const auto files = golden_files();
  EXPECT_GE(files.size(), 150u);  // of 0.1, 0.9 and 0.10
  for (const fs::path& path : files) {
    const std::string bytes = content(path);
    const auto text = text_of_file(std::as_bytes(std::span(bytes)));
    ASSERT_TRUE(text) << path << ": " << text.error().message();
    EXPECT_EQ(*text, content(fs::path(path).replace_extension(".txt"))) << path;
  }
}

TEST(Golden, NoTwinStandsAlone) {
  for (const auto& entry : fs::recursive_directory_iterator(golden_folder()))
    if (entry.path().extension() == ".txt" && entry.path().parent_path() != faulty_folder() &&
        entry.path().parent_path() != golden_folder()) {
      EXPECT_TRUE(fs::exists(fs::path(entry.path()).replace_extension(".shm"))) << entry.path();
    }
}

// For each feature, there is a golden file in the current version of the format.
TEST(Golden, EveryFeatureHasAFile) {
  for (const FeatureFile& feature : feature_files())
    EXPECT_TRUE(fs::exists(golden_folder() / "0.10" / (feature.name + ".shm"))) << feature.name;
}

// Each faulty file is refused with the error code that list.txt states, and list.txt contains every
// faulty file.
TEST(Golden, EveryFaultyFileIsRefused) {
  std::map<std::string, std::string> list;  // name: code
  std::istringstream lines(content(faulty_folder() / "list.txt"));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string number, code, sentence;
    words >> number >> code;
    std::getline(words, sentence);
    EXPECT_GT(sentence.size(), 10u) << line;
    EXPECT_TRUE(list.emplace(number + ".shm", code).second) << line;
  }
  EXPECT_GE(list.size(), 150u);
  for (const auto& entry : fs::directory_iterator(faulty_folder()))
    if (entry.path().extension() == ".shm") {
      EXPECT_TRUE(list.contains(entry.path().filename().string())) << entry.path();
    }
  for (const auto& [name, code] : list) {
    const std::string bytes = content(faulty_folder() / name);
    const auto text = text_of_file(std::as_bytes(std::span(bytes)));
    ASSERT_FALSE(text) << name;
    EXPECT_EQ(word_of(text.error().code), code) << name << ": " << text.error().message();
    EXPECT_FALSE(text.error().detail.empty()) << name;
  }
}

}  // namespace
}  // namespace shm
