// Tests of StepReader: it returns the same values as a Reader for one array at one step, reads only
// the bytes that it needs, and refuses inconsistent files.
#include "shm/step_reader.h"
#include "codecs/shared/codec_id.h"

#include <set>

#include "support/counted_source.h"
#include "support/file_surgery.h"
#include "support/sanitized.h"
#include "support/stepped_mesh.h"

namespace shm {
namespace {

using container::ChunkKind;
using container::Codec;
using container::IndexEntry;
using container::StreamKind;

/// The data that a Reader returns.
struct Expected {
  ReadBack mesh;
  Values values;
  std::vector<std::uint64_t> numbers(std::uint32_t array) const {
    if (mesh.schema.arrays[array].location == Location::point) return mesh.mesh.vertex_numbers;
    std::vector<std::uint64_t> numbers;
    for (std::size_t c = 0; c < mesh.mesh.cell_count(); ++c)
      if (mesh.schema.array_covers(array, mesh.mesh.cell_blocks[c]))
        numbers.push_back(mesh.mesh.cell_numbers[c]);
    return numbers;
  }
};

Expected expected_of(std::span<const std::byte> bytes) {
  Expected expected;
  auto back = read_mesh(bytes);
  EXPECT_TRUE(back) << (back ? "" : back.error().message());
  if (!back) return expected;
  expected.mesh = std::move(*back);
  for (const StepPiece& piece : expected.mesh.steps) {
    Bytes& to = expected.values[{piece.array, piece.step}];
    to.insert(to.end(), piece.values.begin(), piece.values.end());
  }
  return expected;
}

struct Joined {
  Bytes values;
  std::vector<std::uint64_t> numbers;
};

Result<Joined> joined(StepReader& reader, const StepRequest& request) {
  const auto pieces = reader.read(request);
  if (!pieces) return pieces.error();
  Joined all;
  std::uint64_t next = pieces->empty() ? 0 : pieces->front().first;
  const ArrayInfo& info = reader.schema().arrays[request.array];
  for (const StepValues& piece : *pieces) {
    EXPECT_EQ(piece.first, next);
    next += piece.values.size() / (scalar_bytes(info.type) * info.components);
    all.values.insert(all.values.end(), piece.values.begin(), piece.values.end());
    all.numbers.insert(all.numbers.end(), piece.numbers.begin(), piece.numbers.end());
  }
  return all;
}

StepReader opened(RandomSource& source, const ReadLimits& limits = {}) {
  auto reader = StepReader::open(source, limits);
  EXPECT_TRUE(reader) << (reader ? "" : reader.error().message());
  return std::move(*reader);
}

void expect_step(StepReader& reader, const Expected& expected, std::uint32_t array,
                 std::uint64_t step) {
  SCOPED_TRACE("array " + std::to_string(array) + " step " + std::to_string(step));
  const auto all = joined(reader, {array, step});
  ASSERT_TRUE(all) << all.error().message();
  EXPECT_TRUE(all->values == expected.values.at({array, step}));
  EXPECT_TRUE(all->numbers == expected.numbers(array));
  Joined by_segment;
  for (std::size_t s = 0; s < reader.segments().size(); ++s) {
    const auto part = joined(reader, {array, step, s, s % 2 == 0});
    ASSERT_TRUE(part) << part.error().message();
    by_segment.values.insert(by_segment.values.end(), part->values.begin(), part->values.end());
    EXPECT_EQ(part->numbers.empty(), s % 2 != 0 || part->values.empty());
  }
  EXPECT_TRUE(by_segment.values == all->values);
}

/// Reads every array at every step. The steps are read in ascending order and in another order,
/// with a single reader and with a new reader for each step.
void expect_all_steps(const Bytes& bytes) {
  const Expected expected = expected_of(bytes);
  WatchedSource source(bytes);
  StepReader reader = opened(source);
  EXPECT_EQ(reader.schema(), expected.mesh.schema);
  EXPECT_EQ(reader.step_times(), expected.mesh.times);
  std::vector<std::pair<std::uint32_t, std::uint64_t>> keys;
  for (const auto& [key, values] : expected.values) keys.push_back(key);
  for (const auto& [array, step] : keys) expect_step(reader, expected, array, step);
  std::shuffle(keys.begin(), keys.end(), std::mt19937_64(7));
  for (const auto& [array, step] : keys) expect_step(reader, expected, array, step);
  keys.resize(std::min<std::size_t>(keys.size(), 6));
  for (const auto& [array, step] : keys) {
    StepReader other = opened(source);
    expect_step(other, expected, array, step);
  }
  for (std::uint32_t a = 0; a < expected.mesh.schema.arrays.size(); ++a) {
    std::vector<std::uint64_t> steps;
    for (const auto& [key, values] : expected.values)
      if (key.first == a) steps.push_back(key.second);
    EXPECT_EQ(reader.steps(a), steps);
    if (!steps.empty()) {
      EXPECT_EQ(reader.elements(a), expected.numbers(a).size());
    }
  }
}

TEST(StepReader, EqualsTheReader) {
  SomeCases some(5);
  for (const auto& [order, delay] : {std::pair(Order::keep, 0u), std::pair(Order::keep, 6u),
                                     std::pair(Order::stream, 0u), std::pair(Order::free, 0u)})
    for (const auto codec : {ConnectivityCodec::rows, ConnectivityCodec::replay})
      for (const std::uint64_t segment_cells : {0u, 33u})
        for (const std::uint32_t group_cells : {14u, 65536u})
          for (int family = 0; family < 3; ++family) {
            if (some.skips_next()) continue;
            Stepped stepped = with_steps(family == 0   ? two_blocks()
                                         : family == 1 ? mixed_cells()
                                                       : replayed(order),
                                         order);
            stepped.mesh.schema.delay = delay;
            stepped.options.connectivity = codec;
            stepped.options.segment_cells = segment_cells;
            stepped.options.group_cells = group_cells;
            stepped.options.key_steps = 3;
            SCOPED_TRACE(std::to_string(family) + " codec " + std::string(codec_name(codec)) +
                         " order " + std::string(order_name(order)) + " delay " +
                         std::to_string(delay) + " segments " + std::to_string(segment_cells) +
                         " groups " + std::to_string(group_cells));
            expect_all_steps(written(stepped));
          }
}

TEST(StepReader, WhateverTheKeySteps) {
  SomeCases some(5);
  for (const std::uint32_t key_steps : {1u, 2u, 8u, 40u})
    for (const std::uint32_t components : {1u, 7u, 33u}) {
      if (some.skips_next()) continue;
      SCOPED_TRACE(std::to_string(key_steps) + ", " + std::to_string(components));
      Stepped stepped;
      stepped.mesh = with_order(grid(5, 4, 3, ScalarType::float64, warped), Order::keep, true, 0);
      const auto a =
          add_stepped(stepped.mesh, array_of("a", Location::cell, ScalarType::float32, components));
      const auto b = add_stepped(stepped.mesh, array_of("b", Location::point, ScalarType::int32));
      for (std::uint64_t step = 0; step < 20; ++step) {
        stepped.values[{a, step}] = moving_values(stepped.mesh.schema.arrays[a], 60, step);
        stepped.values[{b, step}] = moving_values(stepped.mesh.schema.arrays[b], 120, step);
      }
      stepped.options.key_steps = key_steps;
      stepped.options.group_cells = 25;
      stepped.options.segment_cells = 40;
      expect_all_steps(written(stepped));
    }
}

TEST(StepReader, TrendsAndLossyAndManyComponents) {
  Stepped stepped = waves(6);
  // The values are random at step 0 and grow linearly, all at the same relative rate.
  for (auto& [key, values] : stepped.values)
    for (std::size_t i = 0; i < values.size() / 8; ++i) {
      const double v = static_cast<double>(i * 2654435761u % 1000003) * 0x1p-20 *
                       (64 + static_cast<double>(key.second));
      std::memcpy(&values[8 * i], &v, 8);
    }
  ArrayInfo lossy = array_of("lossy", Location::point, ScalarType::float64);
  lossy.quantization = Quantization::absolute(.01, 1);
  const auto b = add_stepped(stepped.mesh, lossy);
  const auto c =
      add_stepped(stepped.mesh, array_of("many", Location::cell, ScalarType::uint8, 300));
  for (std::uint64_t step = 0; step < 6; ++step) {
    stepped.values[{b, step}] = stepped.values[{0, step}];
    stepped.values[{c, step}] =
        moving_values(stepped.mesh.schema.arrays[c], stepped.mesh.cells.size(), step);
  }
  stepped.options.group_cells = 500;
  expect_all_steps(written(stepped));
}

TEST(StepReader, NoCellsNoElements) {
  Stepped stepped = with_steps(grid(1, 1, 1), Order::keep);
  stepped.mesh.cells.clear();
  stepped.values.clear();
  stepped.values[{0, 3}] = moving_values(stepped.mesh.schema.arrays[0], 8, 3);
  stepped.values[{2, 0}] = {};
  const Bytes bytes = written(stepped);
  expect_all_steps(bytes);
  MemoryRandomSource source(bytes);
  StepReader reader = opened(source);
  EXPECT_TRUE(joined(reader, {2, 0})->values.empty());
  EXPECT_FALSE(reader.read({0, 2}));
}

TEST(StepReader, StepTimes) {
  MemorySink sink;
  const std::vector<double> times = {0, .5, 2};
  ASSERT_TRUE(write_mesh(waves(0).mesh, sink, {},
                         [&](Writer& writer) { return writer.set_step_times(times); }));
  MemoryRandomSource source(sink.bytes);
  EXPECT_EQ(opened(source).step_times(), times);
}

// --- bytes read

/// Divides a file into named parts, such as "head", and records to which part each byte belongs.
struct Places {
  explicit Places(std::span<const std::byte> file) : owner(file.size()) {
    const FileParts parts = take_apart(file);
    std::size_t at = container::kFileStartBytes;
    bool schema = false;
    for (const Chunk& chunk : parts.chunks) {
      const std::size_t end = at + chunk.bytes();
      if (chunk.is(ChunkKind::schema) && !std::exchange(schema, true)) mark(0, end, "head");
      if (chunk.is(ChunkKind::step_times)) mark(at, end, "head");
      if (chunk.is(ChunkKind::index)) mark(at, file.size(), "head");
      if (chunk.is(ChunkKind::group)) mark_group(chunk, at, end);
      if (chunk.is(ChunkKind::step_values)) {
        const auto steps = take_steps_apart(chunk);
        EXPECT_TRUE(steps && steps->heads.size() == 1);
        const container::StepHeader& header = steps->heads[0].header;
        mark(at, end, step_name(header.array, header.step, segments.at(header.group)));
      }
      at = end;
    }
  }
  static std::string step_name(std::uint32_t array, std::uint64_t step, std::uint32_t segment) {
    return std::to_string(segment) + " array " + std::to_string(array) + " step " +
           std::to_string(step);
  }
  /// Returns the full names of all parts with these names, in all segments. A full name is a
  /// segment number followed by a name, such as "2 array 0 step 5".
  std::set<std::string> in_all(const std::set<std::string>& names) const {
    std::set<std::string> all;
    for (const std::string& name : names)
      for (const std::uint32_t segment : segments)
        if (const auto full = std::to_string(segment) + " " + name;
            std::find(owners.begin(), owners.end(), full) != owners.end())
          all.insert(full);
    return all;
  }
  /// Returns the full names of the parts that were read. The test fails if one of them was read
  /// only partly.
  std::set<std::string> touched(const WatchedSource& source) const {
    std::set<std::size_t> hit, left;
    for (std::size_t i = 0; i < owner.size(); ++i)
      if (i == 0 || owner[i] != owner[i - 1] || source.touched[i] != source.touched[i - 1])
        (source.touched[i] ? hit : left).insert(owner[i]);
    std::set<std::string> all, missed;
    for (const std::size_t i : hit) all.insert(owners[i]);
    for (const std::size_t i : left) missed.insert(owners[i]);
    for (const std::string& name : all)
      EXPECT_FALSE(missed.contains(name)) << name << " is read in part";
    return all;
  }
  void mark(std::size_t begin, std::size_t end, const std::string& name) {
    if (begin == end) return;
    std::fill(owner.begin() + static_cast<std::ptrdiff_t>(begin),
              owner.begin() + static_cast<std::ptrdiff_t>(end), owners.size());
    owners.push_back(name);
  }
  void mark_group(const Chunk& chunk, std::size_t at, std::size_t end) {
    const auto group = take_group_apart(chunk);
    ASSERT_TRUE(group);
    segments.push_back(chunk.header.segment);
    const std::string segment = std::to_string(chunk.header.segment) + " ";
    std::size_t streams = 0;
    for (const auto& stream : group->streams) streams += stream.size();
    mark(at, end - streams, segment + "connectivity");
    at = end - streams;
    for (std::size_t s = 0; s < group->streams.size(); ++s) {
      const StreamKind kind = group->header.streams[s].kind;
      const bool topology = kind == StreamKind::connectivity || kind == StreamKind::corner_order ||
                            kind == StreamKind::imports;
      mark(at, at + group->streams[s].size(),
           segment + (topology ? "connectivity" : container::stream_name(kind)));
      at += group->streams[s].size();
    }
  }

  std::vector<std::size_t> owner;                // of each byte, an index into owners
  std::vector<std::string> owners = {"nobody"};  // their names
  std::vector<std::uint32_t> segments{};         // segment of each group
};

using Names = std::set<std::string>;

/// Returns a mesh with two segments. It has two arrays of waves whose steps refer to previous
/// steps, a stepped array whose values are unrelated to the mesh, and static arrays.
Stepped watched_mesh(Order order) {
  Stepped stepped;
  stepped.mesh =
      with_order(grid(12, 11, 10, ScalarType::float64, warped), order, order == Order::keep, 0);
  stepped.mesh.schema.arrays.push_back(array_of("s", Location::point, ScalarType::int32));
  stepped.mesh.schema.arrays.push_back(array_of("z", Location::cell, ScalarType::uint8));
  stepped.mesh.arrays.resize(2);
  for (std::uint64_t v = 0; v < stepped.mesh.vertices; ++v)
    append(stepped.mesh.arrays[0], static_cast<std::int32_t>(v * v % 1009));
  stepped.mesh.arrays[1].resize(stepped.mesh.cells.size(), std::byte{5});
  const auto wave = add_stepped(stepped.mesh, array_of("w", Location::point, ScalarType::float64));
  const auto other = add_stepped(stepped.mesh, array_of("v", Location::cell, ScalarType::float64));
  const auto phrase =
      add_stepped(stepped.mesh, array_of("n", Location::cell, ScalarType::uint8, 17));
  std::mt19937_64 random(3);
  const Stepped waving = waves(10);
  for (std::uint64_t step = 0; step < 10; ++step) {
    stepped.values[{wave, step}] = waving.values.at({0, step});
    stepped.values[{other, step}] = waving.values.at({0, step});
    stepped.values[{other, step}].resize(stepped.mesh.cells.size() * 8);
    // With sanitizers, this array has values at steps 4 and 5 only; the test reads step 5.
    if (kSanitized && step / 2 != 2) continue;
    Bytes& phrases = stepped.values[{phrase, step}];  // the random values of 10 cells, repeated
    for (std::size_t i = 0; i < stepped.mesh.cells.size() * 17; ++i)
      phrases.push_back(i < 170 ? static_cast<std::byte>(random()) : phrases[i - 170]);
  }
  stepped.options.key_steps = 4;
  stepped.options.segment_cells = 660;
  stepped.options.group_cells = 330;
  return stepped;
}

/// Returns the steps of an array that a reader must decode for `step`.
std::set<std::uint64_t> steps_for(std::span<const std::byte> file, std::uint32_t array,
                                  std::uint64_t step) {
  std::map<std::uint64_t, container::StepHeader> headers;
  for (const container::StepHeader& header : step_headers_of(file))
    if (header.array == array) headers[header.step] = header;
  std::set<std::uint64_t> steps = {step};
  while (headers.at(*steps.begin()).reference != StepReference::nothing)
    steps.insert(headers.at(*steps.begin()).reference_step);
  return steps;
}

TEST(StepReader, TouchesOnlyWhatItNeeds) {
  for (const Order order : {Order::keep, Order::stream})
    for (const auto codec : {ConnectivityCodec::rows, ConnectivityCodec::replay}) {
      Stepped stepped = watched_mesh(order);
      stepped.options.connectivity = codec;
      const Bytes bytes = written(stepped);
      const Places places(bytes);
      const auto wave = static_cast<std::uint32_t>(stepped.mesh.schema.arrays.size() - 3);
      WatchedSource source(bytes);
      StepReader reader = opened(source);
      EXPECT_EQ(places.touched(source), Names{"head"});
      ASSERT_EQ(reader.segments().size(), 2u);

      const auto name = [&](std::uint64_t step) {
        return "array " + std::to_string(wave) + " step " + std::to_string(step);
      };
      Names mesh = {"connectivity"};
      if (order == Order::keep && codec == ConnectivityCodec::replay) mesh.insert("vertex numbers");
      const auto mesh_and_steps_for = [&](std::uint64_t step) {
        Names names = mesh;
        for (const std::uint64_t s : steps_for(bytes, wave, step)) names.insert(name(s));
        return places.in_all(names);
      };
      source.forget();
      ASSERT_TRUE(reader.read({wave, 6, {}, false}));
      EXPECT_EQ(places.touched(source), mesh_and_steps_for(6));
      EXPECT_FALSE(places.touched(source).contains("0 " + name(3)));

      // To read step 7 after step 6, the reader reads only the values of step 7: no other steps and
      // no mesh data.
      source.forget();
      ASSERT_TRUE(reader.read({wave, 7, {}, false}));
      EXPECT_EQ(places.touched(source), places.in_all({name(7)}));
      source.forget();
      ASSERT_TRUE(reader.read({wave, 7, {}, false}));
      EXPECT_EQ(places.touched(source), Names{});

      // In order `keep`, a new reader also reads the vertex numbers of the mesh.
      StepReader second = opened(source);
      source.forget();
      ASSERT_TRUE(second.read({wave, 4}));
      if (order == Order::keep) mesh.insert("vertex numbers");
      EXPECT_EQ(places.touched(source), mesh_and_steps_for(4));

      // A single segment.
      StepReader alone = opened(source);
      source.forget();
      ASSERT_TRUE(alone.read({wave, 0, 1}));
      Names want;
      for (const std::string& full : mesh_and_steps_for(0))
        if (full.starts_with("1 ")) want.insert(full);
      EXPECT_EQ(places.touched(source), want);
    }
}

TEST(StepReader, WhatStandsForItselfNeedsNoMesh) {
  for (const Order order : {Order::keep, Order::stream}) {
    const Stepped stepped = watched_mesh(order);
    const Bytes bytes = written(stepped);
    const Places places(bytes);
    const auto phrase = static_cast<std::uint32_t>(stepped.mesh.schema.arrays.size() - 1);
    WatchedSource source(bytes);
    StepReader reader = opened(source);
    source.forget();
    // The numbers of cells are their positions.
    ASSERT_TRUE(reader.read({phrase, 5}));
    EXPECT_EQ(places.touched(source),
              places.in_all({"array " + std::to_string(phrase) + " step 5"}));
  }
}

TEST(StepReader, AStepIsReadWithItsKeyStepAndNoOther) {
  for (const std::uint32_t key_steps : {1u, 3u, 8u}) {
    Stepped stepped = waves(10);
    stepped.options.key_steps = key_steps;
    stepped.options.group_cells = 100;  // values of different groups are in different chunks
    const Bytes bytes = written(stepped);
    const Places places(bytes);
    for (std::uint64_t step = 0; step < 10; ++step) {
      WatchedSource source(bytes);
      StepReader reader = opened(source);
      source.forget();
      ASSERT_TRUE(reader.read({0, step, {}, false}));
      Names want = {"0 connectivity"};
      for (const std::uint64_t s : steps_for(bytes, 0, step))
        want.insert(Places::step_name(0, s, 0));
      EXPECT_LE(want.size(), step % key_steps + 3);
      EXPECT_EQ(places.touched(source), want) << step << " of " << key_steps;
    }
  }
}

// --- sizes

/// Returns a mesh with a field on points and a field on cells. The fields move through the mesh
/// from step to step.
Stepped travelling(std::uint64_t first_step, std::uint64_t steps) {
  constexpr std::uint64_t kWide = kSanitized ? 10 : 20, kHigh = kWide - 2, kDeep = kWide - 4;
  Stepped stepped;
  stepped.mesh =
      with_order(grid(kWide, kHigh, kDeep, ScalarType::float32, warped), Order::keep, true, 0);
  const auto a = add_stepped(stepped.mesh, array_of("a", Location::point, ScalarType::float32));
  const auto b = add_stepped(stepped.mesh, array_of("b", Location::cell, ScalarType::float32));
  const auto field = [](std::uint64_t x, std::uint64_t y, std::uint64_t z, std::uint64_t step) {
    const double t = static_cast<double>(step) * .05;
    return static_cast<float>(
        std::sin(.4 * static_cast<double>(x) - t) * std::cos(.3 * static_cast<double>(y)) +
        .3 * std::sin(static_cast<double>(z) + static_cast<double>(x) - 3 * t));
  };
  for (std::uint64_t step = 0; step < steps; ++step)
    for (const auto& [array, more] : {std::pair(a, 1u), std::pair(b, 0u)})
      for (std::uint64_t z = 0; z < kDeep + more; ++z)
        for (std::uint64_t y = 0; y < kHigh + more; ++y)
          for (std::uint64_t x = 0; x < kWide + more; ++x)
            append(stepped.values[{array, step}], field(x, y, z, first_step + step));
  return stepped;
}

TEST(StepReader, ASeriesIsSmallerThanItsStepsAlone) {
  constexpr std::uint64_t kSteps = 16;
  const std::size_t series = written(travelling(0, kSteps)).size();
  std::size_t alone = 0;
  for (std::uint64_t step = 0; step < kSteps; ++step) alone += written(travelling(step, 1)).size();
  EXPECT_LT(series, alone * 4 / 5);
}

// --- damaged and inconsistent files

/// Returns a small mesh with steps.
Stepped small_mesh() {
  Stepped stepped;
  stepped.mesh = with_order(grid(3, 3, 3, ScalarType::float64, warped), Order::keep, true, 0);
  const auto a = add_stepped(stepped.mesh, array_of("a", Location::point, ScalarType::float32));
  const auto b = add_stepped(stepped.mesh, array_of("b", Location::cell, ScalarType::float64));
  for (std::uint64_t step = 0; step < 4; ++step) {
    stepped.values[{a, step}] = moving_values(stepped.mesh.schema.arrays[a], 64, step);
    stepped.values[{b, step}] = moving_values(stepped.mesh.schema.arrays[b], 27, step);
  }
  stepped.options.key_steps = 2;
  stepped.options.group_cells = 10;
  stepped.options.segment_cells = 14;
  return stepped;
}

TEST(StepReader, EveryFlippedBitThatIsReadIsFound) {
  const Bytes bytes = written(small_mesh());
  WatchedSource source(bytes);
  StepReader reader = opened(source);
  const auto expected = joined(reader, {0, 3});
  ASSERT_TRUE(expected);
  std::mt19937 random(1);
  std::size_t unread = 0;
  for (std::size_t at = 0; at < bytes.size(); at += every(7)) {
    Bytes damaged = bytes;
    damaged[at] ^= std::byte{1} << random() % 8;
    MemoryRandomSource from(damaged);
    auto other = StepReader::open(from);
    const bool touched = source.touched[at];
    if (!other) {
      EXPECT_TRUE(touched) << at;
      continue;
    }
    const auto values = joined(*other, {0, 3});
    EXPECT_EQ(!values, touched) << at;
    if (!values) {
      EXPECT_NE(values.error().offset, kNoOffset) << values.error().message();
      continue;
    }
    ++unread;
    EXPECT_TRUE(values->values == expected->values && values->numbers == expected->numbers);
  }
  EXPECT_GT(unread, bytes.size() / every(7) / 3);
}

TEST(StepReader, EveryCutIsFound) {
  const Bytes bytes = written(small_mesh());
  for (std::size_t size = 0; size < bytes.size(); size += every(7)) {
    MemoryRandomSource source{std::span(bytes).first(size)};
    EXPECT_FALSE(StepReader::open(source)) << size;
  }
}

/// Reads everything; returns the first error.
std::optional<Error> complaint(std::span<const std::byte> bytes, const ReadLimits& limits = {}) {
  MemoryRandomSource source(bytes);
  auto reader = StepReader::open(source, limits);
  if (!reader) return reader.error();
  for (std::uint32_t a = 0; a < reader->schema().arrays.size(); ++a)
    for (const std::uint64_t step : reader->steps(a))
      if (const auto values = reader->read({a, step}); !values) return values.error();
  return std::nullopt;
}

TEST(StepReader, TheIndexIsNotBelieved) {
  const Bytes bytes = written(small_mesh());
  ASSERT_FALSE(complaint(bytes));
  const auto refused = [&](const char* what, const std::function<void(container::Index&)>& lie) {
    EXPECT_TRUE(complaint(with_old_index(bytes, lie))) << what;  // version 0 stores all fields
  };
  for (const std::size_t n : {0u, 1u, 5u, 9u}) {
    const auto lies = [&](const char* what, const std::function<void(IndexEntry&)>& lie) {
      refused(what,
              [&](container::Index& index) { lie(entry_of(index, ChunkKind::step_values, n)); });
    };
    lies("array", [](IndexEntry& e) { e.parts[0].array ^= 1; });
    lies("no array", [](IndexEntry& e) { e.parts[0].array = 7; });
    lies("step", [](IndexEntry& e) { e.parts[0].step += 1; });
    lies("far step", [](IndexEntry& e) { e.parts[0].step = ~std::uint64_t{0}; });
    lies("first", [](IndexEntry& e) { e.parts[0].first += 1; });
    lies("count", [](IndexEntry& e) { e.parts[0].count -= 1; });
    lies("much", [](IndexEntry& e) { e.parts[0].count = ~std::uint64_t{0}; });
    lies("group", [](IndexEntry& e) { e.parts[0].group += 1; });
    lies("no group", [](IndexEntry& e) { e.parts[0].group = ~0u; });
    lies("offset", [](IndexEntry& e) { e.offset += 1; });
    lies("far", [](IndexEntry& e) { e.offset = ~std::uint64_t{0} - 5; });
    lies("bytes", [](IndexEntry& e) { e.bytes -= 1; });
    lies("few", [](IndexEntry& e) { e.bytes = 3; });
    lies("many", [](IndexEntry& e) { e.bytes = ~std::uint64_t{0}; });
    lies("reference", [](IndexEntry& e) {
      e.parts[0].reference = e.parts[0].reference == StepReference::nothing
                                 ? StepReference::trend
                                 : StepReference::nothing;
    });
    lies("odd reference",
         [](IndexEntry& e) { e.parts[0].reference = static_cast<StepReference>(77); });
    lies("codec", [](IndexEntry& e) {
      e.parts[0].codec = e.parts[0].codec == Codec::columns ? Codec::shuffled_zstd : Codec::columns;
    });
  }
  for (const std::size_t n : {0u, 1u, 2u}) {
    const auto lies = [&](const char* what, const std::function<void(IndexEntry&)>& lie) {
      refused(what, [&](container::Index& index) { lie(entry_of(index, ChunkKind::group, n)); });
    };
    lies("segment", [](IndexEntry& e) { e.segment += 1; });
    lies("cells", [](IndexEntry& e) { e.cells += 1; });
    lies("first cell", [](IndexEntry& e) { e.first_cell += 1; });
    lies("vertices", [](IndexEntry& e) { e.vertices -= 1; });
    lies("header", [](IndexEntry& e) { e.header_bytes += 1; });
    lies("small header", [](IndexEntry& e) { e.header_bytes = 0; });
    lies("large header", [](IndexEntry& e) { e.header_bytes = ~std::uint64_t{0}; });
    lies("offset", [](IndexEntry& e) { e.offset += 32; });
  }
  refused("vertices", [](container::Index& index) { index.vertices += 1; });
  refused("cells", [](container::Index& index) { index.cells -= 1; });
  refused("blocks", [](container::Index& index) { index.block_cells.push_back(0); });
  refused("of a block", [](container::Index& index) { index.block_cells[0] = ~std::uint64_t{0}; });
  refused("no schema", [](container::Index& index) { index.entries.erase(index.entries.begin()); });
  refused("a step less", [](container::Index& index) { index.entries.pop_back(); });
}

TEST(StepReader, LiesOfAllKindsEndSomehow) {
  const Bytes bytes = written(small_mesh());
  std::mt19937_64 random(11);
  for (int i = 0; i < 400; ++i) {
    // Changes a byte of a chunk and recomputes its checksums.
    FileParts parts = take_apart(bytes);
    Chunk& chunk = parts.chunks[random() % parts.chunks.size()];
    if (chunk.payload.empty()) continue;
    chunk.payload[random() % chunk.payload.size()] ^= std::byte{1} << random() % 8;
    if (chunk.is(ChunkKind::group))
      if (auto group = take_group_apart(chunk)) chunk.payload = put_group_together(*group);
    complaint(put_together(parts));
  }
}

TEST(StepReader, ConnectivityThatLiesIsRefused) {
  const Bytes bytes = written(small_mesh());
  const auto with_group = [&](const std::function<void(GroupParts&)>& change) {
    FileParts parts = take_apart(bytes);
    Chunk* chunk = parts.find(ChunkKind::group, 1);
    auto group = *take_group_apart(*chunk);
    change(group);
    chunk->payload = put_group_together(group);
    return put_together(parts);
  };
  EXPECT_TRUE(complaint(with_group([](GroupParts& group) { group.header.decoded_bytes -= 1; })));
  EXPECT_TRUE(complaint(with_group([](GroupParts& group) { group.header.decoded_bytes += 1; })));
  EXPECT_TRUE(
      complaint(with_group([](GroupParts& group) { group.header.max_active_vertices = 7; })));
  EXPECT_TRUE(complaint(with_group([](GroupParts& group) { group.header.vertices += 1; })));
}

TEST(StepReader, LimitsAreKept) {
  const Bytes bytes = written(small_mesh());
  const auto refused = [&](const std::function<void(ReadLimits&)>& set) {
    ReadLimits limits;
    set(limits);
    const auto error = complaint(bytes, limits);
    ASSERT_TRUE(error);
    EXPECT_EQ(error->code, ErrorCode::over_limit) << error->message();
  };
  refused([](ReadLimits& limits) { limits.max_active_vertices = 10; });
  refused([](ReadLimits& limits) { limits.max_chunk_bytes = 80; });
  refused([](ReadLimits& limits) { limits.max_group_bytes = 600; });
  refused([](ReadLimits& limits) { limits.max_group_bytes = 100; });
  refused([](ReadLimits& limits) { limits.max_steps = 3; });
  refused([](ReadLimits& limits) { limits.max_arrays = 1; });
}

TEST(StepReader, WrongUse) {
  const Bytes bytes = written(watched_mesh(Order::keep));
  MemoryRandomSource source(bytes);
  StepReader reader = opened(source);
  const auto code = [&](const StepRequest& request) {
    const auto values = reader.read(request);
    return values ? ErrorCode{} : values.error().code;
  };
  const auto wave = static_cast<std::uint32_t>(reader.schema().arrays.size() - 3);
  EXPECT_EQ(code({0, 0}), ErrorCode::misuse);  // static
  EXPECT_EQ(code({wave + 3, 0}), ErrorCode::misuse);
  EXPECT_EQ(code({wave, 10}), ErrorCode::misuse);
  EXPECT_EQ(code({wave, 0, 2}), ErrorCode::misuse);
  // next() returns nothing if begin() was not called. A caller may stop reading a step before its
  // end.
  EXPECT_EQ(*reader.next(), nullptr);
  ASSERT_TRUE(reader.begin({wave, 5}));
  ASSERT_NE(*reader.next(), nullptr);
  const Expected expected = expected_of(bytes);
  expect_step(reader, expected, wave, 6);
  expect_step(reader, expected, wave, 5);
}

}  // namespace
}  // namespace shm
