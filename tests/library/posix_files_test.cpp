// Tests of files, pipes and sockets that need features of POSIX: links, permissions, devices,
// signals.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "shm/io.h"
#include "support/temporary_folder.h"
#include "support/test_mesh.h"

namespace {

// Error number with which linkat() fails. If it is 0, linkat() works normally.
int linkat_fails_with = 0;
int refused_links = 0;
// Error numbers with which close() of a file and fsync() of a folder fail. If a number is 0, the
// function works normally.
int close_fails_with = 0, folder_fails_with = 0;

bool is_of(int descriptor, mode_t type) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 && (status.st_mode & S_IFMT) == type;
}

}  // namespace

extern "C" int close(int descriptor) {
  const bool fails = close_fails_with != 0 && is_of(descriptor, S_IFREG);
  const int done = static_cast<int>(::syscall(SYS_close, descriptor));
  if (!fails) return done;
  errno = close_fails_with;
  return -1;
}
extern "C" int fsync(int descriptor) {
  if (folder_fails_with == 0 || !is_of(descriptor, S_IFDIR))
    return static_cast<int>(::syscall(SYS_fsync, descriptor));
  errno = folder_fails_with;
  return -1;
}

// Replaces linkat() of the C library, to simulate file systems and containers that do not support
// it.
extern "C" int linkat(int from_folder, const char* from, int to_folder, const char* to,
                      int flags) noexcept {
  if (linkat_fails_with == 0)
    return static_cast<int>(::syscall(SYS_linkat, from_folder, from, to_folder, to, flags));
  ++refused_links;
  errno = linkat_fails_with;
  return -1;
}

namespace shm {
namespace {

namespace fs = std::filesystem;

TEST_F(FileIo, LinksStayAndLeadToTheNewFile) {
  fs::create_directory(path("real"));
  std::ofstream(path("real/a")) << "before";
  fs::create_symlink("real/a", path("link"));
  for (const auto how : {FileSink::Temporary::unnamed, FileSink::Temporary::named}) {
    auto sink = FileSink::create(path("link"), how);
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->write(bytes("after")));
    ASSERT_TRUE((*sink)->commit());
    EXPECT_TRUE(fs::is_symlink(path("link")));
    EXPECT_EQ(file_content(path("real/a")), "after");
  }
  fs::create_symlink("nowhere", path("lost"));
  EXPECT_FALSE(FileSink::create(path("lost")));
  EXPECT_EQ(FileSink::create(path("lost"), FileSink::Temporary::unnamed, FileSink::Existing::refuse)
                .error()
                .detail,
            "exists already");
}

TEST_F(FileIo, ScratchFilesAreForTheUserAlone) {
  std::ofstream(path("standard-input")) << "another's";
  for (const auto how : {FileSink::Temporary::unnamed, FileSink::Temporary::named}) {
    auto sink = FileSink::create_scratch(directory_.string(), "standard-input", how);
    ASSERT_TRUE(sink);
    EXPECT_EQ(fs::status((*sink)->temporary()).permissions(),
              fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_TRUE((*sink)->commit());
  }
  EXPECT_EQ(file_content(path("standard-input")), "another's");
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileIo, PermissionsStay) {
  std::ofstream(path("a")) << "before";
  fs::permissions(path("a"), fs::perms::owner_read | fs::perms::owner_write);
  for (const auto how : {FileSink::Temporary::unnamed, FileSink::Temporary::named}) {
    auto sink = FileSink::create(path("a"), how);
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->commit());
    EXPECT_EQ(fs::status(path("a")).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  }
}

// The sink writes a file without a name and links it to its name at the end. If linking fails, the
// data is copied to a named file.
TEST_F(FileIo, FilesThatCannotBeLinkedAreCopied) {
  for (const int reason : {EPERM, EXDEV, EOPNOTSUPP, ENOENT}) {
    const std::string name = path(("copied" + std::to_string(reason)).c_str());
    for (const char* text : {"first", "second, and longer"}) {
      auto sink = FileSink::create(name);
      ASSERT_TRUE(sink);
      ASSERT_TRUE((*sink)->write(bytes(text)));
      linkat_fails_with = reason;
      const auto committed = (*sink)->commit();
      linkat_fails_with = 0;
      ASSERT_TRUE(committed) << committed.error().message();
      sink->reset();
      EXPECT_EQ(file_content(name), text);
      fs::permissions(name, fs::perms::owner_read | fs::perms::owner_write);
    }
    // The new file has the permissions of the old file.
    EXPECT_EQ(fs::status(name).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  }
  EXPECT_EQ(files(), 4u);
  EXPECT_EQ(refused_links, 8);
  // If creating a named file fails, too, the sink reports the first error.
  auto sink = FileSink::create(path("none"));
  ASSERT_TRUE(sink);
  fs::remove_all(directory_);
  linkat_fails_with = EPERM;
  const auto committed = (*sink)->commit();
  linkat_fails_with = 0;
  ASSERT_FALSE(committed);
  EXPECT_EQ(committed.error().code, ErrorCode::output);
}

TEST_F(FileIo, WhatFailsToCloseGetsNoName) {
  for (const auto how : {FileSink::Temporary::unnamed, FileSink::Temporary::named})
    for (const bool is_linked : {true, false}) {
      std::ofstream(path("a")) << "before";
      auto sink = FileSink::create(path("a"), how);
      ASSERT_TRUE(sink);
      ASSERT_TRUE((*sink)->write(bytes("after")));
      linkat_fails_with = is_linked ? 0 : EPERM;
      close_fails_with = EDQUOT;
      const auto done = (*sink)->commit();
      close_fails_with = linkat_fails_with = 0;
      ASSERT_FALSE(done);
      EXPECT_EQ(done.error().code, ErrorCode::output);
      EXPECT_NE(done.error().detail.find("cannot be closed"), std::string::npos);
      sink->reset();
      EXPECT_EQ(file_content(path("a")), "before");
      EXPECT_EQ(files(), 1u);
    }
}

TEST_F(FileIo, AFolderThatCannotBeFlushedIsSaidToBeThat) {
  for (const auto how : {FileSink::Temporary::unnamed, FileSink::Temporary::named}) {
    auto sink = FileSink::create(path("a"), how);
    ASSERT_TRUE(sink);
    ASSERT_TRUE((*sink)->write(bytes("after")));
    folder_fails_with = EIO;
    const auto done = (*sink)->commit();
    folder_fails_with = 0;
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().code, ErrorCode::output);
    EXPECT_TRUE(done.error().detail.starts_with("is written, but the folder cannot be flushed"));
    EXPECT_TRUE((*sink)->commit());  // commit() does nothing a second time
    sink->reset();
    EXPECT_EQ(file_content(path("a")), "after");
    EXPECT_EQ(files(), 1u);
    fs::remove(path("a"));
  }
}

TEST_F(FileIo, DevicesAreWritten) {
  auto device = FileSink::create("/dev/null");
  ASSERT_TRUE(device);
  EXPECT_TRUE((*device)->write(std::vector<std::byte>(100)));
  EXPECT_TRUE((*device)->commit());
  EXPECT_TRUE(fs::is_character_file("/dev/null"));  // not replaced by a file
  EXPECT_TRUE(
      FileSink::create("/dev/null", FileSink::Temporary::unnamed, FileSink::Existing::refuse));
}

// --- pipes and sockets

/// Sends signals to this process continuously. System calls that a signal interrupts are not
/// restarted automatically.
class Alarms {
 public:
  Alarms() {
    struct sigaction action {};
    action.sa_handler = [](int) { ++count; };
    sigaction(SIGALRM, &action, &before_);
    const itimerval often{{0, 200}, {0, 200}};
    setitimer(ITIMER_REAL, &often, nullptr);
  }
  ~Alarms() {
    const itimerval never{};
    setitimer(ITIMER_REAL, &never, nullptr);
    sigaction(SIGALRM, &before_, nullptr);
  }
  Alarms(const Alarms&) = delete;
  Alarms& operator=(const Alarms&) = delete;
  static inline std::atomic<int> count = 0;  // signals come to any thread
  static_assert(std::atomic<int>::is_always_lock_free);

 private:
  struct sigaction before_ {};
};

/// A ByteSource that reads from one end of a socket, as a caller might implement it. It returns the
/// available bytes, a few at a time.
class SocketSource final : public ByteSource {
 public:
  explicit SocketSource(int descriptor) : descriptor_(descriptor) {}
  Result<std::size_t> read(std::span<std::byte> into) override {
    const std::size_t most = std::min<std::size_t>(into.size(), 1 + random_() % 700);
    while (true) {
      const ssize_t n = ::recv(descriptor_, into.data(), most, 0);
      if (n >= 0) return static_cast<std::size_t>(n);
      if (errno != EINTR) return Error{ErrorCode::io, "cannot be read", {}, kNoOffset, {}};
    }
  }

 private:
  int descriptor_;
  std::mt19937_64 random_{46};
};

/// Returns a mesh of 30000 cells with steps.
std::vector<std::byte> packed_mesh() {
  const TestMesh mesh = grid(30, 25, 40, ScalarType::float64, warped);
  MemorySink sink;
  EXPECT_TRUE(write_mesh(mesh, sink));
  return std::move(sink.bytes);
}

/// Reads a mesh. Returns the number of cells and the number of vertices.
std::pair<std::uint64_t, std::uint64_t> counts(ByteSource& source, unsigned threads) {
  ReadOptions options;
  options.threads = threads;
  auto reader = Reader::open(source, {}, options);
  EXPECT_TRUE(reader) << (reader ? "" : reader.error().message());
  std::uint64_t cells = 0, vertices = 0;
  while (reader) {
    const auto item = reader->next();
    EXPECT_TRUE(item) << (item ? "" : item.error().message());
    if (!item || *item == nullptr) break;
    if (const auto* block = std::get_if<MeshBlock>(*item)) {
      cells += block->cell_count();
      vertices += block->vertex_count();
    }
  }
  return {cells, vertices};
}

TEST(Sockets, ShortReadsInOddSizes) {
  const std::vector<std::byte> mesh = packed_mesh();
  for (const unsigned threads : {1u, 2u}) {
    int ends[2];
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    const Alarms alarms;
    std::thread sender([&] {
      std::mt19937_64 random(7);
      for (std::size_t at = 0; at < mesh.size();) {
        const std::size_t piece = std::min<std::size_t>(mesh.size() - at, 1 + random() % 3001);
        const ssize_t n = ::send(ends[0], mesh.data() + at, piece, 0);
        if (n < 0 && errno != EINTR) break;
        if (n > 0) at += static_cast<std::size_t>(n);
      }
      ::shutdown(ends[0], SHUT_WR);
    });
    SocketSource source(ends[1]);
    EXPECT_EQ(counts(source, threads),
              std::pair(std::uint64_t{30000}, std::uint64_t{31 * 26 * 41}));
    sender.join();
    ::close(ends[0]);
    ::close(ends[1]);
  }
}

// Writes and reads through the sinks and sources of the library while signals interrupt system
// calls.
TEST_F(FileIo, MeshesGoThroughPipes) {
  const std::vector<std::byte> mesh = packed_mesh();
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  Alarms::count = 0;
  const Alarms alarms;
  std::thread writer([&] {
    auto sink = FileSink::create(path("pipe"));
    ASSERT_TRUE(sink) << sink.error().message();
    std::mt19937_64 random(8);
    for (std::size_t at = 0; at < mesh.size();) {
      const std::size_t piece = std::min<std::size_t>(mesh.size() - at, 1 + random() % 70001);
      ASSERT_TRUE((*sink)->write(std::span(mesh).subspan(at, piece)));
      at += piece;
    }
    EXPECT_TRUE((*sink)->commit());
  });
  auto source = FileSource::open(path("pipe"));
  ASSERT_TRUE(source) << source.error().message();
  EXPECT_EQ((*source)->anywhere().error().code, ErrorCode::io);
  EXPECT_EQ(counts(**source, 1).first, 30000u);
  writer.join();
  EXPECT_GT(Alarms::count, 0);
}

}  // namespace
}  // namespace shm
