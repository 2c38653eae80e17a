// Tests of Appender. A file whose steps were added in several runs must equal, byte for byte, a
// file written in one run. Existing contents are kept. Inconsistent files are refused without
// writing any output.
#include "shm/appender.h"

#include <gtest/gtest.h>

#include "shm/segment_reader.h"
#include "shm/step_reader.h"
#include "support/file_surgery.h"
#include "support/golden_files.h"
#include "support/sanitized.h"
#include "support/stepped_mesh.h"

namespace shm {
namespace {

using container::ChunkKind;

std::vector<double> times_to(std::uint64_t end) {
  std::vector<double> times;
  for (std::uint64_t step = 0; step < end; ++step) times.push_back(.25 * static_cast<double>(step));
  return times;
}

Extra extra_of(std::string key, std::size_t bytes) {
  Extra extra;
  extra.key = std::move(key);
  extra.shape = {bytes};
  std::mt19937_64 random(bytes);
  for (std::size_t i = 0; i < bytes; ++i) extra.data.push_back(static_cast<std::byte>(random()));
  return extra;
}

/// Adds the steps from `from` up to but excluding `end` to a Writer or an Appender. Each step has
/// values for all of its arrays.
template <class To>
Result<void> put_steps(To& to, const Stepped& stepped, std::uint64_t from, std::uint64_t end) {
  for (std::uint64_t step = from; step < end; ++step)
    for (const auto& [key, values] : stepped.values)
      if (key.second == step)
        if (auto status = to.add_step_values(key.first, step, values); !status) return status;
  return {};
}

enum class Times { last, first, none };

/// Returns a file that contains the steps before step `end`.
Bytes file_with(const Stepped& stepped, std::uint64_t end, std::size_t extra_bytes = 100,
                Times place = Times::last) {
  MemorySink sink;
  const auto report =
      write_mesh(stepped.mesh, sink, stepped.options, [&](Writer& writer) -> Result<void> {
        const auto times = times_to(end);
        if (place == Times::first)
          if (auto status = writer.set_step_times(times); !status) return status;
        if (auto status = writer.add_extra(extra_of("a/b", extra_bytes)); !status) return status;
        if (auto status = put_steps(writer, stepped, 0, end); !status) return status;
        if (place != Times::last) return {};
        return writer.set_step_times(times);
      });
  EXPECT_TRUE(report) << (report ? "" : report.error().message());
  return std::move(sink.bytes);
}

/// Appends the steps from `from` up to but excluding `end` to `file`. Returns the resulting file.
Bytes appended(const Bytes& file, const Stepped& stepped, std::uint64_t from, std::uint64_t end,
               Times place = Times::last) {
  MemoryRandomSource source(file);
  MemorySink sink;
  AppendOptions options;
  options.level = stepped.options.level;
  options.key_steps = stepped.options.key_steps;
  auto appender = Appender::open(source, sink, options);
  EXPECT_TRUE(appender) << (appender ? "" : appender.error().message());
  if (!appender) return {};
  if (place == Times::first) (void)appender->set_step_times(times_to(end));
  const auto status = put_steps(*appender, stepped, from, end);
  EXPECT_TRUE(status) << (status ? "" : status.error().message());
  if (place == Times::last) (void)appender->set_step_times(times_to(end));
  const auto report = appender->finish();
  EXPECT_TRUE(report) << (report ? "" : report.error().message());
  if (report) {
    EXPECT_EQ(report->total_bytes, sink.bytes.size());
  }
  return std::move(sink.bytes);
}

ReadBack read(const Bytes& bytes) {
  auto back = read_mesh(bytes);
  EXPECT_TRUE(back) << (back ? "" : back.error().message());
  return back ? std::move(*back) : ReadBack();
}

Values values_of(const ReadBack& back) {
  Values values;
  for (const StepPiece& piece : back.steps) {
    Bytes& to = values[{piece.array, piece.step}];
    to.insert(to.end(), piece.values.begin(), piece.values.end());
  }
  return values;
}

/// Returns a mesh with eleven steps of changing point and cell arrays; some arrays have no values
/// at step 3.
Stepped series(TestMesh mesh, Order order) {
  Stepped stepped = with_steps(std::move(mesh), order);
  stepped.values.clear();
  for (std::uint32_t a = 0; a < stepped.mesh.schema.arrays.size(); ++a)
    for (std::uint64_t step = 0; step < 11; ++step)
      if (stepped.mesh.schema.arrays[a].per_step && (step != 3 || a % 2 == 0))
        stepped.values[{a, step}] =
            moving_values(stepped.mesh.schema.arrays[a], elements_of(stepped.mesh, a), step);
  return stepped;
}

TEST(Appender, IsOneRunOfTheWriter) {
  SomeCases some(7);
  for (const auto& [order, delay] :
       {std::pair(Order::keep, 6u), std::pair(Order::stream, 4u), std::pair(Order::free, 0u)})
    for (const std::uint64_t segment_cells : {0u, 60u})
      for (const bool mixed : {false, true})
        for (const std::uint32_t key_steps : {1u, 3u, 8u}) {
          if (some.skips_next()) continue;
          Stepped stepped = series(mixed ? mixed_cells() : two_blocks(), order);
          stepped.mesh.schema.delay = delay;
          stepped.options.segment_cells = segment_cells;
          stepped.options.group_cells = 50;
          stepped.options.key_steps = key_steps;
          stepped.options.level = mixed ? Level::best : Level::standard;
          SCOPED_TRACE(std::string(order_name(order)) + ", delay " + std::to_string(delay) +
                       ", segments " + std::to_string(segment_cells) + ", key steps " +
                       std::to_string(key_steps) + (mixed ? ", mixed" : ""));
          const Bytes whole = file_with(stepped, 11);
          for (const std::uint64_t split : {0u, 2u, 3u, 8u})
            EXPECT_TRUE(appended(file_with(stepped, split), stepped, split, 11) == whole) << split;
        }
}

TEST(Appender, OneStepAfterTheOther) {
  Stepped stepped = waves(20);
  Bytes file = file_with(stepped, 0);
  for (std::uint64_t step = 0; step < 20; ++step) file = appended(file, stepped, step, step + 1);
  EXPECT_TRUE(file == file_with(stepped, 20));
  EXPECT_GT(20 * (file_with(stepped, 1).size() - file_with(stepped, 0).size()),
            3 * (file.size() - file_with(stepped, 0).size()))
      << "steps do not refer to each other";
}

TEST(Appender, TheSchemaIsSaidAgainAtTheEndOnly) {
  const Stepped stepped = waves(6);
  constexpr std::size_t kMuch = std::size_t{1} << 20;
  const Bytes file = file_with(stepped, 4, kMuch);
  EXPECT_NE(take_apart(file).find(ChunkKind::schema, 1), nullptr);
  const Bytes more = appended(file, stepped, 4, 6);
  EXPECT_TRUE(more == file_with(stepped, 6, kMuch));
  EXPECT_EQ(take_apart(more).find(ChunkKind::schema, 2), nullptr);
}

// If the last chunk of step values has space for further parts, the appender reads the part headers
// of that chunk. It supports version 0 and version 1 of the chunk.
TEST(Appender, GoesOnBehindAChunkOfVersion0) {
  Stepped stepped;
  stepped.options.digest = false;  // chunks of version 0 have no digest
  stepped.mesh = with_order(grid(5, 4, 3, ScalarType::float64, warped), Order::keep, true, 0);
  const auto a = add_stepped(stepped.mesh, array_of("a", Location::cell, ScalarType::float64));
  for (std::uint64_t step = 0; step < 2; ++step)
    stepped.values[{a, step}] = moving_values(stepped.mesh.schema.arrays[a], 60, step);
  FileParts parts = take_apart(file_with(stepped, 1));
  Chunk& chunk = *parts.find(ChunkKind::step_values);
  auto steps = take_steps_apart(chunk);
  ASSERT_TRUE(steps && steps->heads.size() == 1);
  chunk.header.version = 0;
  const std::size_t bytes = chunk.payload.size();
  ASSERT_LT(bytes, container::kPartBytesTogether);
  chunk.payload = put_steps_together(std::move(*steps), 0);
  const std::size_t fewer = bytes - chunk.payload.size();
  const Bytes file = with_index(put_together(std::move(parts)), [&](container::Index& index) {
    entry_of(index, ChunkKind::step_values, 0).bytes -= fewer;
  });
  EXPECT_TRUE(values_of(read(appended(file, stepped, 1, 2))) ==
              values_of(read(file_with(stepped, 2))));
}

// The appender writes new chunks in the format version of the existing file, so that readers of
// that version can read them.
TEST(Appender, FilesOfAnOlderVersionStayOfIt) {
  for (const char* name : {"0.1/steps_and_extras.shm", "0.9/steps_and_extras.shm"}) {
    const std::string text = content(golden_folder() / name);
    const auto old_bytes = std::as_bytes(std::span(text));
    const Bytes old(old_bytes.begin(), old_bytes.end());
    const ReadBack before = read(old);
    MemoryRandomSource source(old);
    MemorySink sink;
    auto appender = Appender::open(source, sink);
    ASSERT_TRUE(appender) << appender.error().message();
    const std::uint64_t step = appender->steps();
    std::map<std::pair<std::uint32_t, std::uint64_t>, Bytes> values = values_of(before);
    for (std::uint32_t a = 0; a < appender->schema().arrays.size(); ++a) {
      if (!appender->schema().arrays[a].per_step) continue;
      const Bytes last = std::prev(values.lower_bound({a + 1, 0}))->second;
      ASSERT_TRUE(appender->add_step_values(a, step, last));
      values[{a, step}] = last;
    }
    ASSERT_TRUE(appender->add_extra(extra_of("one/more", 100)));
    ASSERT_TRUE(appender->add_extra(extra_of("and/another", 100)));
    ASSERT_TRUE(appender->finish());
    const FileParts parts = take_apart(sink.bytes), parts_before = take_apart(old);
    EXPECT_EQ(parts.start, parts_before.start);
    for (const Chunk& chunk : parts.chunks) EXPECT_EQ(chunk.header.version, 0);
    const ReadBack after = read(sink.bytes);
    EXPECT_TRUE(values_of(after) == values);
    EXPECT_EQ(after.extras.size(), before.extras.size() + 2);
  }
}

TEST(Appender, ReadersTakeItWhereverTheTimesStood) {
  const Stepped stepped = series(two_blocks(), Order::keep);
  for (const Times before : {Times::last, Times::first, Times::none})
    for (const Times after : {Times::last, Times::first}) {
      const Bytes file = appended(file_with(stepped, 5, 100, before), stepped, 5, 11, after);
      const ReadBack back = read(file);
      EXPECT_TRUE(values_of(back) == stepped.values);
      EXPECT_EQ(back.times, times_to(11));
      ASSERT_EQ(back.extras.size(), 1u);
      EXPECT_EQ(back.extras[0], extra_of("a/b", 100));
      MemoryRandomSource source(file);
      auto reader = StepReader::open(source);
      ASSERT_TRUE(reader) << reader.error().message();
      EXPECT_EQ(reader->step_times(), times_to(11));
      for (const auto& [key, values] : stepped.values) {
        StepRequest request;
        request.array = key.first;
        request.step = key.second;
        const auto pieces = reader->read(request);
        ASSERT_TRUE(pieces) << pieces.error().message();
        Bytes all;
        for (const StepValues& piece : *pieces)
          all.insert(all.end(), piece.values.begin(), piece.values.end());
        EXPECT_TRUE(all == values) << key.first << ", " << key.second;
      }
      auto segments = SegmentReader::open(source);
      ASSERT_TRUE(segments) << segments.error().message();
      EXPECT_TRUE(segments->read(0));
    }
}

TEST(Appender, TimesAndExtrasStayWhereNothingElseIsSaid) {
  const Stepped stepped = series(two_blocks(), Order::keep);
  const Bytes file = file_with(stepped, 5);
  EXPECT_TRUE(appended(file, stepped, 5, 5, Times::none) == file);
  const ReadBack back = read(appended(file, stepped, 5, 7, Times::none));
  EXPECT_EQ(back.times, times_to(5));

  MemoryRandomSource source(file);
  MemorySink sink;
  auto appender = Appender::open(source, sink);
  ASSERT_TRUE(appender);
  ASSERT_TRUE(appender->drop_extras());
  ASSERT_TRUE(appender->add_extra(extra_of("other", 5)));
  ASSERT_TRUE(appender->add_extra(extra_of("more", 0)));
  EXPECT_FALSE(appender->drop_extras());
  const auto report = appender->finish();
  EXPECT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::misuse);
}

TEST(Appender, OtherExtras) {
  const Stepped stepped = series(two_blocks(), Order::keep);
  const Bytes file = file_with(stepped, 5);
  MemoryRandomSource source(file);
  MemorySink sink;
  auto appender = Appender::open(source, sink);
  ASSERT_TRUE(appender);
  EXPECT_EQ(appender->steps(), 5u);
  EXPECT_EQ(appender->step_times(), times_to(5));
  ASSERT_TRUE(appender->drop_extras());
  ASSERT_TRUE(appender->add_extra(extra_of("other", 5)));
  ASSERT_TRUE(appender->finish());
  const ReadBack back = read(sink.bytes);
  ASSERT_EQ(back.extras.size(), 1u);
  EXPECT_EQ(back.extras[0].key, "other");
  EXPECT_EQ(back.times, times_to(5));
}

TEST(Appender, GivesTheMeshWithoutSteps) {
  for (const std::size_t extra_bytes : {std::size_t{100}, std::size_t{1} << 20})
    for (const Times place : {Times::last, Times::first, Times::none}) {
      const Stepped stepped = series(two_blocks(), Order::stream);
      const Bytes file = file_with(stepped, 5, extra_bytes, place);
      MemoryRandomSource source(file);
      NullSink sink;
      auto appender = Appender::open(source, sink);
      ASSERT_TRUE(appender);
      auto bare = appender->without_steps();
      ASSERT_TRUE(bare) << bare.error().message();
      Bytes bytes(file.size());
      std::size_t size = 0;
      for (std::size_t piece = 1; piece != 0; size += piece) {
        const auto n = (*bare)->read(std::span(bytes).subspan(
            size, std::min<std::size_t>(1 + size % 77, bytes.size() - size)));
        ASSERT_TRUE(n) << n.error().message();
        piece = *n;
      }
      bytes.resize(size);
      const ReadBack back = read(bytes), old = read(file);
      EXPECT_TRUE(back.mesh.corners == old.mesh.corners && back.mesh.xyz == old.mesh.xyz);
      EXPECT_TRUE(back.mesh.vertex_numbers == old.mesh.vertex_numbers);
      EXPECT_TRUE(back.steps.empty());
      EXPECT_EQ(back.times, old.times);
      EXPECT_EQ(back.extras, old.extras);
      EXPECT_EQ(sink.bytes, 0u);
    }
}

// Coordinates are quantized to 10 bits within a box. Values outside the box must be within the same
// error bound. Values that are not finite are restored exactly.
TEST(Appender, QuantizedArraysKeepTheirBound) {
  Stepped stepped;
  stepped.mesh = with_order(grid(5, 4, 3, ScalarType::float64, warped), Order::keep, true, 0);
  ArrayInfo boxed = array_of("boxed", Location::cell, ScalarType::float64);
  boxed.quantization = {10, {-2}, {2}, 0, 0};
  ArrayInfo bounded = array_of("bounded", Location::cell, ScalarType::float64);
  bounded.quantization = Quantization::absolute(.01, 1);
  const auto a = add_stepped(stepped.mesh, boxed), b = add_stepped(stepped.mesh, bounded);
  for (const std::uint32_t array : {a, b})
    for (std::uint64_t step = 0; step < 6; ++step)  // up to 6 in magnitude
      stepped.values[{array, step}] = moving_values(stepped.mesh.schema.arrays[array], 60, step);
  const Bytes file = appended(file_with(stepped, 2), stepped, 2, 6);
  EXPECT_TRUE(file == file_with(stepped, 6));
  std::size_t beyond = 0;
  for (const auto& [key, values] : values_of(read(file))) {
    const ArrayInfo& info = stepped.mesh.schema.arrays[key.first];
    for (std::size_t i = 0; i < values.size(); i += 8) {
      double was = 0, is = 0;
      std::memcpy(&was, &stepped.values.at(key)[i], 8);
      std::memcpy(&is, &values[i], 8);
      const bool outside = key.first == a && std::isfinite(was) && std::fabs(was) > 2.01;
      beyond += outside;
      if (!std::isfinite(was))
        EXPECT_EQ(std::memcmp(&was, &is, 8), 0);
      else
        EXPECT_LE(std::fabs(was - is), info.quantization.max_error(info.type));
    }
  }
  EXPECT_GT(beyond, 20u);
}

TEST(Appender, RefusesWhatDoesNotFit) {
  const Stepped stepped = series(two_blocks(), Order::keep);
  const Bytes file = file_with(stepped, 5);
  const auto u = static_cast<std::uint32_t>(stepped.mesh.schema.arrays.size() - 5);
  const Bytes& values = stepped.values.at({u, 4});
  const auto refused = [&](std::uint32_t array, std::uint64_t step,
                           std::span<const std::byte> some) {
    MemoryRandomSource source(file);
    MemorySink sink;
    auto appender = Appender::open(source, sink);
    EXPECT_TRUE(appender);
    const auto status = appender->add_step_values(array, step, some);
    const auto report = appender->finish();
    EXPECT_FALSE(report) << array << ", " << step;
    if (report) return;
    EXPECT_EQ(report.error().code, ErrorCode::misuse);
    if (!status) {
      EXPECT_EQ(report.error().message(), status.error().message()) << "the first error sticks";
    }
  };
  refused(u, 4, values);                                      // already present
  refused(u, 5, std::span(values).first(values.size() / 2));  // incomplete
  refused(u, 5, std::span(values).first(7));
  refused(99, 5, values);
  EXPECT_FALSE(appended(file, stepped, 5, 6).empty());
}

/// Opens a damaged file with an Appender, adds a step and finishes. Returns true if that succeeds.
/// The resulting file must be readable up to the existing damage.
bool survives(const Bytes& file, const Stepped& stepped) {
  MemoryRandomSource source(file);
  MemorySink sink;
  auto appender = Appender::open(source, sink);
  if (!appender) return false;
  (void)appender->without_steps();
  const auto status = put_steps(*appender, stepped, 5, 6);
  return status && appender->finish();
}

TEST(Appender, RefusesFilesThatAreDamagedOrLie) {
  Stepped stepped = series(grid(3, 3, 2, ScalarType::float64, warped), Order::keep);
  const Bytes file = file_with(stepped, 5);
  ASSERT_TRUE(survives(file, stepped));
  for (std::size_t cut = 0; cut < file.size(); cut += kSanitized ? 97 : 7) {
    EXPECT_FALSE(
        survives(Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(cut)), stepped));
  }
  std::size_t refused = 0;
  for (std::size_t at = 0; at < file.size(); at += every(5) * 11) {
    Bytes damaged = file;
    damaged[at] ^= std::byte{0x10};
    refused += !survives(damaged, stepped);
  }
  EXPECT_GT(refused, 10u);
  // Damage to the index, with correct checksums.
  const FileParts parts = take_apart(file);
  const std::size_t size = parts.chunks.back().payload.size();
  for (std::size_t at = 0; at < size; ++at)
    for (const int change : {0x01, 0x80, 0xff}) {
      FileParts inconsistent = parts;
      inconsistent.chunks.back().payload[at] ^= static_cast<std::byte>(change);
      (void)survives(put_together(std::move(inconsistent)), stepped);
    }
  // Damages the list of chunks in two ways: removes a chunk, and changes the sequence number of
  // another chunk.
  FileParts without = parts;
  without.chunks.erase(without.chunks.begin() + 2);
  EXPECT_FALSE(survives(put_together(std::move(without)), stepped));
  FileParts renumbered = parts;
  renumbered.chunks[2].header.sequence += 1;
  EXPECT_FALSE(survives(put_together(std::move(renumbered), Numbering::as_they_are), stepped));
}

}  // namespace
}  // namespace shm
