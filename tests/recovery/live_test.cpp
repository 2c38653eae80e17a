// Tests live files: files that readers open while a Writer adds steps and commits them.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "format/random_chunks.h"
#include "shm/appender.h"
#include "shm/damage.h"
#include "shm/mesh.h"
#include "shm/mesh_extract.h"
#include "shm/step_reader.h"
#include "shm/summary.h"
#include "support/file_surgery.h"
#include "support/stepped_mesh.h"
#include "support/test_mesh.h"

#ifndef _WIN32
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>
#include <fstream>
#endif

namespace shm {
namespace {

constexpr std::uint64_t kSteps = 40;

/// Remembers how many bytes the file has at each commit.
class CountingSink final : public ByteSink {
 public:
  Result<void> write(std::span<const std::byte> more) override {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return {};
  }
  Result<void> flush() override {
    flushed = bytes.size();
    return {};
  }
  Result<void> publish() override {
    EXPECT_EQ(flushed, bytes.size() - 16) << "the trailer is not written after a flush";
    ends.push_back(bytes.size());
    return {};
  }
  Bytes bytes;
  std::size_t flushed = 0;
  std::vector<std::size_t> ends;
};

double time_of(std::uint64_t step) { return .25 * static_cast<double>(step * step); }

Schema live_schema() {
  Schema schema;
  schema.blocks.resize(1);
  schema.arrays = {array_of("p", Location::point, ScalarType::float64),
                   array_of("c", Location::cell, ScalarType::float32),
                   array_of("g", Location::global, ScalarType::float64)};
  for (ArrayInfo& array : schema.arrays) array.per_step = true;
  schema.arrays[2].elements = 1;
  return schema;
}

/// Values of an array at a step, for a grid with this number of vertices or cells.
Bytes values_of(std::uint32_t array, std::uint64_t step, std::size_t elements) {
  Bytes bytes;
  for (std::size_t e = 0; e < elements; ++e) {
    const double value = std::sqrt(static_cast<double>(e + 1)) + .5 * static_cast<double>(step);
    if (array == 1)
      append(bytes, static_cast<float>(value));
    else
      append(bytes, value);
  }
  return bytes;
}

constexpr std::size_t kSide = 5, kVertices = (kSide + 1) * (kSide + 1) * (kSide + 1);
constexpr std::size_t kCells = kSide * kSide * kSide;

Result<Writer> writer_of_mesh(ByteSink& sink, const WriteOptions& options = {}) {
  auto writer = Writer::create(sink, live_schema(), options);
  if (!writer) return writer;
  const auto number = [](std::size_t i, std::size_t j, std::size_t k) {
    return static_cast<std::uint64_t>((k * (kSide + 1) + j) * (kSide + 1) + i);
  };
  for (std::size_t v = 0; v < kVertices; ++v) {
    const double xyz[] = {static_cast<double>(v % (kSide + 1)),
                          static_cast<double>(v / (kSide + 1) % (kSide + 1)),
                          static_cast<double>(v / ((kSide + 1) * (kSide + 1)))};
    if (auto status = writer->add_vertex(v, std::as_bytes(std::span(xyz))); !status)
      return status.error();
  }
  for (std::size_t c = 0; c < kCells; ++c) {
    const std::size_t i = c % kSide, j = c / kSide % kSide, k = c / (kSide * kSide);
    const std::uint64_t corners[] = {number(i, j, k),
                                     number(i + 1, j, k),
                                     number(i + 1, j + 1, k),
                                     number(i, j + 1, k),
                                     number(i, j, k + 1),
                                     number(i + 1, j, k + 1),
                                     number(i + 1, j + 1, k + 1),
                                     number(i, j + 1, k + 1)};
    if (auto status = writer->add_cell(0, corners); !status) return status.error();
  }
  if (auto status = writer->end_mesh(); !status) return status.error();
  return writer;
}

template <class AnyWriter>
Result<void> add_step(AnyWriter& writer, std::uint64_t step) {
  const std::size_t sizes[] = {kVertices, kCells, 1};
  for (std::uint32_t a = 0; a < 3; ++a)
    if (auto status = writer.add_step_values(a, step, values_of(a, step, sizes[a])); !status)
      return status;
  std::vector<double> times;
  for (std::uint64_t s = 0; s <= step; ++s) times.push_back(time_of(s));
  return writer.set_step_times(times);
}

/// Writes a file with a commit after each step.
CountingSink live_file(std::uint64_t steps, bool finishes, const WriteOptions& options = {}) {
  CountingSink sink;
  auto writer = writer_of_mesh(sink, options).value();
  for (std::uint64_t s = 0; s < steps; ++s) {
    EXPECT_TRUE(add_step(writer, s));
    EXPECT_TRUE(writer.commit());
  }
  if (finishes) {
    EXPECT_TRUE(writer.finish());
  }
  return sink;
}

Bytes written_at_once(std::uint64_t steps) {
  MemorySink sink;
  auto writer = writer_of_mesh(sink).value();
  for (std::uint64_t s = 0; s < steps; ++s) EXPECT_TRUE(add_step(writer, s));
  EXPECT_TRUE(writer.finish());
  return std::move(sink.bytes);
}

/// Expects that the file has exactly the first `steps` steps, however it is read.
void expect_steps(std::span<const std::byte> bytes, std::uint64_t steps) {
  SCOPED_TRACE(std::to_string(bytes.size()) + " bytes, " + std::to_string(steps) + " steps");
  const auto full = written_at_once(steps);
  MemorySource expected_source(full);
  const Mesh expected = read_mesh(expected_source).value();
  MemorySource source(bytes);
  const auto mesh = read_mesh(source);
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->step_times, expected.step_times);
  EXPECT_TRUE(mesh->steps == expected.steps);
  EXPECT_EQ(mesh->xyz, expected.xyz);
  MemoryRandomSource anywhere(bytes), of_full(full);
  const auto summary = read_summary(anywhere);
  ASSERT_TRUE(summary) << summary.error().message();
  EXPECT_EQ(summary->totals.steps, steps);
  EXPECT_EQ(summary->totals.digest, read_summary(of_full)->totals.digest);
  auto reader = StepReader::open(anywhere);
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_EQ(reader->step_times(), expected.step_times);
  for (std::uint32_t a = 0; a < 3; ++a) EXPECT_EQ(reader->steps(a).size(), steps);
}

TEST(Live, EachCommitIsAWholeFile) {
  for (const bool finishes : {false, true}) {
    const CountingSink sink = live_file(12, finishes);
    ASSERT_EQ(sink.ends.size(), 12u);
    for (std::uint64_t s = 0; s < sink.ends.size(); ++s)
      expect_steps(std::span(sink.bytes).first(sink.ends[s]), s + 1);
    expect_steps(sink.bytes, 12);
  }
}

TEST(Live, CommitsBeforeTheFirstStepAndExtrasBetweenThem) {
  CountingSink sink;
  auto writer = writer_of_mesh(sink).value();
  ASSERT_TRUE(writer.commit());
  ASSERT_TRUE(writer.add_extra({"note", ScalarType::uint8, Reference::nothing, {2}, Bytes(2)}));
  ASSERT_TRUE(writer.commit());
  ASSERT_TRUE(writer.commit());  // nothing is new
  ASSERT_EQ(sink.ends.size(), 2u);
  ASSERT_TRUE(add_step(writer, 0));
  ASSERT_TRUE(writer.finish());
  MemoryRandomSource first(std::span(sink.bytes).first(sink.ends[0]));
  EXPECT_EQ(read_summary(first)->extras.size(), 0u);
  MemoryRandomSource second(std::span(sink.bytes).first(sink.ends[1]));
  EXPECT_EQ(read_summary(second)->extras.size(), 1u);
  expect_steps(sink.bytes, 1);
}

TEST(Live, TornTailsAreIgnored) {
  const CountingSink sink = live_file(6, false);
  for (std::size_t cut = sink.ends[1]; cut < sink.bytes.size(); ++cut) {
    const auto bytes = std::span(sink.bytes).first(cut);
    const auto committed = static_cast<std::size_t>(
        std::upper_bound(sink.ends.begin(), sink.ends.end(), cut) - sink.ends.begin());
    MemoryRandomSource source(bytes);
    const auto end = bytes_of_file(source);
    ASSERT_TRUE(end) << cut << ": " << end.error().message();
    EXPECT_EQ(*end, sink.ends[committed - 1]) << cut;
    if (cut % 17 == 0 || cut < sink.ends[1] + 40) expect_steps(bytes, committed);
    // A reader that cannot seek reports the torn tail, unless it is shorter than a chunk header.
    MemorySource front(bytes);
    ByteSource& unseekable = front;
    const auto read = read_mesh(unseekable);
    if (cut - *end >= container::kShortHeaderBytes)
      EXPECT_TRUE(!read && read.error().code == ErrorCode::truncated) << cut;
    else
      EXPECT_TRUE(read) << cut;
    // The committed part is not damaged.
    const auto report = find_damage(source);
    ASSERT_TRUE(report);
    EXPECT_TRUE(report->damages.empty() && report->complete) << cut;
  }
}

TEST(Live, AForgedTrailerInAPayloadDoesNotCount) {
  // The first commit, as an extra of the file, followed by a torn chunk.
  CountingSink sink;
  auto writer = writer_of_mesh(sink).value();
  ASSERT_TRUE(writer.commit());
  const Bytes forged(sink.bytes);
  ASSERT_TRUE(add_step(writer, 0));
  ASSERT_TRUE(writer.commit());
  ASSERT_TRUE(
      writer.add_extra({"forged", ScalarType::uint8, Reference::nothing, {forged.size()}, forged}));
  ASSERT_TRUE(add_step(writer, 1));
  ASSERT_TRUE(writer.commit());
  const std::size_t whole = sink.ends[2];
  expect_steps(std::span(sink.bytes).first(whole - 1), 1);
  Bytes torn(sink.bytes.begin(), sink.bytes.begin() + static_cast<std::ptrdiff_t>(whole - 40));
  MemoryRandomSource source(torn);
  EXPECT_EQ(bytes_of_file(source).value(), sink.ends[1]);
}

/// Counts the reads of a source.
class CountedReads final : public RandomSource {
 public:
  explicit CountedReads(std::span<const std::byte> whole) : source_(whole) {}
  std::uint64_t size() const override { return source_.size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    ++reads;
    return source_.read_at(offset, into);
  }
  std::size_t reads = 0;

 private:
  MemoryRandomSource source_;
};

TEST(Live, AThousandCommitsNeedFewIndexes) {
  constexpr std::uint64_t kMany = 1000;
  const CountingSink sink = live_file(kMany, false);
  std::size_t index_bytes = 0, most = 0;
  const FileParts parts = take_apart(sink.bytes);
  for (const Chunk& chunk : parts.chunks)
    if (chunk.is(container::ChunkKind::index)) index_bytes += chunk.bytes();
  for (std::uint64_t commits = 1; commits <= kMany; ++commits) {
    CountedReads source(std::span(sink.bytes).first(sink.ends[commits - 1]));
    container::IndexEntry last = container::last_index(source).value();
    std::size_t followed = 0;
    for (bool more = true; more; ++followed) {
      container::Index index;
      std::uint8_t version = 0;
      const auto payload = container::read_chunk(source, last, 1 << 20, &version).value();
      ASSERT_TRUE(
          container::get_index_payload(payload, index, version, last.offset, sink.bytes.size()));
      more = index.previous_index != 0;
      if (more) last = index.entries[0];
    }
    most = std::max(most, followed);
    EXPECT_LE(followed, static_cast<std::size_t>(std::bit_width(commits)) + 1) << commits;
  }
  EXPECT_GT(most, 4u);  // the test reaches files with many indexes
  // Opening a live file needs one more read for each index.
  const Bytes at_once = written_at_once(kMany);
  CountedReads live(sink.bytes), whole(at_once);
  for (CountedReads* source : {&live, &whole}) {
    auto reader = StepReader::open(*source).value();
    StepRequest request;
    request.step = kMany - 1;
    ASSERT_TRUE(reader.begin(request));
    while (*reader.next() != nullptr) {
    }
  }
  EXPECT_LE(live.reads, whole.reads + most);
  // All indexes together are a small multiple of the last one.
  EXPECT_LT(index_bytes, 4 * 40 * kMany);
}

TEST(Live, DamageInOneCommitLeavesTheOthers) {
  const CountingSink sink = live_file(6, true);
  std::mt19937 random(1);
  const FileParts parts = take_apart(sink.bytes);
  std::size_t offset = container::kFileStartBytes;
  for (const Chunk& chunk : parts.chunks) {
    const bool is_index = chunk.is(container::ChunkKind::index);
    for (int flip = 0; flip < (is_index ? 20 : 0); ++flip) {
      Bytes bytes = sink.bytes;
      bytes[offset + random() % chunk.bytes()] ^= std::byte{1};
      MemoryRandomSource source(bytes);
      auto damaged = StepReader::open_damaged(source);
      ASSERT_TRUE(damaged) << damaged.error().message();
      for (std::uint32_t a = 0; a < 3; ++a) EXPECT_EQ(damaged->steps(a).size(), 6u) << offset;
      EXPECT_EQ(damaged->step_times().size(), 6u);
    }
    offset += chunk.bytes();
  }
}

// A damaged header after a commit does not look like the end of the file, because the trailer at
// the end shows that a later index exists.
TEST(Live, DamageAfterACommitIsNoEnd) {
  for (const bool finishes : {false, true}) {
    const CountingSink sink = live_file(4, finishes);
    for (std::size_t commit = 0; commit < 3; ++commit) {
      Bytes bytes = sink.bytes;
      bytes[sink.ends[commit] + 9] ^= std::byte{1};  // the number of the chunk
      MemorySource source(bytes), front(bytes);
      const auto mesh = read_mesh(source);
      EXPECT_TRUE(!mesh && mesh.error().code == ErrorCode::corrupt);
      ByteSource& unseekable = front;
      const auto read = read_mesh(unseekable);
      EXPECT_TRUE(!read && read.error().code == ErrorCode::corrupt);
      MemoryRandomSource anywhere(bytes);
      const auto report = find_damage(anywhere);
      ASSERT_TRUE(report);
      EXPECT_FALSE(report->damages.empty());
    }
  }
}

// Writers need few indexes, so a file with a long chain is hostile.
TEST(Live, TooManyIndexesToFollow) {
  constexpr std::size_t kCommits = container::kMostIndexes + 1;
  const CountingSink sink = live_file(kCommits, true);
  FileParts parts = take_apart(sink.bytes);
  ByteReader in(parts.chunks.back().payload);
  container::Index all;
  ASSERT_TRUE(container::get(in, all, parts.chunks.back().header.version, sink.bytes.size()));
  parts.chunks.pop_back();
  // Each index refers to the one directly before it.
  std::uint64_t offset = container::kFileStartBytes, previous = 0;
  std::size_t first = 0;
  for (std::size_t c = 0; c < parts.chunks.size(); ++c) {
    Chunk& chunk = parts.chunks[c];
    if (chunk.is(container::ChunkKind::index)) {
      ByteReader payload(chunk.payload);
      container::Index index;
      ASSERT_TRUE(container::get(payload, index, chunk.header.version, sink.bytes.size()));
      index.previous_index = previous;
      index.entries.assign(all.entries.begin() + static_cast<std::ptrdiff_t>(first),
                           all.entries.begin() + static_cast<std::ptrdiff_t>(c));
      ByteWriter out;
      container::put(out, index);
      chunk.payload = std::move(out.bytes);
      previous = offset;
      first = c;
    }
    all.entries[c].bytes = chunk.bytes();
    offset += chunk.bytes();
  }
  const auto expect = [](const FileParts& some, bool good) {
    const Bytes bytes = put_together(some);
    MemorySource source(bytes);
    EXPECT_EQ(static_cast<bool>(read_mesh(source)), good);
    MemoryRandomSource anywhere(bytes);
    EXPECT_EQ(static_cast<bool>(read_summary(anywhere)), good);
  };
  expect(parts, false);
  // Without the last commit.
  do parts.chunks.pop_back();
  while (!parts.chunks.back().is(container::ChunkKind::index));
  expect(parts, true);
}

TEST(Live, WrongCallsAreRefused) {
  const auto misuse = [](const Result<void>& status) {
    return !status && status.error().code == ErrorCode::misuse;
  };
  MemorySink sink;
  {
    auto writer = Writer::create(sink, live_schema()).value();
    EXPECT_TRUE(misuse(writer.commit()));  // the mesh has not ended
  }
  {
    auto writer = writer_of_mesh(sink).value();
    ASSERT_TRUE(writer.add_step_values(0, 0, Bytes(8)));
    EXPECT_TRUE(misuse(writer.commit()));  // the step is not complete
  }
  {
    auto writer = writer_of_mesh(sink).value();
    ASSERT_TRUE(writer.set_step_times(std::vector<double>{0, 1}));
    EXPECT_TRUE(misuse(writer.set_step_times(std::vector<double>{0, 2, 3})));
  }
  {
    auto writer = writer_of_mesh(sink).value();
    ASSERT_TRUE(writer.set_step_times(std::vector<double>{0, 1}));
    EXPECT_TRUE(misuse(writer.set_step_times(std::vector<double>{0})));
  }
}

TEST(Live, AppendingToALiveFileMakesAnOrdinaryFile) {
  const CountingSink sink = live_file(5, false);
  MemoryRandomSource old(sink.bytes);
  MemorySink out;
  auto appender = Appender::open(old, out).value();
  EXPECT_EQ(appender.steps(), 5u);
  ASSERT_TRUE(add_step(appender, 5));
  ASSERT_TRUE(appender.finish());
  expect_steps(out.bytes, 6);
  const FileParts parts = take_apart(out.bytes);
  EXPECT_EQ(std::count_if(parts.chunks.begin(), parts.chunks.end(),
                          [](const Chunk& it) { return it.is(container::ChunkKind::index); }),
            1);
}

/// Continues a file in place: with a commit for each step, or with one at the end.
Bytes continued(Bytes bytes, std::uint64_t from, std::uint64_t to, bool commits) {
  const Bytes old = bytes;
  MemoryRandomSource source(old);
  MemorySink sink;
  AppendOptions options;
  options.in_place = true;
  auto appender = Appender::open(source, sink, options).value();
  for (std::uint64_t s = from; s < to; ++s) {
    EXPECT_TRUE(add_step(appender, s));
    if (commits) {
      EXPECT_TRUE(appender.commit());
    }
  }
  const auto report = appender.finish();
  EXPECT_TRUE(report) << report.error().message();
  bytes.resize(bytes_of_file(source).value());
  bytes.insert(bytes.end(), sink.bytes.begin(), sink.bytes.end());
  if (report) {
    EXPECT_EQ(report->total_bytes, bytes.size());
  }
  return bytes;
}

TEST(Live, FilesAreContinuedInPlace) {
  for (const bool commits : {false, true})
    for (const bool finished : {false, true}) {
      const CountingSink sink = live_file(5, finished);
      expect_steps(continued(sink.bytes, 5, 9, commits), 9);
      // A torn tail is replaced.
      Bytes torn = live_file(6, false).bytes;
      torn.resize(torn.size() - 1);
      expect_steps(continued(torn, 5, 7, commits), 7);
      expect_steps(continued(written_at_once(3), 3, 4, commits), 4);
    }
  // Many sessions of one step need as few indexes as commits.
  Bytes bytes = written_at_once(1);
  for (std::uint64_t s = 1; s < 70; ++s) bytes = continued(bytes, s, s + 1, false);
  expect_steps(bytes, 70);
}

TEST(Live, SomeFilesAreNotContinuedInPlace) {
  const Bytes old = written_at_once(2);
  MemoryRandomSource source(old);
  MemorySink sink;
  AppendOptions options;
  options.in_place = true;
  auto appender = Appender::open(source, sink, options).value();
  EXPECT_FALSE(appender.drop_extras());
  AppendOptions copies;
  auto other = Appender::open(source, sink, copies).value();
  EXPECT_EQ(other.commit().error().code, ErrorCode::misuse);
  Bytes with_parity = old;
  for (const char c : std::string("SHMP and more")) with_parity.push_back(std::byte(c));
  with_parity.insert(with_parity.end(), old.end() - container::kTrailerBytes, old.end());
  MemoryRandomSource of_parity(with_parity);
  const auto refused = Appender::open(of_parity, sink, options);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message().find("parity"), std::string::npos);
}

#ifndef _WIN32

class LiveFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "live_XXXXXX";
    folder_ = ::mkdtemp(name.data());
    path_ = folder_ + "/run.shm";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Bytes bytes() const {
    std::ifstream in(path_, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    const auto all = std::as_bytes(std::span(text));
    return {all.begin(), all.end()};
  }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_), {}));
  }
  std::string folder_, path_;
};

TEST_F(LiveFile, AppearsWithTheFirstCommit) {
  std::ofstream(path_) << "old";
  {
    auto sink = FileSink::create_live(path_).value();
    auto writer = writer_of_mesh(*sink).value();
    EXPECT_EQ(bytes().size(), 3u);
    ASSERT_TRUE(add_step(writer, 0));
    ASSERT_TRUE(writer.commit());
    expect_steps(bytes(), 1);
    // Another program cannot write the file now.
    const auto other = FileSink::create_live(path_);
    ASSERT_FALSE(other);
    EXPECT_NE(other.error().message().find("is being written"), std::string::npos);
    EXPECT_FALSE(FileSink::create(path_));
    ASSERT_TRUE(add_step(writer, 1));
    ASSERT_TRUE(writer.commit());
    expect_steps(bytes(), 2);
    const std::size_t committed = bytes().size();
    ASSERT_TRUE(add_step(writer, 2));
    ASSERT_TRUE(sink->write(Bytes(100)));
    EXPECT_GT(bytes().size(), committed);
  }
  // Without a commit, the file is cut back to the last one.
  expect_steps(bytes(), 2);
  MemoryRandomSource source(bytes());
  EXPECT_EQ(files(), 1u);
  EXPECT_TRUE(FileSink::create(path_));  // the lock is gone
}

TEST_F(LiveFile, WithoutACommitLeavesNothing) {
  {
    auto sink = FileSink::create_live(path_).value();
    auto writer = writer_of_mesh(*sink).value();
    ASSERT_TRUE(add_step(writer, 0));
  }
  EXPECT_EQ(files(), 0u);
  {
    auto sink = FileSink::create(path_).value();
    auto writer = writer_of_mesh(*sink).value();
    const auto status = writer.commit();
    ASSERT_FALSE(status);
    EXPECT_NE(status.error().message().find("not a live file"), std::string::npos);
  }
  EXPECT_EQ(files(), 0u);
  {
    auto sink = FileSink::create_live(path_).value();
    auto writer = writer_of_mesh(*sink).value();
    ASSERT_TRUE(add_step(writer, 0));
    ASSERT_TRUE(writer.finish());
  }
  expect_steps(bytes(), 1);
}

TEST_F(LiveFile, KilledWritersLeaveWhatTheyCommitted) {
  // Kills a writer at a random moment. `marks` receives the number of each finished commit.
  std::mt19937 random(7);
  int with_steps = 0;
  for (int trial = 0; trial < 40; ++trial) {
    std::filesystem::remove(path_);
    int marks[2];
    ASSERT_EQ(::pipe(marks), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      ::close(marks[0]);
      auto sink = FileSink::create_live(path_);
      if (!sink) ::_exit(1);
      auto writer = writer_of_mesh(**sink);
      if (!writer) ::_exit(1);
      for (std::uint64_t s = 0; s < kSteps; ++s) {
        if (!add_step(*writer, s) || !writer->commit()) ::_exit(1);
        const char mark = 1;
        (void)!::write(marks[1], &mark, 1);
      }
      ::_exit(writer->finish() ? 0 : 1);
    }
    ASSERT_GT(child, 0);
    ::close(marks[1]);
    ::usleep(static_cast<useconds_t>(random() % 60000));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 0);
    std::uint64_t committed = 0;
    char mark = 0;
    while (::read(marks[0], &mark, 1) == 1) ++committed;
    ::close(marks[0]);
    if (!std::filesystem::exists(path_)) {
      EXPECT_EQ(committed, 0u);
      continue;
    }
    const Bytes left = bytes();
    MemoryRandomSource source(left);
    const auto summary = read_summary(source);
    ASSERT_TRUE(summary) << summary.error().message();
    // The writer may have been killed between a commit and its mark.
    EXPECT_TRUE(summary->totals.steps == committed || summary->totals.steps == committed + 1);
    expect_steps(left, summary->totals.steps);
    with_steps += committed > 0 ? 1 : 0;
  }
  EXPECT_GT(with_steps, 5);
}

#endif

}  // namespace
}  // namespace shm
