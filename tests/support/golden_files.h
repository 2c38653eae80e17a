// Finds the files in tests/golden: golden files of every version, and faulty files.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace shm {

inline std::filesystem::path golden_folder() {
  return std::filesystem::path(SHM_SOURCE_DIR) / "tests/golden";
}
/// Returns the folder of the faulty files and of list.txt, which describes the fault of each file.
inline std::filesystem::path faulty_folder() { return golden_folder() / "faulty"; }

inline std::string content(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  EXPECT_TRUE(in) << path;
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Returns the paths of the golden files of all versions. All of these files must be readable.
inline std::vector<std::filesystem::path> golden_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(golden_folder()))
    if (entry.path().extension() == ".shm" && entry.path().parent_path() != faulty_folder())
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace shm
