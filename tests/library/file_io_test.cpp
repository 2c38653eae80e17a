// Files appear whole or not at all.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "shm/appender.h"
#include "shm/archive.h"
#include "shm/damage.h"
#include "shm/io.h"
#include "support/temporary_folder.h"
#include "support/test_mesh.h"

namespace {

// What linkat fails with, in place of doing its work; 0: it does it.
int linkat_fails_with = 0;
int refused_links = 0;

}  // namespace

// In place of libc's, as file systems and containers that lack it.
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

// Nobody needs to think of commit() who lets the library finish the file.
TEST_F(FileIo, WhoFinishesAFileCommitsIt) {
  const TestMesh mesh = grid(2, 2, 2);
  auto sink = FileSink::create(path("mesh.shm"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE(write_mesh(mesh, **sink));
  const std::string written = content(path("mesh.shm"));
  EXPECT_FALSE(written.empty());
  EXPECT_TRUE((*sink)->commit()) << "once more does nothing";
  EXPECT_EQ((*sink)->write(bytes("more")).error().code, ErrorCode::misuse);
  sink->reset();
  EXPECT_EQ(content(path("mesh.shm")), written);

  auto old = FileRandomSource::open(path("mesh.shm"));
  ASSERT_TRUE(old);
  sink = FileSink::create(path("again.shm"));
  ASSERT_TRUE(write_in_order(**old, **sink));
  EXPECT_EQ(content(path("again.shm")), written);

  sink = FileSink::create(path("appended.shm"));
  auto appender = Appender::open(**old, **sink);
  ASSERT_TRUE(appender);
  ASSERT_TRUE(appender->finish());
  EXPECT_EQ(content(path("appended.shm")), written);

  sink = FileSink::create(path("archive.shm"));
  auto archive = ArchiveWriter::create(**sink);
  ASSERT_TRUE(archive);
  auto member = archive->add_member("mesh");
  ASSERT_TRUE(member);
  ASSERT_TRUE(write_mesh(mesh, **member));
  EXPECT_FALSE(fs::exists(path("archive.shm"))) << "a member is not yet all of it";
  ASSERT_TRUE(archive->finish());
  EXPECT_TRUE(content(path("archive.shm")).find(written) != std::string::npos);

  sink = FileSink::create(path("taken"));
  fs::create_directories(path("taken/b"));
  EXPECT_EQ(write_mesh(mesh, **sink).error().code, ErrorCode::output);
}

// Also what comes to be there while the file is written.
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
    EXPECT_EQ(refused.error().detail, "is there already");
    EXPECT_EQ(FileSink::create(path("a"), how, refuse).error().detail, "is there already");
    late->reset();
    sink->reset();
    EXPECT_EQ(content(path("a")), "first");
    EXPECT_EQ(files(), 1u);
    fs::remove(path("a"));
    fs::create_symlink("nowhere", path("a"));
    EXPECT_EQ(FileSink::create(path("a"), how, refuse).error().detail, "is there already");
    fs::remove(path("a"));
  }
  EXPECT_TRUE(FileSink::create("/dev/null", FileSink::Temporary::unnamed, refuse));
}

TEST_F(FileIo, NothingIsLeftWithoutCommit) {
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->write(bytes("half")));
  EXPECT_EQ(files(), (*sink)->is_named() ? 1u : 0u);
  sink->reset();
  EXPECT_EQ(files(), 0u);
}

// What the system does that has no files without names.
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
      fs::remove((*sink)->temporary());  // as some libraries do before they create
      std::ofstream((*sink)->temporary()) << "named";
      ASSERT_TRUE((*sink)->commit());
    }
    sink->reset();
    EXPECT_EQ(files(), 1u);
    EXPECT_EQ(content(path("a")), commit ? "named" : "before");
  }
}

// Of a process that is gone; of another machine's when an hour old; nothing else.
TEST_F(FileIo, LeftoversAreRemoved) {
  const auto leave = [&](const std::string& name, int hours) {
    std::ofstream(path(name.c_str())) << "left";
    fs::last_write_time(path(name.c_str()),
                        fs::file_time_type::clock::now() - std::chrono::hours(hours));
  };
  auto first = FileSink::create(path("a"), FileSink::Temporary::named);
  ASSERT_TRUE(first);
  const std::string own = fs::path((*first)->temporary()).filename().string();
  const std::string machine = own.substr(own.rfind('-'));
  const std::string gone = ".a.tmp" + std::to_string((1 << 22) + 1);  // above any process
  leave(gone + machine, 0);
  leave(gone + machine + "-7", 0);
  leave(gone + "-other", 2);
  leave(".a.tmp1-other", 2);
  const std::set<std::string> others{own,
                                     ".a.tmp1" + machine,
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
  for (const auto& entry : fs::directory_iterator(folder_))
    left.insert(entry.path().filename().string());
  left.erase("a");
  EXPECT_EQ(left, others);
}

// Somebody's own file of the name that temporary files have stays; what a process has left that was
// killed between giving its file a name beside and renaming it goes.
TEST_F(FileIo, NamesBesideThatAreTakenStay) {
  std::ofstream(path("a")) << "before";
  std::ofstream(path(".a.tmp")) << "mine";
  auto sink = FileSink::create(path("a"));
  ASSERT_TRUE(sink);
  ASSERT_TRUE((*sink)->write(bytes("after")));
  ASSERT_TRUE((*sink)->commit());
  EXPECT_EQ(content(path("a")), "after");
  EXPECT_EQ(content(path(".a.tmp")), "mine");
  EXPECT_EQ(files(), 2u);
}

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
    EXPECT_EQ(content(path("real/a")), "after");
  }
  fs::create_symlink("nowhere", path("lost"));
  EXPECT_FALSE(FileSink::create(path("lost")));
}

TEST_F(FileIo, ScratchFilesAreForTheUserAlone) {
  std::ofstream(path("standard-input")) << "another's";
  for (const auto how : {FileSink::Temporary::unnamed, FileSink::Temporary::named}) {
    auto sink = FileSink::create_scratch(folder_.string(), "standard-input", how);
    ASSERT_TRUE(sink);
    EXPECT_EQ(fs::status((*sink)->temporary()).permissions(),
              fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_TRUE((*sink)->commit());
  }
  EXPECT_EQ(content(path("standard-input")), "another's");
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileIo, LongNamesAreReplaced) {
  const std::string name(250, 'n');
  for (const char* text : {"one", "two"})
    for (const auto how : {FileSink::Temporary::unnamed, FileSink::Temporary::named}) {
      auto sink = FileSink::create(path(name.c_str()), how);
      ASSERT_TRUE(sink);
      ASSERT_TRUE((*sink)->write(bytes(text)));
      ASSERT_TRUE((*sink)->commit());
      EXPECT_EQ(content(path(name.c_str())), text);
    }
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
    EXPECT_FALSE(sink->copy(**file, text.size() - 3, 4)) << "the file is not so long";
  }
  ASSERT_TRUE((*into_file)->commit());
  const std::string wanted = "begin " + text.substr(5, text.size() - 10) + text.substr(3, 4);
  EXPECT_EQ(content(path("b")).substr(0, wanted.size()), wanted);
  EXPECT_TRUE(std::equal(wanted.begin(), wanted.end(),
                         reinterpret_cast<const char*>(into_memory.bytes.data())));
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

// A file without a name that cannot be linked is copied to one that has one.
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
      EXPECT_EQ(content(name), text);
      fs::permissions(name, fs::perms::owner_read | fs::perms::owner_write);
    }
    // The old file's, which the new one has got.
    EXPECT_EQ(fs::status(name).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  }
  EXPECT_EQ(files(), 4u);
  EXPECT_EQ(refused_links, 8);
  // Where there is no room for another name either, the first error is reported.
  auto sink = FileSink::create(path("none"));
  ASSERT_TRUE(sink);
  fs::remove_all(folder_);
  linkat_fails_with = EPERM;
  const auto committed = (*sink)->commit();
  linkat_fails_with = 0;
  ASSERT_FALSE(committed);
  EXPECT_EQ(committed.error().code, ErrorCode::output);
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

// --- pipes and sockets

/// Signals come all the time, and end no call of the system by a restart.
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

/// One end of a socket, as somebody's own source: takes what there is, and little of it.
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

/// Of 30000 cells with steps.
std::vector<std::byte> packed_mesh() {
  const TestMesh mesh = grid(30, 25, 40, ScalarType::float64, warped);
  MemorySink sink;
  EXPECT_TRUE(write_mesh(mesh, sink));
  return std::move(sink.bytes);
}

/// All cells and vertices that a Reader gives.
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

// The library's own ends, while signals interrupt them.
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
  EXPECT_EQ(counts(**source, 1).first, 30000u);
  writer.join();
  EXPECT_GT(Alarms::count, 0);
}

}  // namespace
}  // namespace shm
