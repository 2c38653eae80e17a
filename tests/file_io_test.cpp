// Files appear whole or not at all.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "shm/io.h"
#include "temporary_folder.h"

namespace shm {
namespace {

namespace fs = std::filesystem;

class FileIo : public testing::Test {
 protected:
  std::string path(const char* name) const { return (folder_ / name).string(); }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }
  static std::string content(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static std::span<const std::byte> bytes(std::string_view text) {
    return std::as_bytes(std::span(text));
  }

  TemporaryFolder own_folder_;
  const fs::path& folder_ = own_folder_.path();
};

TEST_F(FileIo, AppearsWithCommit) {
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->write(bytes("one ")));
  ASSERT_TRUE((*sink)->write({}));
  ASSERT_TRUE((*sink)->write(bytes("two")));
  EXPECT_FALSE(fs::exists(path("a")));
  ASSERT_TRUE((*sink)->commit());
  EXPECT_EQ(content(path("a")), "one two");
  sink->reset();
  EXPECT_EQ(content(path("a")), "one two");
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileIo, NothingIsLeftWithoutCommit) {
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->write(bytes("half")));
  EXPECT_EQ(files(), 1u);
  sink->reset();
  EXPECT_EQ(files(), 0u);
}

TEST_F(FileIo, WhatWasThereStaysUntilCommit) {
  std::ofstream(path("a")) << "before";
  {
    auto sink = FileSink::create(path("a"));
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->write(bytes("after")));
    EXPECT_EQ(content(path("a")), "before");
  }
  EXPECT_EQ(content(path("a")), "before");
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->write(bytes("after")));
  ASSERT_TRUE((*sink)->commit());
  EXPECT_EQ(content(path("a")), "after");
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileIo, CannotBeCreated) {
  const auto sink = FileSink::create(path("no/such/folder"));
  ASSERT_FALSE(sink);
  EXPECT_EQ(sink.error().code, ErrorCode::output);
  EXPECT_EQ(sink.error().file, path("no/such/folder"));
  EXPECT_FALSE(sink.error().detail.empty());
}

TEST_F(FileIo, CannotBeGivenItsName) {
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  fs::create_directories(path("a/b"));  // stands in the way only now
  EXPECT_EQ((*sink)->commit().error().code, ErrorCode::output);
  sink->reset();
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileIo, DevicesAreWrittenAndFoldersRefused) {
  auto device = FileSink::create("/dev/null");
  ASSERT_TRUE(device);
  EXPECT_TRUE((*device)->write(std::vector<std::byte>(100)));
  EXPECT_TRUE((*device)->commit());
  EXPECT_TRUE(fs::is_character_file("/dev/null"));  // not renamed over
  fs::create_directories(path("a"));
  const auto folder = FileSink::create(path("a"));
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error().code, ErrorCode::output);
}

TEST_F(FileIo, ReadsInPieces) {
  std::ofstream(path("a")) << "0123456789";
  auto source = FileSource::open(path("a"));
  ASSERT_TRUE(source);
  std::string all;
  std::vector<std::byte> piece(3);
  while (true) {
    const auto count = (*source)->read(piece);
    ASSERT_TRUE(count);
    if (*count == 0) break;
    all.append(reinterpret_cast<const char*>(piece.data()), *count);
  }
  EXPECT_EQ(all, "0123456789");
  EXPECT_EQ(*(*source)->read(piece), 0u);
}

TEST_F(FileIo, CannotBeRead) {
  const auto missing = FileSource::open(path("missing"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::io);
  EXPECT_EQ(missing.error().file, path("missing"));
  auto folder = FileSource::open(folder_.string());
  std::vector<std::byte> piece(3);
  if (folder) {
    EXPECT_EQ((*folder)->read(piece).error().code, ErrorCode::io);
  }
}

TEST(MemoryIo, SinkAndSource) {
  MemorySink sink;
  const std::string_view text = "0123456789";
  ASSERT_TRUE(sink.write(std::as_bytes(std::span(text))));
  ASSERT_TRUE(sink.write(std::as_bytes(std::span(text))));
  MemorySource source(sink.bytes);
  std::vector<std::byte> into(15);
  EXPECT_EQ(*source.read(into), 15u);
  EXPECT_EQ(into[14], std::byte{'4'});
  EXPECT_EQ(*source.read(into), 5u);
  EXPECT_EQ(*source.read(into), 0u);
  NullSink counter;
  ASSERT_TRUE(counter.write(sink.bytes));
  EXPECT_EQ(counter.bytes, 20u);
}

}  // namespace
}  // namespace shm
