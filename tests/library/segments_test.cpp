// Tests of segments. A mesh that is cut into many segments is read back completely, and each vertex
// is returned only once. The positions of the cuts depend only on the counts of cells and vertices.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "base/ordered_tasks.h"
#include "shm/segment_reader.h"
#include "support/coded_meshes.h"
#include "support/counted_source.h"
#include "support/file_surgery.h"
#include "support/item_text.h"
#include "support/sanitized.h"

namespace shm {
namespace {

WriteOptions cut_every(std::uint64_t cells) {
  WriteOptions options;
  options.segment_cells = cells;
  return options;
}

TEST(Segments, RoundTripsCutAnywhere) {
  SomeCases some(7);
  for (const GeneratedMesh& family : generated_meshes())
    for (const auto& [order, corner_order, delay] :
         {std::tuple(Order::keep, true, 0u), std::tuple(Order::keep, true, 6u),
          std::tuple(Order::stream, true, 0u), std::tuple(Order::stream, false, 4u)})
      for (std::uint64_t cells : {1u, 2u, 7u, 20u, 1000u}) {
        if (some.skips_next()) continue;
        SCOPED_TRACE(family.name + ", order " + (order == Order::keep ? "keep" : "stream") +
                     ", delay " + std::to_string(delay) + ", " + std::to_string(cells) +
                     " cells a segment");
        const TestMesh mesh = with_order(family.mesh, order, corner_order, delay);
        WriteOptions options = cut_every(cells);
        options.group_cells = 5;
        SizeReport report;
        const auto bytes = expect_round_trip(mesh, options, &report);
        EXPECT_EQ(report.segments, (mesh.cells.size() + cells - 1) / cells);
        EXPECT_EQ(report.imported_vertices > 0, report.segments > 1 && family.name != "broken");
        const auto back = read_mesh(bytes);
        ASSERT_TRUE(back);
        EXPECT_EQ(back->totals.imported_vertices, report.imported_vertices);
        ASSERT_EQ(back->totals.segment_starts.size(), report.segments);
        for (std::size_t s = 0; s < report.segments; ++s)
          EXPECT_EQ(back->totals.segment_starts[s], s * cells);
        for (const auto codec : codecs_without_delay()) {
          if (!can_be_in(mesh.schema, codec)) continue;
          options.connectivity = codec;
          SizeReport fast;
          expect_round_trip(mesh, options, &fast);
          EXPECT_EQ(fast.segments, report.segments);
          EXPECT_EQ(fast.imported_vertices, report.imported_vertices);
          EXPECT_EQ(fast.max_active_vertices, report.max_active_vertices);
        }
        if (!can_be_in(mesh.schema, ConnectivityCodec::shifts)) continue;
        // Each segment uses a different codec from the segment before it, so vertices are passed
        // from codec to codec.
        using enum ConnectivityCodec;
        options.segment_connectivity = {rows,   shifts, patterns, shifts,
                                        shifts, paper,  patterns, replay};
        expect_round_trip(mesh, options);
      }
}

TEST(Segments, CutWhereTheCallerSays) {
  WriteOptions options;
  options.segment_starts = {0, 10, 11, 40, 5000};
  SizeReport report;
  const auto bytes = expect_round_trip(bent_grid(4, 4, 4), options, &report);
  EXPECT_EQ(read_mesh(bytes)->totals.segment_starts, (std::vector<std::uint64_t>{0, 10, 11, 40}));
  options.segment_starts = {0};
  options.segment_cells = 3;
  expect_round_trip(bent_grid(4, 4, 4), options, &report);
  EXPECT_EQ(report.segments, 1u);
}

TEST(Segments, NoMeshNoSegment) {
  SizeReport report;
  expect_round_trip({hexahedra_schema(), {}, 0, {}, {}}, {}, &report);
  EXPECT_EQ(report.segments, 0u);
}

std::uint64_t segments_of(const TestMesh& mesh, double budget, std::uint64_t* imported = nullptr) {
  NullSink sink;
  const auto report = write_mesh(mesh, sink, {.restart_budget = budget});
  EXPECT_TRUE(report);
  if (!report) return 0;
  if (imported != nullptr) *imported = report->imported_vertices;
  return report->segments;
}

TEST(Segments, CutsKeepTheBudget) {
  // After each layer of 400 cells, 21 x 21 vertices are live, and a segment that begins there must
  // import them. That is 2 % of the vertices that 50 layers introduce, so the budget of 2 % alone
  // would allow a cut every 50 layers. The cuts are farther apart, because a segment has at least
  // 131072 cells.
  const TestMesh slim = grid(20, 20, 700);
  std::uint64_t imported = 0;
  EXPECT_EQ(segments_of(slim, .02, &imported), 3u);
  EXPECT_LE(imported, 2 * 470u);
  EXPECT_EQ(segments_of(slim, 0), 1u);
  if (kSanitized) return;
  // The budget limits the vertices that a new segment imports. With a budget of 20 %, a wide mesh
  // is cut into several segments. With a budget of 2 %, it can be cut only near its end, because
  // few vertices are live there.
  const TestMesh wide = grid(80, 80, 62);
  EXPECT_LE(segments_of(wide, .02, &imported), 2u);
  EXPECT_LE(imported, wide.vertices / 50);
  EXPECT_GE(segments_of(wide, .2, &imported), 3u);
  EXPECT_LE(imported, wide.vertices / 5);
}

TEST(Segments, BlocksBeginSegmentsEarlier) {
  TestMesh mesh = grid(20, 20, 205);  // the third block begins at cell 80000
  for (int b = 2; b <= 4; ++b) mesh.schema.blocks.push_back({b, "", CellShape::hexahedron, 8});
  for (std::size_t c = 0; c < mesh.cells.size(); ++c)
    mesh.cells[c].block = static_cast<std::uint32_t>(c / 40000);
  const auto bytes = expect_round_trip(mesh, {.restart_budget = .02});
  EXPECT_EQ(read_mesh(bytes)->totals.segment_starts, (std::vector<std::uint64_t>{0, 80000}));
}

TEST(Segments, ImportsAreCheapOnACoherentMesh) {
  const TestMesh mesh = bent_grid(30, 30, 30);
  for (Order order : {Order::keep, Order::stream}) {
    SizeReport whole, cut;
    expect_round_trip(with_order(mesh, order, order == Order::keep, 0), {}, &whole);
    expect_round_trip(with_order(mesh, order, order == Order::keep, 0), cut_every(6750), &cut);
    EXPECT_EQ(cut.segments, 4u);
    // One cut is at the end of a layer, two cuts are within a layer.
    EXPECT_EQ(cut.imported_vertices, 3u * 31 * 31 + 2 * 31);
    EXPECT_LE(cut.streams.at("imports"), 80u);
  }
  SizeReport shifts;
  WriteOptions options = cut_every(6750);
  options.connectivity = ConnectivityCodec::shifts;
  expect_round_trip(mesh, options, &shifts);
  EXPECT_EQ(shifts.imported_vertices, 3u * 31 * 31 + 2 * 31);
  EXPECT_LE(shifts.streams.at("connectivity"), 27000u / 8 / 2);  // one bit per two cells
  EXPECT_FALSE(shifts.streams.contains("imports"));
}

TEST(Segments, AnyNumberOfThreadsWritesTheSameBytes) {
  SomeCases some(kWatchesThreads ? 19 : 13);
  std::vector<GeneratedMesh> meshes = generated_meshes();
  meshes.push_back({"many cells", grid(20, 20, 20, ScalarType::float32, bent, porous)});
  for (const GeneratedMesh& family : meshes)
    for (const auto& [order, delay] :
         {std::pair(Order::keep, 0u), std::pair(Order::stream, 0u), std::pair(Order::stream, 5u)})
      for (std::uint64_t cells : {7u, 1500u}) {
        if (some.skips_next()) continue;
        SCOPED_TRACE(family.name + ", " + std::to_string(cells));
        const TestMesh mesh = with_order(family.mesh, order, true, delay);
        WriteOptions options = cut_every(cells);
        options.group_cells = 1000;
        const auto expect_same = [&] {
          options.threads = 1;
          const auto alone = expect_round_trip(mesh, options);
          options.threads = 3;
          EXPECT_EQ(expect_round_trip(mesh, options), alone);
          for (unsigned threads : {2u, 0u}) {
            MemorySink sink;
            options.threads = threads;
            ASSERT_TRUE(write_mesh(mesh, sink, options));
            EXPECT_EQ(sink.bytes, alone) << threads << " threads";
          }
        };
        expect_same();
        for (const auto codec : codecs_without_delay()) {
          if (!can_be_in(mesh.schema, codec)) continue;
          options.connectivity = codec;
          expect_same();
        }
      }
}

std::string text_read(std::span<const std::byte> bytes, const ReadOptions& options) {
  MemorySource source(bytes);
  auto reader = Reader::open(source, {}, options);
  if (!reader) return reader.error().message();
  Decoded decoded;
  decoded.schema = reader->schema();
  while (true) {
    auto item = reader->next();
    if (!item) return ItemText::of(decoded) + item.error().message();
    if (*item == nullptr) return ItemText::of(decoded);
    decoded.items.push_back(std::move(**item));
  }
}

/// Reads the file with different numbers of threads, and with different amounts of memory for
/// reading ahead. Checks that the Reader returns the same contents each time.
void expect_same_with_threads(std::span<const std::byte> bytes) {
  const std::string alone = text_read(bytes, {});
  for (const auto& [threads, ahead] :
       {std::pair(2u, std::uint64_t{1} << 28), std::pair(3u, std::uint64_t{2000}),
        std::pair(2u, std::uint64_t{0})})
    ASSERT_EQ(text_read(bytes, {threads, ahead}), alone) << threads << " threads";
}

TEST(Segments, AnyNumberOfThreadsReadsTheSame) {
  for (const FeatureFile& feature : feature_files()) {
    SCOPED_TRACE(feature.name);
    expect_same_with_threads(feature.bytes);
  }
  MemorySink sink;
  WriteOptions options = cut_every(700);
  options.group_cells = 300;
  ASSERT_TRUE(write_mesh(grid(20, 20, 20, ScalarType::float32, bent, porous), sink, options));
  expect_same_with_threads(sink.bytes);
  sink.bytes.clear();
  options.connectivity = ConnectivityCodec::shifts;
  ASSERT_TRUE(write_mesh(grid(20, 20, 20, ScalarType::float32, bent, porous), sink, options));
  expect_same_with_threads(sink.bytes);
}

TEST(Segments, DamageIsToldAlikeWithThreads) {
  SomeCases some(3);
  for (const char* name : {"segments", "segments_stream", "shifts"}) {
    std::vector<std::byte> bytes;
    for (const FeatureFile& feature : feature_files())
      if (feature.name == name) bytes = feature.bytes;
    for (std::size_t at = 0; at < bytes.size(); at += 29) {
      if (some.skips_next()) continue;
      SCOPED_TRACE(std::string(name) + ", byte " + std::to_string(at));
      bytes[at] ^= std::byte{4};
      expect_same_with_threads(bytes);
      bytes[at] ^= std::byte{4};
      expect_same_with_threads(std::span(bytes).first(at));
    }
    // Damages a group in three ways and corrects the checksums: changes a byte in the middle of
    // each bitstream, or changes the segment number or the first vertex number in the headers.
    for (std::size_t nth = 0; nth < 5; ++nth) {
      FileParts parts = take_apart(bytes);
      Chunk* chunk = parts.find(container::ChunkKind::group, nth);
      auto group = take_group_apart(*chunk);
      ASSERT_TRUE(group);
      for (auto& stream : group->streams)
        if (!stream.empty()) stream[stream.size() / 2] ^= std::byte{0x55};
      chunk->payload = put_group_together(*group);
      expect_same_with_threads(put_together(parts));
      parts = take_apart(bytes);
      parts.find(container::ChunkKind::group, nth)->header.segment ^= 1;
      expect_same_with_threads(put_together(parts));
      parts = take_apart(bytes);
      chunk = parts.find(container::ChunkKind::group, nth);
      group = take_group_apart(*chunk);
      ++group->header.first_vertex;
      chunk->payload = put_group_together(*group);
      expect_same_with_threads(put_together(parts));
    }
  }
}

TEST(Segments, ReadersWithThreadsMayBeLeft) {
  MemorySink sink;
  ASSERT_TRUE(write_mesh(grid(20, 20, 20), sink, cut_every(300)));
  for (int items : {0, 1, 5}) {
    MemorySource source(sink.bytes);
    auto reader = Reader::open(source, {}, {3, std::uint64_t{1} << 20});
    ASSERT_TRUE(reader);
    for (int i = 0; i < items; ++i) ASSERT_TRUE(reader->next());
  }
}

TEST(Segments, EachIsReadAlone) {
  using enum ConnectivityCodec;
  for (const auto& [order, codec] :
       {std::pair(Order::keep, automatic), std::pair(Order::stream, automatic),
        std::pair(Order::keep, shifts)}) {
    SCOPED_TRACE(codec_name(codec));
    TestMesh mesh = with_order(grid(12, 10, 10, ScalarType::float64, bent, porous), order,
                               order == Order::keep, codec == shifts ? 0 : 7);
    add_array(mesh, array_of("u", Location::point, ScalarType::float32, 2), mesh.vertices);
    add_array(mesh, array_of("p", Location::cell, ScalarType::int16), mesh.cells.size());
    WriteOptions options = cut_every(200);
    options.group_cells = 90;
    options.connectivity = codec;
    const auto bytes = expect_round_trip(mesh, options);
    const auto whole = read_mesh(bytes);
    ASSERT_TRUE(whole);
    // maps from vertex numbers to values
    std::map<std::uint64_t, std::vector<std::byte>> values;
    const auto values_of = [](const MeshBlock& block, std::size_t v) {
      std::vector<std::byte> all(32);
      std::memcpy(all.data(), &block.xyz.at(v * 24), 24);
      std::memcpy(all.data() + 24, &block.arrays[0].at(v * 8), 8);
      return all;
    };
    for (std::size_t v = 0; v < whole->mesh.vertex_count(); ++v)
      values[whole->mesh.vertex_numbers[v]] = values_of(whole->mesh, v);

    CountedSource source(bytes);
    auto reader = SegmentReader::open(source);
    ASSERT_TRUE(reader) << reader.error().message();
    EXPECT_EQ(reader->schema(), mesh.schema);
    ASSERT_EQ(reader->segments().size(), whole->totals.segment_starts.size());
    std::uint64_t imported = 0;
    for (std::size_t s = reader->segments().size(); s-- > 0;) {  // in any order
      const SegmentInfo& info = reader->segments()[s];
      source.bytes = 0;
      const auto blocks = reader->read(s);
      ASSERT_TRUE(blocks) << blocks.error().message();
      EXPECT_EQ(source.bytes, info.bytes);
      std::uint64_t cell = info.first_cell;
      std::uint64_t own = 0;
      EXPECT_EQ(cell, whole->totals.segment_starts[s]);
      std::unordered_map<std::uint64_t, int> known;
      for (const MeshBlock& block : *blocks) {
        ASSERT_EQ(block.imported.size(), block.vertex_count());
        for (std::size_t v = 0; v < block.vertex_count(); ++v) {
          ++known[block.vertex_numbers[v]];
          EXPECT_EQ(values_of(block, v), values.at(block.vertex_numbers[v]));
          own += block.imported[v] == 0 ? 1 : 0;
          imported += block.imported[v];
        }
        for (std::size_t c = 0; c < block.cell_count(); ++c, ++cell) {
          const auto corners = std::span(block.corners).subspan(block.corner_begin[c], 8);
          const auto expected =
              std::span(whole->mesh.corners).subspan(whole->mesh.corner_begin[cell], 8);
          EXPECT_TRUE(std::equal(corners.begin(), corners.end(), expected.begin()));
          EXPECT_EQ(block.cell_numbers[c], whole->mesh.cell_numbers[cell]);
          for (std::uint64_t corner : corners) EXPECT_EQ(known[corner], 1);
        }
      }
      EXPECT_EQ(cell, info.first_cell + info.cells);
      EXPECT_EQ(own, info.vertices);
    }
    EXPECT_EQ(imported, whole->totals.imported_vertices);
    EXPECT_EQ(reader->read(99).error().code, ErrorCode::misuse);
  }
}

class SegmentsReadAlone : public ::testing::TestWithParam<const char*> {};

TEST_P(SegmentsReadAlone, DamageIsNoticed) {
  const auto bytes = std::string(GetParam()) == "shifts"
                         ? rows_of_cells(ConnectivityCodec::shifts, Level::standard)
                         : segments_file(Order::stream, false, 0, 6);
  const auto read_all = [](std::span<const std::byte> file) -> Result<std::size_t> {
    MemoryRandomSource source(file);
    auto reader = SegmentReader::open(source);
    if (!reader) return reader.error();
    std::size_t blocks = 0;
    for (std::size_t s = 0; s < reader->segments().size(); ++s) {
      auto segment = reader->read(s);
      if (!segment) return segment.error();
      blocks += segment->size();
    }
    return blocks;
  };
  ASSERT_TRUE(read_all(bytes));
  for (std::size_t size = 0; size < bytes.size(); size += 3)
    EXPECT_FALSE(read_all(std::span(bytes).first(size))) << size;
  // The index is inconsistent, but its checksums are correct. Reading must return either an error
  // or the correct blocks. It must never crash.
  PlainRandom random(11);
  for (int n = 0; n < 300; ++n) {
    FileParts parts = take_apart(bytes);
    auto& index = parts.chunks.back().payload;
    index[random.below(index.size())] = static_cast<std::byte>(random.bits());
    (void)static_cast<bool>(read_all(put_together(parts)));
  }
}

INSTANTIATE_TEST_SUITE_P(Segments, SegmentsReadAlone, ::testing::Values("predicted", "shifts"),
                         [](const auto& it) { return std::string(it.param); });

TEST(Segments, ExtrasBetweenCellsStandInTheSamePlace) {
  const TestMesh mesh = grid(40, 10, 10);
  std::vector<std::byte> alone;
  for (unsigned threads : {1u, 3u}) {
    MemorySink sink;
    WriteOptions options = cut_every(500);
    options.group_cells = 200;
    options.threads = threads;
    auto writer = Writer::create(sink, mesh.schema, options);
    ASSERT_TRUE(writer);
    for (std::uint64_t v = 0; v < mesh.vertices; ++v)
      ASSERT_TRUE(writer->add_vertex(v, std::span(mesh.xyz).subspan(v * 12, 12)));
    for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
      ASSERT_TRUE(writer->add_cell(0, mesh.cells[c].corners));
      if (c % 777 == 700) {
        ASSERT_TRUE(
            writer->add_extra({"test/now", ScalarType::uint8, Reference::nothing, {0}, {}}));
      }
    }
    ASSERT_TRUE(writer->finish());
    if (threads == 1) alone = sink.bytes;
    EXPECT_EQ(sink.bytes, alone);
  }
}

/// A sink that fails after it has accepted a given number of bytes.
class BrokenSink final : public ByteSink {
 public:
  Result<void> write(std::span<const std::byte> bytes) override {
    bytes_ += bytes.size();
    if (bytes_ < 1000) return {};
    return Error{ErrorCode::output, "is full", {}, kNoOffset, "disk"};
  }

 private:
  std::size_t bytes_ = 0;
};

TEST(Segments, ErrorsComeOutOfThreads) {
  WriteOptions options = cut_every(100);
  options.threads = 3;
  BrokenSink sink;
  const auto report = write_mesh(grid(20, 20, 20), sink, options);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::output);
}

TEST(Segments, WritersWithThreadsMayBeLeft) {
  const TestMesh mesh = grid(20, 20, 20);
  for (std::size_t cells : {0u, 1u, 1500u, 8000u}) {
    NullSink sink;
    WriteOptions options = cut_every(300);
    options.threads = 2;
    auto writer = Writer::create(sink, mesh.schema, options);
    ASSERT_TRUE(writer);
    for (std::uint64_t v = 0; v < mesh.vertices; ++v)
      ASSERT_TRUE(writer->add_vertex(v, std::span(mesh.xyz).subspan(v * 12, 12)));
    for (std::size_t c = 0; c < cells; ++c) ASSERT_TRUE(writer->add_cell(0, mesh.cells[c].corners));
  }
}

class FailingTask final : public OrderedTasks<int, int>::Task {
 public:
  Result<void> take(int& in, const OrderedTasks<int, int>::Emit& emit) override {
    if (in < 0) throw std::bad_alloc();
    emit(in, 4);
    return {};
  }
  Result<void> end(const OrderedTasks<int, int>::Emit&) override { return {}; }
};

// Runs each test twice: with two threads, and with 0 threads as on a system without threads.
class OrderedTasksBy : public testing::TestWithParam<unsigned> {};

TEST_P(OrderedTasksBy, NoMemoryComesOutInItsTurn) {
  OrderedTasks<int, int> tasks(GetParam(), {.in = 1 << 20, .out = 1 << 20, .alone = 0});
  for (int task = 0; task < 3; ++task) {
    tasks.begin(std::make_unique<FailingTask>());
    tasks.push(task, 4);
    if (task == 1) tasks.push(-1, 4);
  }
  tasks.end();
  const auto wait = OrderedTasks<int, int>::Wait::for_output;
  for (int task = 0; task < 2; ++task) {
    const auto out = tasks.next(wait);
    ASSERT_TRUE(out && *out);
    EXPECT_EQ(**out, task);
  }
  EXPECT_THROW((void)tasks.next(wait), std::bad_alloc);
  EXPECT_THROW((void)tasks.next(wait), std::bad_alloc);
}

INSTANTIATE_TEST_SUITE_P(Threads, OrderedTasksBy, testing::Values(2u, 0u));

// A task whose output is the id of the thread that ran it.
class WhereTask final : public OrderedTasks<int, std::thread::id>::Task {
 public:
  Result<void> take(int&, const OrderedTasks<int, std::thread::id>::Emit& emit) override {
    emit(std::this_thread::get_id(), 4);
    return {};
  }
  Result<void> end(const OrderedTasks<int, std::thread::id>::Emit&) override { return {}; }
};

using WhereTasks = OrderedTasks<int, std::thread::id>;

/// Returns the next output of the tasks. If no output is left, returns a default thread id.
std::thread::id next_of(WhereTasks& tasks, WhereTasks::Wait wait = WhereTasks::Wait::for_output) {
  const auto out = tasks.next(wait);
  return out && *out ? **out : std::thread::id();
}

TEST(OrderedTasks, ThreadsBeginWhenThereIsMoreToDo) {
  WhereTasks tasks(2, {.in = 1 << 20, .out = 1 << 20, .alone = 12});
  const auto none = std::thread::id(), here = std::this_thread::get_id();
  tasks.begin(std::make_unique<WhereTask>());
  tasks.push(0, 4);
  EXPECT_EQ(next_of(tasks, WhereTasks::Wait::no), here);
  tasks.push(1, 4);
  EXPECT_EQ(next_of(tasks), here);
  EXPECT_EQ(next_of(tasks), none);
  tasks.push(2, 4);
  const auto other = next_of(tasks);
  EXPECT_NE(other, none);
  EXPECT_EQ(other != here, kHasThreads);
  tasks.end();
  EXPECT_EQ(next_of(tasks), none);
  EXPECT_TRUE(tasks.is_idle());
}

TEST(OrderedTasks, ThreadsBeginWithASecondTask) {
  WhereTasks tasks(2, {.in = 1 << 20, .out = 1 << 20, .alone = 1 << 20});
  const auto none = std::thread::id(), here = std::this_thread::get_id();
  for (int i = 0; i < 2; ++i) {  // each task ends before the next begins
    tasks.begin(std::make_unique<WhereTask>());
    tasks.push(i, 4);
    tasks.end();
    EXPECT_EQ(next_of(tasks), here);
    EXPECT_EQ(next_of(tasks), none);
  }
  for (int i = 0; i < 2; ++i) {
    tasks.begin(std::make_unique<WhereTask>());
    tasks.push(i, 4);
  }
  tasks.end();
  for (int i = 0; i < 2; ++i) {
    const auto other = next_of(tasks);
    EXPECT_NE(other, none);
    EXPECT_EQ(other != here, kHasThreads);
  }
  EXPECT_EQ(next_of(tasks), none);
}

// --- threads of the process

std::ptrdiff_t threads_now() {
  std::error_code none;
  const std::filesystem::directory_iterator threads("/proc/self/task", none);
  return std::distance(begin(threads), end(threads));
}

/// A sink that counts the threads of this process at each write, and records the largest count.
class ThreadCountingSink final : public ByteSink {
 public:
  Result<void> write(std::span<const std::byte> bytes) override {
    most = std::max(most, threads_now());
    written.insert(written.end(), bytes.begin(), bytes.end());
    return {};
  }
  std::ptrdiff_t most = 0;
  std::vector<std::byte> written;
};

/// Reads a whole file with a Reader. Returns the largest number of threads of this process during
/// reading.
std::ptrdiff_t threads_to_read(std::span<const std::byte> bytes) {
  MemorySource source(bytes);
  auto reader = Reader::open(source, {}, {.threads = 2});
  std::ptrdiff_t most = 0;
  while (reader) {
    const auto item = reader->next();
    EXPECT_TRUE(item);
    most = std::max(most, threads_now());
    if (!item || *item == nullptr) return most;
  }
  ADD_FAILURE() << "cannot be opened";
  return most;
}

/// Waits until the operating system has removed the threads that were joined. Returns the number of
/// remaining threads.
std::ptrdiff_t threads_left() {
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return threads_now();
}

TEST(Segments, ThreadsBeginWhereThereIsWorkForThem) {
  if (threads_now() == 0 || !kHasThreads) GTEST_SKIP() << "the number of threads is unknown";
  std::thread([] {}).join();  // makes ThreadSanitizer start its own thread now
  const std::ptrdiff_t before = threads_left();
  WriteOptions options;
  options.threads = 2;
  ThreadCountingSink small, in_two, large;
  ASSERT_TRUE(write_mesh(bent_grid(5, 5, 5), small, options));
  options.group_cells = 1000;
  ASSERT_TRUE(write_mesh(grid(20, 20, 20, ScalarType::float32, bent, porous), large, options));
  options.segment_cells = 63;
  ASSERT_TRUE(write_mesh(bent_grid(5, 5, 5), in_two, options));
  EXPECT_EQ(threads_left(), before);
  EXPECT_EQ(small.most, before);
  EXPECT_EQ(in_two.most, before + 2);
  EXPECT_EQ(large.most, before + 2);
  EXPECT_EQ(threads_to_read(small.written), before);
  EXPECT_EQ(threads_to_read(in_two.written), before + 2);
  EXPECT_EQ(threads_left(), before);
  EXPECT_EQ(threads_to_read(large.written), before + 2);
}

}  // namespace
}  // namespace shm
