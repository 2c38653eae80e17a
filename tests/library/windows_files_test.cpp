// Tests of files that need features of Windows: UTF-16 names, newlines, devices, read-only files.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <io.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "shm/io.h"
#include "support/temporary_folder.h"

namespace shm {
namespace {

namespace fs = std::filesystem;

void write_whole(const std::string& path, std::string_view text) {
  auto sink = FileSink::create(path);
  ASSERT_TRUE(sink) << sink.error().message();
  ASSERT_TRUE((*sink)->write(std::as_bytes(std::span(text))));
  const auto committed = (*sink)->commit();
  ASSERT_TRUE(committed) << committed.error().message();
}

std::string read_whole(ByteSource& source) {
  std::string text(1000, '\0');
  std::size_t size = 0;
  while (true) {
    const auto more = source.read(std::as_writable_bytes(std::span(text)).subspan(size));
    EXPECT_TRUE(more) << more.error().message();
    if (!more || *more == 0) break;
    size += *more;
  }
  text.resize(size);
  return text;
}

TEST_F(FileIo, NamesAreUtf8) {
  // The test does not build this path with std::filesystem, which does not accept four-byte UTF-8
  // characters on Windows.
  const std::string name =
      directory_.string() + "/Gew\xC3\xB6lbe \xE7\xB6\xB2\xE6\xA0\xBC \xF0\x9F\xA7\x8A.shm";
  write_whole(name, "vault");
  EXPECT_TRUE(fs::exists(directory_ / L"Gew\u00F6lbe \u7DB2\u683C \xD83E\xDDCA.shm"));
  auto source = FileSource::open(name);
  ASSERT_TRUE(source);
  EXPECT_EQ(read_whole(**source), "vault");
  EXPECT_EQ(FileSource::open(directory_.string() + "/no UTF-8 \xFF").error().code, ErrorCode::io);
  EXPECT_EQ(FileSink::create(directory_.string() + "/no UTF-8 \xFF").error().code,
            ErrorCode::output);
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileIo, DevicesAreWritten) {
  for (const auto existing : {FileSink::Existing::replace, FileSink::Existing::refuse}) {
    auto device = FileSink::create("NUL", FileSink::Temporary::unnamed, existing);
    ASSERT_TRUE(device) << device.error().message();
    EXPECT_TRUE((*device)->temporary().empty());
    EXPECT_TRUE((*device)->write(std::vector<std::byte>(100)));
    EXPECT_TRUE((*device)->commit());
  }
  EXPECT_FALSE(FileRandomSource::open("NUL"));
}

TEST_F(FileIo, WhatIsReadOnlyStays) {
  std::ofstream(path("a")) << "before";
  fs::permissions(path("a"), fs::perms::owner_write, fs::perm_options::remove);
  EXPECT_EQ(FileSink::create(path("a")).error().detail, "is read-only");
  fs::permissions(path("a"), fs::perms::owner_write, fs::perm_options::add);
  EXPECT_EQ(file_content(path("a")), "before");
}

TEST_F(FileIo, ScratchFilesGoWithTheirSinks) {
  for (const bool commit : {false, true}) {
    auto sink = FileSink::create_scratch(directory_.string(), "standard-input");
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->write(bytes("scratch")));
    EXPECT_EQ(file_content((*sink)->temporary()), "scratch");
    if (commit) {
      EXPECT_TRUE((*sink)->commit());
    }
    sink->reset();
    EXPECT_EQ(files(), 0u);
  }
}

/// Redirects one of the standard streams to a file.
class InPlaceOf {
 public:
  InPlaceOf(int stream, const std::string& path, int flags)
      : stream_(stream), before_(::_dup(stream)) {
    const int file = ::_open(path.c_str(), flags, 0600);
    ::_dup2(file, stream);
    ::_close(file);
  }
  ~InPlaceOf() {
    ::_dup2(before_, stream_);
    ::_close(before_);
  }
  InPlaceOf(const InPlaceOf&) = delete;
  InPlaceOf& operator=(const InPlaceOf&) = delete;

 private:
  int stream_, before_;
};

// Standard input and output are binary: newlines are not translated, and Control-Z does not end the
// input.
TEST_F(FileIo, StandardStreamsAreBinary) {
  const std::string text =
      "a\nb\r\nc\x1A"
      "d\n";
  {
    const InPlaceOf output(1, path("out"), _O_WRONLY | _O_CREAT | _O_TEXT);
    auto sink = FileSink::create("-");
    EXPECT_TRUE(sink && (*sink)->write(bytes(text)) && (*sink)->commit());
  }
  EXPECT_EQ(file_content(path("out")), text);
  const InPlaceOf input(0, path("out"), _O_RDONLY | _O_TEXT);
  auto source = FileSource::open("-");
  ASSERT_TRUE(source);
  EXPECT_EQ(read_whole(**source), text);
}

// If the process that writes to a pipe closes the pipe, reading ends without an error.
TEST_F(FileIo, PipesEndWhereTheyAreClosed) {
  int ends[2];
  ASSERT_EQ(::_pipe(ends, 4096, _O_BINARY), 0);
  ASSERT_EQ(::_write(ends[1], "piped", 5), 5);
  ::_close(ends[1]);
  const int before = ::_dup(0);
  ::_dup2(ends[0], 0);
  ::_close(ends[0]);
  auto source = FileSource::open("-");
  EXPECT_EQ(read_whole(**source), "piped");
  ::_dup2(before, 0);
  ::_close(before);
}

}  // namespace
}  // namespace shm
