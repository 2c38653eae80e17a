// Tests that a file appears under its final name only when its contents are complete.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "shm/appender.h"
#include "shm/archive.h"
#include "shm/damage.h"
#include "shm/io.h"
#include "support/temporary_folder.h"
#include "support/test_mesh.h"

namespace shm {
namespace {

namespace fs = std::filesystem;

TEST_F(FileIo, AppearsWithCommit) {
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->write(bytes("one ")));
  ASSERT_TRUE((*sink)->write({}));
  ASSERT_TRUE((*sink)->write(bytes("two")));
  EXPECT_FALSE(fs::exists(path("a")));
  ASSERT_TRUE((*sink)->commit());
  EXPECT_EQ(file_content(path("a")), "one two");
  sink->reset();
  EXPECT_EQ(file_content(path("a")), "one two");
  EXPECT_EQ(files(), 1u);
}

// Writer::finish() calls commit() of the FileSink, so a caller of finish() need not call it.
TEST_F(FileIo, WhoFinishesAFileCommitsIt) {
  const TestMesh mesh = grid(2, 2, 2);
  auto sink = FileSink::create(path("mesh.shm"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE(write_mesh(mesh, **sink));
  const std::string written = file_content(path("mesh.shm"));
  EXPECT_FALSE(written.empty());
  EXPECT_TRUE((*sink)->commit()) << "a second commit does nothing";
  EXPECT_EQ((*sink)->write(bytes("more")).error().code, ErrorCode::misuse);
  sink->reset();
  EXPECT_EQ(file_content(path("mesh.shm")), written);

  auto old = FileRandomSource::open(path("mesh.shm"));
  ASSERT_TRUE(old);
  sink = FileSink::create(path("again.shm"));
  ASSERT_TRUE(write_in_order(**old, **sink));
  EXPECT_EQ(file_content(path("again.shm")), written);

  sink = FileSink::create(path("appended.shm"));
  auto appender = Appender::open(**old, **sink);
  ASSERT_TRUE(appender);
  ASSERT_TRUE(appender->finish());
  EXPECT_EQ(file_content(path("appended.shm")), written);

  sink = FileSink::create(path("archive.shm"));
  auto archive = ArchiveWriter::create(**sink);
  ASSERT_TRUE(archive);
  auto member = archive->add_member("mesh");
  ASSERT_TRUE(member);
  ASSERT_TRUE(write_mesh(mesh, **member));
  EXPECT_FALSE(fs::exists(path("archive.shm"))) << "the archive exists before it is finished";
  ASSERT_TRUE(archive->finish());
  EXPECT_TRUE(file_content(path("archive.shm")).find(written) != std::string::npos);

  sink = FileSink::create(path("taken"));
  fs::create_directories(path("taken/b"));
  EXPECT_EQ(write_mesh(mesh, **sink).error().code, ErrorCode::output);
}

// A sink that must not replace existing files also refuses to replace a file that another program
// creates while the sink writes its data.
TEST_F(FileIo, NothingIsReplacedWhereThatIsRefused) {
  using enum FileSink::Existing;
  for (const auto how : {FileSink::Temporary::unnamed, FileSink::Temporary::named}) {
    auto sink = FileSink::create(path("a"), how, refuse);
    ASSERT_TRUE(sink) << sink.error().message();
    ASSERT_TRUE((*sink)->write(bytes("first")));
    auto late = FileSink::create(path("a"), how, refuse);
    ASSERT_TRUE(late);
    ASSERT_TRUE((*sink)->commit());
    const auto refused = (*late)->commit();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::output);
    EXPECT_EQ(refused.error().detail, "exists already");
    EXPECT_EQ(FileSink::create(path("a"), how, refuse).error().detail, "exists already");
    late->reset();
    sink->reset();
    EXPECT_EQ(file_content(path("a")), "first");
    EXPECT_EQ(files(), 1u);
    fs::remove(path("a"));
  }
}

TEST_F(FileIo, NothingIsLeftWithoutCommit) {
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->write(bytes("half")));
  EXPECT_EQ(files(), (*sink)->is_named() ? 1u : 0u);
  sink->reset();
  EXPECT_EQ(files(), 0u);
}

// Behaviour on systems without unnamed temporary files.
TEST_F(FileIo, NamedTemporaries) {
  for (const bool commit : {false, true}) {
    std::ofstream(path("a")) << "before";
    auto sink = FileSink::create(path("a"), FileSink::Temporary::named);
    ASSERT_TRUE(sink);
    EXPECT_TRUE((*sink)->is_named());
    EXPECT_EQ(files(), 2u);
    EXPECT_EQ((*sink)->temporary().find(path(".a.tmp")), 0u);
    ASSERT_TRUE((*sink)->write(bytes("after")));
    if (commit) {
      // Some libraries remove an existing file and then create a new file with its name.
      fs::remove((*sink)->temporary());
      std::ofstream((*sink)->temporary()) << "named";
      ASSERT_TRUE((*sink)->commit());
    }
    sink->reset();
    EXPECT_EQ(files(), 1u);
    EXPECT_EQ(file_content(path("a")), commit ? "named" : "before");
  }
}

// A temporary file is removed if the process that created it has ended, or if another machine
// created it at least an hour ago. No other file is removed.
TEST_F(FileIo, LeftoversAreRemoved) {
  const auto leave = [&](const std::string& name, int hours) {
    std::ofstream(path(name)) << "left";
    fs::last_write_time(path(name), fs::file_time_type::clock::now() - std::chrono::hours(hours));
  };
  auto first = FileSink::create(path("a"), FileSink::Temporary::named);
  ASSERT_TRUE(first);
  const std::string own = fs::path((*first)->temporary()).filename().string();
  const std::string machine = own.substr(own.rfind('-'));
  const std::string gone =
      ".a.tmp" + std::to_string((1 << 22) + 1);  // larger than any process number
  leave(gone + machine, 0);
  leave(gone + machine + "-7", 0);
  leave(gone + "-other", 2);
  leave(".a.tmp1-other", 2);
  const std::set<std::string> others{own,
                                     own + "-5",
                                     gone + "-another",
                                     gone,
                                     gone + "x" + machine,
                                     ".a.tmp",
                                     ".b.tmp4194305" + machine,
                                     "a.tmp4194305" + machine,
                                     ".a.tmp-12-3",
                                     ".a.tmp0" + machine};
  for (const std::string& name : others)
    if (name != own) leave(name, name == gone + "-another" ? 0 : 2);
  auto sink = FileSink::create(path("a"), FileSink::Temporary::named);
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->commit());
  std::set<std::string> left;
  for (const auto& entry : fs::directory_iterator(directory_))
    left.insert(entry.path().filename().string());
  left.erase("a");
  EXPECT_EQ(left, others);
}

// A user's file that happens to have the name of a temporary file is not removed. A temporary file
// is removed if the process that created it was killed after linking the file to its temporary name
// but before renaming the file.
TEST_F(FileIo, NamesBesideThatAreTakenStay) {
  std::ofstream(path("a")) << "before";
  std::ofstream(path(".a.tmp")) << "mine";
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->write(bytes("after")));
  ASSERT_TRUE((*sink)->commit());
  EXPECT_EQ(file_content(path("a")), "after");
  EXPECT_EQ(file_content(path(".a.tmp")), "mine");
  EXPECT_EQ(files(), 2u);
}

TEST_F(FileIo, LongNamesAreReplaced) {
  const std::string name(250, 'n');
  for (const char* text : {"one", "two"})
    for (const auto how : {FileSink::Temporary::unnamed, FileSink::Temporary::named}) {
      auto sink = FileSink::create(path(name), how);
      ASSERT_TRUE(sink);
      ASSERT_TRUE((*sink)->write(bytes(text)));
      ASSERT_TRUE((*sink)->commit());
      EXPECT_EQ(file_content(path(name)), text);
    }
}

TEST_F(FileIo, CopiesFromFilesAndMemory) {
  std::string text;
  for (int i = 0; i < 300000; ++i) text += std::to_string(i);
  std::ofstream(path("a")) << text;
  auto file = FileRandomSource::open(path("a"));
  ASSERT_TRUE(file);
  MemoryRandomSource memory(bytes(text));
  MemorySink into_memory;
  auto into_file = FileSink::create(path("b"));
  ASSERT_TRUE(into_file);
  for (ByteSink* sink :
       {static_cast<ByteSink*>(&into_memory), static_cast<ByteSink*>(&**into_file)}) {
    ASSERT_TRUE(sink->write(bytes("begin ")));
    ASSERT_TRUE(sink->copy(**file, 5, text.size() - 10));
    ASSERT_TRUE(sink->copy(memory, 3, 4));
    ASSERT_TRUE(sink->copy(memory, 3, 0));
    EXPECT_FALSE(sink->copy(**file, text.size() - 3, 4)) << "the range ends after the file";
  }
  ASSERT_TRUE((*into_file)->commit());
  const std::string wanted = "begin " + text.substr(5, text.size() - 10) + text.substr(3, 4);
  EXPECT_EQ(file_content(path("b")).substr(0, wanted.size()), wanted);
  EXPECT_TRUE(std::equal(wanted.begin(), wanted.end(),
                         reinterpret_cast<const char*>(into_memory.bytes.data())));
}

TEST_F(FileIo, WhatWasThereStaysUntilCommit) {
  std::ofstream(path("a")) << "before";
  {
    auto sink = FileSink::create(path("a"));
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->write(bytes("after")));
    EXPECT_EQ(file_content(path("a")), "before");
  }
  EXPECT_EQ(file_content(path("a")), "before");
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->write(bytes("after")));
  ASSERT_TRUE((*sink)->commit());
  EXPECT_EQ(file_content(path("a")), "after");
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
  fs::create_directories(path("a/b"));  // blocks the name only from now on
  EXPECT_EQ((*sink)->commit().error().code, ErrorCode::output);
  sink->reset();
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileIo, FoldersAreRefused) {
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

TEST_F(FileIo, IsReadAnywhereWhileItIsRead) {
  std::ofstream(path("a")) << "0123456789";
  std::vector<std::byte> piece(3), other(4);
  auto source = FileSource::open(path("a"));
  ASSERT_TRUE(source);
  ASSERT_EQ(*(*source)->read(piece), 3u);
  const auto anywhere = (*source)->anywhere();
  ASSERT_TRUE(anywhere) << anywhere.error().message();
  EXPECT_EQ((*anywhere)->size(), 10u);
  ASSERT_TRUE((*anywhere)->read_at(6, other));
  EXPECT_EQ(static_cast<char>(other[0]), '6');
  EXPECT_EQ((*anywhere)->read_at(7, other).error().code, ErrorCode::truncated);
  ASSERT_EQ(*(*source)->read(piece), 3u);
  EXPECT_EQ(static_cast<char>(piece[0]), '3');
  source->reset();
  EXPECT_TRUE((*anywhere)->read_at(0, other));
}

TEST_F(FileIo, CannotBeRead) {
  const auto missing = FileSource::open(path("missing"));
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::io);
  EXPECT_EQ(missing.error().file, path("missing"));
  auto folder = FileSource::open(directory_.string());
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
