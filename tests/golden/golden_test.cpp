// Golden files: what earlier versions wrote is read for ever, to the very same content. A twin in
// text stands beside each. Faulty files are refused for ever; a list says why. New ones:
// make_golden.cpp.
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

// Each feature has a file of the version that is written.
TEST(Golden, EveryFeatureHasAFile) {
  for (const FeatureFile& feature : feature_files())
    EXPECT_TRUE(fs::exists(golden_folder() / "0.10" / (feature.name + ".shm"))) << feature.name;
}

// No Writer replays hexahedra any more; in which order they came it still knows, so that such files
// can be compared with what they were made of.
TEST(Golden, TheOrderOfReplayedHexahedra) {
  const std::pair<const char*, TestMesh> files[] = {
      {"replay_stream", replayed(Order::stream)},
      {"replay_strays_stream", with_order(cut_into_eight(3), Order::stream, true, 0)},
      {"second_order_stream", with_order(second_order_grid(3, 2, 2, 27), Order::stream, true, 0)}};
  for (const auto& [name, mesh] : files) {
    SCOPED_TRACE(name);
    const auto back = read_mesh(golden_bytes(name));
    ASSERT_TRUE(back);
    ASSERT_EQ(back->mesh.vertex_count(), mesh.vertices);
    RecordedOrder order;
    WriteOptions options;
    options.coding_order = &order;
    options.segment_connectivity = back->totals.segment_connectivity;
    EXPECT_EQ(options.segment_connectivity[0], ConnectivityCodec::replay);
    NullSink nowhere;
    const auto finished = write_mesh(mesh, nowhere, options);
    ASSERT_FALSE(finished);  // there is no file
    EXPECT_EQ(finished.error().code, ErrorCode::misuse);
    ASSERT_EQ(order.vertices.size(), mesh.vertices);
    const std::size_t size = mesh.xyz.size() / static_cast<std::size_t>(mesh.vertices);
    std::vector<std::byte> expected;
    for (const std::uint64_t v : order.vertices) {
      const auto from = mesh.xyz.begin() + static_cast<std::ptrdiff_t>(size * v);
      expected.insert(expected.end(), from, from + static_cast<std::ptrdiff_t>(size));
    }
    EXPECT_EQ(back->mesh.xyz, expected);
  }
}

// Each file is refused, as the list says, and the list tells of each.
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
