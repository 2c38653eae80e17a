// Tests of step values: values are restored unchanged for all meshes, segments, groups, codecs, and
// kinds of references to other steps. Inconsistent files are refused.
#include "steps/step_values.h"
#include "shm/step_reader.h"
#include "steps/step_memory.h"

#include "codecs/shared/shuffled_zstd.h"
#include "support/coded_meshes.h"
#include "support/file_surgery.h"
#include "support/sanitized.h"

namespace shm {
namespace {

using container::ChunkKind;
using container::Codec;
using container::StepHeader;

Values read_values(std::span<const std::byte> bytes, const ReadLimits& limits = {}) {
  const auto back = read_mesh(bytes, limits);
  EXPECT_TRUE(back) << (back ? "" : back.error().message());
  Values values;
  if (!back) return values;
  for (const StepPiece& piece : back->steps) {
    Bytes& to = values[{piece.array, piece.step}];
    EXPECT_EQ(to.size(),
              piece.first * (piece.values.size() /
                             std::max<std::size_t>(
                                 1, piece.values.size() /
                                        (scalar_bytes(back->schema.arrays[piece.array].type) *
                                         back->schema.arrays[piece.array].components))));
    to.insert(to.end(), piece.values.begin(), piece.values.end());
  }
  return values;
}

Bytes expect_values_back(const Stepped& stepped) {
  const Bytes bytes = written(stepped);
  Values expected;
  for (const auto& [key, values] : stepped.values)
    if (!values.empty()) expected[key] = values;
  EXPECT_TRUE(read_values(bytes) == expected);
  return bytes;
}

TEST(StepValues, WhateverTheMeshAndItsPieces) {
  SomeCases some(3);
  for (const Order order : {Order::keep, Order::stream})
    for (const auto codec : codecs_for(hexahedra_schema()))
      for (const std::uint64_t segment_cells : {0u, 33u})
        for (const std::uint32_t group_cells : {14u, 65536u})
          for (int family = 0; family < 4; ++family) {
            if (some.skips_next()) continue;
            Stepped stepped = with_steps(family == 0   ? two_blocks()
                                         : family == 1 ? mixed_cells()
                                         : family == 2 ? every_shape()
                                                       : replayed(order),
                                         order);
            if (!can_be_in(stepped.mesh.schema, codec)) continue;
            stepped.options.connectivity = codec;
            stepped.options.level = family % 2 == 0 ? Level::standard : Level::fast;
            stepped.options.segment_cells = segment_cells;
            stepped.options.group_cells = group_cells;
            SCOPED_TRACE(std::to_string(family) + " codec " +
                         std::to_string(static_cast<int>(codec)) + " order " +
                         std::to_string(static_cast<int>(order)));
            expect_values_back(stepped);
          }
}

// With the shifts codec, neighbouring vertices are found by their numbers. With the other codecs,
// they are found on the active surface. The encoded values must have about the same size in both
// cases.
TEST(StepValues, OverShiftsToo) {
  Stepped stepped = waves(3);
  stepped.options.connectivity = ConnectivityCodec::rows;
  const std::size_t over_surface = expect_values_back(stepped).size();
  stepped.options.connectivity = ConnectivityCodec::shifts;
  const Bytes bytes = expect_values_back(stepped);
  for (const StepHeader& header : step_headers_of(bytes))
    EXPECT_TRUE(needs_neighbours(header.codec));
  EXPECT_LE(bytes.size() * 20, over_surface * 21);
}

// At level `fast`, and in meshes of the patterns codec, step values are not predicted from
// neighbouring elements. They can therefore be decoded without the mesh.
TEST(StepValues, InTerms) {
  Stepped stepped = waves(5);
  for (const auto& [codec, level] : {std::pair(ConnectivityCodec::patterns, Level::standard),
                                     std::pair(ConnectivityCodec::shifts, Level::fast),
                                     std::pair(ConnectivityCodec::rows, Level::fast)}) {
    stepped.options.connectivity = codec;
    stepped.options.level = level;
    stepped.options.key_steps = 1;
    const std::size_t alone = expect_values_back(stepped).size();
    stepped.options.key_steps = 5;
    const Bytes bytes = expect_values_back(stepped);
    for (const StepHeader& header : step_headers_of(bytes))
      EXPECT_EQ(header.codec, container::Codec::terms);
    EXPECT_LT(bytes.size(), alone);
  }
}

// If a file has steps, every group of the shifts codec must have a ring, which stores recent
// elements and is needed to find neighbours. A group without a ring is refused.
TEST(StepValues, ShiftsWithoutNeighbourhoodsAreRefused) {
  Stepped stepped = waves(1);
  stepped.options.connectivity = ConnectivityCodec::shifts;
  FileParts parts = take_apart(written(stepped));
  Chunk& chunk = *parts.find(ChunkKind::group);
  auto group = take_group_apart(chunk);
  ASSERT_TRUE(group);
  group->streams[0][0] = std::byte{0};
  chunk.payload = put_group_together(*group);
  const auto back = read_mesh(put_together(parts));
  ASSERT_FALSE(back);
  EXPECT_EQ(back.error().code, ErrorCode::corrupt);
}

TEST(StepValues, ADelayBufferIsNoMatter) {
  Stepped stepped = with_steps(two_blocks(), Order::stream);
  stepped.mesh.schema.delay = 20;
  stepped.options.group_cells = 30;
  expect_values_back(stepped);
}

TEST(StepValues, NoCellsNoVerticesNoElements) {
  Stepped stepped = with_steps(grid(1, 1, 1), Order::keep);
  stepped.mesh.cells.clear();
  stepped.values.clear();
  stepped.values[{0, 3}] = moving_values(stepped.mesh.schema.arrays[0], 8, 3);
  stepped.values[{2, 0}] = {};
  expect_values_back(stepped);
  stepped.mesh.vertices = 0;
  stepped.mesh.xyz.clear();
  stepped.values[{0, 3}] = {};
  expect_values_back(stepped);
}

// If an array has no elements, a call to add_step_values() for this array stores nothing in the
// file and does not create a step.
TEST(StepValues, AStepOfNothingIsNone) {
  Stepped stepped = with_steps(grid(1, 1, 1), Order::keep);
  stepped.mesh.cells.clear();
  for (const bool others : {false, true}) {
    MemorySink sink;
    ASSERT_TRUE(
        write_mesh(stepped.mesh, sink, stepped.options, [&](Writer& writer) -> Result<void> {
          for (const std::uint64_t step : {0u, 7u})
            if (auto status = writer.add_step_values(2, step, {}); !status) return status;
          if (!others) return {};
          return writer.add_step_values(0, 3, moving_values(stepped.mesh.schema.arrays[0], 8, 3));
        }));
    const auto back = read_mesh(sink.bytes);
    ASSERT_TRUE(back) << back.error().message();
    EXPECT_EQ(back->totals.steps, others ? 4u : 0u);
  }
}

TEST(StepValues, PiecesAreCutAtGroups) {
  Stepped stepped = with_steps(two_blocks(), Order::keep);
  stepped.options.group_cells = 30;
  const Bytes bytes = written(stepped, 1);
  EXPECT_EQ(written(stepped, 5), bytes);
  EXPECT_EQ(written(stepped, 100000), bytes);
}

TEST(StepValues, TheMeshPredicts) {
  Stepped stepped = waves(1);
  RecordedOrder order;
  stepped.options.coding_order = &order;
  written(stepped);  // only to record the order
  Bytes sorted;
  for (std::uint64_t v : order.vertices) {
    const auto& values = stepped.values[{0, 0}];
    sorted.insert(sorted.end(), values.begin() + static_cast<std::ptrdiff_t>(8 * v),
                  values.begin() + static_cast<std::ptrdiff_t>(8 * v + 8));
  }
  stepped.values[{0, 0}] = sorted;
  const Bytes bytes = expect_values_back(stepped);
  EXPECT_TRUE(needs_neighbours(step_headers_of(bytes)[0].codec));
  std::size_t coded = 0;
  for (const Chunk& chunk : take_apart(bytes).chunks)
    if (chunk.is(ChunkKind::step_values)) coded += chunk.payload.size();
  EXPECT_LT(coded, pack_shuffled(shuffled(sorted, 8), 9).size() * 7 / 8);
}

TEST(StepValues, StepsReferToTheOneBefore) {
  for (const std::uint32_t key_steps : {1u, 3u, 8u}) {
    Stepped stepped = waves(10);
    stepped.options.key_steps = key_steps;
    const auto headers = step_headers_of(expect_values_back(stepped));
    ASSERT_EQ(headers.size(), 10u);
    for (std::uint64_t s = 0; s < 10; ++s)
      if (s % key_steps == 0)
        EXPECT_TRUE(container::is_key(headers[s].reference)) << s;
      else
        EXPECT_EQ(headers[s].reference_step, s - 1) << s;
  }
}

/// Reads the values of the array 0 at these steps, in this order.
Values values_at(const Bytes& file, std::span<const std::uint64_t> steps,
                 const ReadLimits& limits = {}) {
  MemoryRandomSource source(file);
  auto reader = StepReader::open(source, limits);
  EXPECT_TRUE(reader);
  Values out;
  for (const std::uint64_t step : steps) {
    const auto groups = reader->read({0, step, {}, false});
    EXPECT_TRUE(groups);
    if (!groups) continue;
    Bytes all;
    for (const StepValues& group : *groups)
      all.insert(all.end(), group.values.begin(), group.values.end());
    out[{0, step}] = std::move(all);
  }
  return out;
}

/// Returns `steps` steps of random values on all vertices of waves(1). The values change at the
/// steps in `changes`.
Stepped random_waves(std::uint64_t steps, const std::set<std::uint64_t>& changes) {
  Stepped stepped = waves(steps);
  PlainRandom random(4);
  Bytes current;
  for (std::uint64_t step = 0; step < steps; ++step) {
    Bytes& values = stepped.values[{0, step}];
    if (step == 0 || changes.contains(step)) {
      current.clear();
      for (std::size_t i = 0; i < values.size() / 8; ++i)
        append(current, static_cast<double>(random.below(1u << 30)) * 1e-3);
    }
    values = current;
  }
  return stepped;
}

// A key step refers to its base if the values are similar. Random values that change only at a few
// steps are therefore coded only once after each change, at all levels.
TEST(StepValues, KeyStepsReferToTheirBase) {
  for (const Level level : {Level::fast, Level::standard, Level::best})
    for (const bool change : {false, true}) {
      SCOPED_TRACE(std::to_string(static_cast<int>(level)) + (change ? " with a change" : ""));
      Stepped stepped =
          random_waves(40, change ? std::set<std::uint64_t>{20} : std::set<std::uint64_t>{});
      stepped.options.level = level;
      stepped.options.waiting_bytes = 0;  // no bundles
      stepped.options.group_cells = 330;
      const Bytes bytes = expect_values_back(stepped);
      std::set<std::uint64_t> steps, alone;
      for (const StepHeader& header : step_headers_of(bytes)) {
        steps.insert(header.step);
        if (header.reference == StepReference::nothing) alone.insert(header.step);
      }
      EXPECT_EQ(steps.size(), 40u);
      // The change may be coded with a reference to the previous step. The next key step, step 24,
      // is then coded alone.
      std::set<std::uint64_t> expected = {0};
      if (change) expected.insert(alone.contains(20) ? 20 : 24);
      EXPECT_EQ(alone, expected);
      // The same values, read at random steps.
      PlainRandom random(5);
      std::vector<std::uint64_t> wanted(30);
      for (std::uint64_t& step : wanted) step = random.below(40);
      for (const auto& [key, values] : values_at(bytes, wanted))
        EXPECT_EQ(values, stepped.values.at(key)) << key.second;
    }
}

/// Returns the last kind in the enumeration StepReference that the schema of the file allows. The
/// schema also allows all kinds before it.
StepReference most_of(const Bytes& file) {
  const auto back = read_mesh(file);
  EXPECT_TRUE(back);
  return back ? back->schema.step_references : StepReference::base;
}
/// Changes the schema of the file so that it allows references of kind `most` and of the kinds
/// before it in the enumeration.
Bytes under(const Bytes& file, StepReference most) {
  FileParts parts = take_apart(file);
  Schema schema = read_mesh(file)->schema;
  schema.step_references = most;
  for (Chunk& chunk : parts.chunks)
    if (chunk.is(ChunkKind::schema)) chunk.payload = schema_payload(schema);
  return put_together(parts);
}

/// Returns values of a stepped array that change slowly. A few are NaN, infinite, -0.0, huge, or a
/// fill value.
Bytes drifting_values(const ArrayInfo& info, std::uint64_t elements, std::uint64_t step,
                      PlainRandom& random) {
  Bytes out;
  for (std::uint64_t i = 0; i < elements * info.components; ++i) {
    const double x = static_cast<double>(i % 977) * .01;
    double v = 100 * std::sin(x + .02 * static_cast<double>(step)) +
               static_cast<double>(i * 7919 % 1009) * .1 +
               static_cast<double>(random.below(1000)) * 1e-4;
    switch (random.below(300)) {
      case 0: v = std::numeric_limits<double>::quiet_NaN(); break;
      case 1: v = -std::numeric_limits<double>::infinity(); break;
      case 2: v = -0.0; break;
      case 3: v = 0.0; break;
      case 4: v = 9.97e36; break;
      case 5: v = -9999; break;
      default: break;
    }
    if (info.type == ScalarType::float64)
      append(out, v);
    else
      append(out, static_cast<float>(v));
  }
  return out;
}

/// Expects that each value has been restored within the bound, and exactly if it is not finite.
void expect_within(const ArrayInfo& info, double bound, const Bytes& before, const Bytes& after) {
  ASSERT_EQ(before.size(), after.size());
  const std::size_t width = scalar_bytes(info.type);
  for (std::size_t i = 0; i < before.size(); i += width) {
    const double was = scalar_as_double(info.type, load_scalar(&before[i], width));
    const double is = scalar_as_double(info.type, load_scalar(&after[i], width));
    if (std::isfinite(was))
      ASSERT_LE(std::abs(was - is), bound) << i / width;
    else
      ASSERT_EQ(std::memcmp(&before[i], &after[i], width), 0) << i / width;
  }
}

// Quantized arrays may refer to earlier steps. The encoder refers to the restored values, as the
// decoder does. Errors therefore do not add up.
TEST(StepValues, QuantizedArraysReferToRestoredValues) {
  PlainRandom random(11);
  for (const Level level : {Level::fast, Level::standard, Level::best})
    for (const auto codec : {ConnectivityCodec::rows, ConnectivityCodec::patterns})
      for (const ScalarType type : {ScalarType::float32, ScalarType::float64})
        for (const double bound : {1e-1, 1e-3}) {
          SCOPED_TRACE(std::to_string(static_cast<int>(level)) + " " +
                       std::string(codec_name(codec)) + " " + std::to_string(bound));
          Stepped stepped;
          stepped.mesh = grid(9, 8, 7, ScalarType::float64, warped);
          stepped.options.connectivity = codec;
          stepped.options.level = level;
          stepped.options.group_cells = 300;
          ArrayInfo info = array_of("q", Location::point, type, 2);
          info.quantization = Quantization::absolute(bound, 2);
          const auto a = add_stepped(stepped.mesh, info);
          for (std::uint64_t step = 0; step < 7; ++step)
            stepped.values[{a, step}] = drifting_values(info, stepped.mesh.vertices, step, random);
          const Bytes bytes = written(stepped);
          const Values values = read_values(bytes);
          for (const auto& [key, expected] : stepped.values)
            expect_within(info, bound, expected, values.at(key));
          bool refers = false;
          for (const StepHeader& header : step_headers_of(bytes))
            refers = refers || header.reference_step != header.step;
          EXPECT_TRUE(refers);
        }
}

TEST(StepValues, TheSchemaSaysWhatTheyReferTo) {
  using enum StepReference;
  for (const auto& [key_steps, most] :
       {std::pair(1u, nothing), std::pair(2u, before), std::pair(3u, base)}) {
    Stepped stepped = waves(10);
    stepped.options.key_steps = key_steps;
    const Bytes bytes = expect_values_back(stepped);
    EXPECT_EQ(most_of(bytes), most);
    for (const StepReference less : {nothing, before}) {
      // A chunk is refused if it refers to more earlier steps than the schema allows. It is
      // accepted if it refers to fewer.
      const auto back = read_mesh(under(bytes, less));
      EXPECT_EQ(static_cast<bool>(back), less >= most);
      if (!back) {
        EXPECT_EQ(back.error().code, ErrorCode::corrupt);
      }
    }
    // A caller may set schema.step_references to a more restrictive kind than the one that follows
    // from key_steps.
    stepped.mesh.schema.step_references = std::min(most, before);
    for (const auto& header : step_headers_of(expect_values_back(stepped)))
      EXPECT_LE(header.reference, before);
  }
  // If no array is stepped, the schema does not store which references are allowed.
  WriteOptions options;
  options.key_steps = 1;
  EXPECT_EQ(most_of(expect_round_trip(two_blocks(), options)), base);
}

TEST(StepValues, WhatStaysCostsNothing) {
  Stepped stepped = with_steps(two_blocks(), Order::keep);
  std::mt19937_64 random(3);
  Bytes& first = stepped.values[{0, 0}];
  for (std::byte& b : first) b = static_cast<std::byte>(random());
  for (auto& [key, values] : stepped.values)
    if (key.first == 0) values = first;
  const Bytes bytes = expect_values_back(stepped);
  for (const Chunk& chunk : take_apart(bytes).chunks) {
    if (!chunk.is(ChunkKind::step_values)) continue;
    const auto parts = take_steps_apart(chunk);
    ASSERT_TRUE(parts);
    for (const container::StepPart& part : parts->heads) {
      if (part.header.array != 0 || part.header.step == 0) continue;
      EXPECT_LT(part.bytes, 300u);
    }
  }
}

ErrorCode code_of(std::span<const std::byte> bytes, const ReadLimits& limits = {}) {
  MemorySource source(bytes);
  auto reader = Reader::open(source, limits);
  if (!reader) return reader.error().code;
  while (true) {
    auto item = reader->next();
    if (!item) return item.error().code;
    if (*item == nullptr) break;
  }
  ADD_FAILURE() << "accepted";
  return {};
}

// Values of earlier steps that exceed the memory limit are in a temporary file. The bytes of the
// file do not depend on the limit.
TEST(StepValues, EarlierStepsMayBeInATemporaryFile) {
  for (const Level level : {Level::fast, Level::standard}) {
    Stepped stepped = waves(20);
    stepped.options.level = level;
    stepped.options.waiting_bytes = 0;  // no bundles
    stepped.options.group_cells = 330;
    const Bytes in_memory = written(stepped);
    std::vector<std::uint64_t> last_first(20);
    std::iota(last_first.rbegin(), last_first.rend(), 0);
    // No step fits into the memory; or one of three steps does.
    for (const std::uint64_t memory : {std::size_t{0}, stepped.values[{0, 0}].size() * 3 / 2}) {
      stepped.options.kept_steps_bytes = memory;
      EXPECT_EQ(written(stepped), in_memory);
      ReadLimits limits;
      limits.max_kept_steps_bytes = memory;
      EXPECT_EQ(read_values(in_memory, limits), stepped.values);
      EXPECT_EQ(values_at(in_memory, last_first, limits), stepped.values);
    }
    ReadLimits limits;
    limits.max_kept_steps_bytes = 0;
    limits.temporary_folder = "/does/not/exist";
    EXPECT_EQ(code_of(in_memory, limits), ErrorCode::output);
  }
}

template <class T>
std::vector<T> trend_of(ScalarType type, const std::vector<T>& first,
                        const std::vector<T>& second) {
  StepStore store(KeptSteps{});
  StepMemory memory(store, StepReference::trend, first.size() * sizeof(T));
  EXPECT_TRUE(memory.take(0, std::as_bytes(std::span(first)), true));
  for (std::size_t at = 0; at < second.size(); ++at)  // in pieces
    EXPECT_TRUE(memory.take(at * sizeof(T),
                            std::as_bytes(std::span(second)).subspan(at * sizeof(T), sizeof(T)),
                            false));
  const ArrayInfo info = array_of("a", Location::point, type);
  const std::size_t bytes = second.size() * sizeof(T);
  const auto before = memory.reference(StepReference::before, info, 0, bytes);
  const auto is_second = [&](std::span<const std::byte> values) {
    return std::ranges::equal(values, std::as_bytes(std::span(second)));
  };
  EXPECT_TRUE(is_second(before->values));
  EXPECT_TRUE(before->last.empty());
  const auto trend = memory.reference(StepReference::trend, info, 0, bytes);
  EXPECT_TRUE(is_second(trend->last));
  std::vector<T> out(second.size());
  std::memcpy(out.data(), trend->values.data(), bytes);
  return out;
}

TEST(StepValues, ATrendGoesOn) {
  constexpr double kMost = std::numeric_limits<double>::max();
  EXPECT_EQ(trend_of<double>(ScalarType::float64, {1, -kMost, 5}, {1.5, kMost, 5}),
            (std::vector<double>{2, kMost, 5}));
  EXPECT_EQ(trend_of<float>(ScalarType::float32, {1, 2}, {3, -2}), (std::vector<float>{5, -6}));
  EXPECT_EQ(trend_of<std::int8_t>(ScalarType::int8, {0, -128}, {100, 127}),
            (std::vector<std::int8_t>{-56, 126}));
  EXPECT_EQ(trend_of<std::uint64_t>(ScalarType::uint64, {0, ~std::uint64_t{0}}, {1, 0}),
            (std::vector<std::uint64_t>{2, 1}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(trend_of<double>(ScalarType::float64, {nan}, {7}), std::vector<double>{7});
  // Bit for bit: signalling NaNs stay signalling.
  const std::vector<std::uint32_t> odd = {0x7f800001, 0xffc01234, 0x7f800000};
  EXPECT_EQ(trend_of<std::uint32_t>(ScalarType::float32, {0, 0, 0}, odd), odd);
}

TEST(StepValues, ATrendIsFollowed) {
  Stepped stepped = waves(4);
  // The values are random at step 0 and grow linearly, all at the same relative rate.
  for (auto& [key, values] : stepped.values)
    for (std::size_t i = 0; i < values.size() / 8; ++i) {
      const double v = static_cast<double>(i * 2654435761u % 1000003) * 0x1p-20 *
                       (64 + static_cast<double>(key.second));
      std::memcpy(&values[8 * i], &v, 8);
    }
  const auto headers = step_headers_of(expect_values_back(stepped));
  ASSERT_EQ(headers.size(), 4u);
  for (std::size_t s = 0; s < 4; ++s)
    EXPECT_EQ(headers[s].reference == StepReference::trend, s >= 2) << s;
}

// The codec shuffled_zstd makes random bits smaller than predictions do.
TEST(StepValues, NoiseIsLeftToZstd) {
  Stepped stepped;
  stepped.mesh = grid(20, 20, 20);
  const auto a = add_stepped(stepped.mesh, array_of("a", Location::point, ScalarType::float64, 1));
  stepped.options.level = Level::standard;
  stepped.options.group_cells = 4000;
  PlainRandom random(6);
  Bytes& values = stepped.values[{a, 0}];
  for (std::size_t i = 0; i < 21 * 21 * 21; ++i)
    append(values, (static_cast<double>(random.below(1ull << 62)) * 0x1p-62 + .1) *
                       (random.below(2) ? 1 : -1));
  const auto headers = step_headers_of(expect_values_back(stepped));
  EXPECT_GT(headers.size(), 1u);
  for (const StepHeader& header : headers)
    EXPECT_EQ(header.codec, Codec::shuffled_zstd) << header.group;
}

TEST(StepValues, ManyComponentsAreLeftToZstd) {
  Stepped stepped;
  stepped.mesh = grid(2, 1, 1);
  const auto a = add_stepped(
      stepped.mesh, array_of("a", Location::cell, ScalarType::float32, kMostStepComponents + 1));
  stepped.values[{a, 0}] = moving_values(stepped.mesh.schema.arrays[a], 2, 0);
  stepped.values[{a, 1}] = stepped.values[{a, 0}];
  for (const StepHeader& header : step_headers_of(expect_values_back(stepped)))
    EXPECT_EQ(without_special_values(header.codec), Codec::shuffled_zstd);
}

TEST(StepValues, ShuffledBytes) {
  const ArrayInfo info = array_of("a", Location::point, ScalarType::float32, 2);
  std::vector<float> values(2000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 50) * .37f;
  const auto bytes = std::as_bytes(std::span(values));
  const Bytes coded = pack_shuffled(shuffled(bytes, 4), 9);
  const auto back = unpack_shuffled(coded, 4, 8000);
  ASSERT_TRUE(back);
  EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), back->begin(), back->end()));
  EXPECT_FALSE(unpack_shuffled({}, 4, 8));
  EXPECT_FALSE(unpack_shuffled(coded, 4, 7992));
  EXPECT_FALSE(unpack_shuffled(coded, 3, 8000));
  EXPECT_EQ(unpack_shuffled(coded, 4, 8004)->size(), 8000u);  // the caller must check the size
  EXPECT_FALSE(unpack_shuffled(std::span(coded).first(coded.size() - 1), 4, 8000));
}

// --- inconsistent files

/// Changes the chunk of step values with index `nth`, counted from 0. Precondition: the chunk has
/// one part.
Bytes with_chunk(std::span<const std::byte> bytes, std::size_t nth,
                 const std::function<void(StepHeader&, Bytes&)>& change) {
  FileParts parts = take_apart(bytes);
  Chunk* chunk = parts.find(ChunkKind::step_values, nth);
  auto steps = take_steps_apart(*chunk);
  EXPECT_TRUE(steps && steps->heads.size() == 1);
  change(steps->heads[0].header, steps->values[0]);
  chunk->payload = put_steps_together(std::move(*steps), chunk->header.version);
  return put_together(parts);
}

/// Returns a file of waves in four groups, with three steps. The last two steps refer to earlier
/// steps.
const Bytes& waves_file() {
  static const Bytes bytes = [] {
    Stepped stepped = waves(3);
    stepped.options.group_cells = 330;
    stepped.options.digest = false;
    return written(stepped);
  }();
  return bytes;
}

TEST(StepValues, LyingHeaders) {
  const auto headers = step_headers_of(waves_file());
  ASSERT_EQ(headers.size(), 12u);
  ASSERT_EQ(headers[4].reference_step, 0u);
  ASSERT_EQ(headers[1].codec, Codec::columns);
  const auto refused = [&](std::size_t nth, const std::function<void(StepHeader&)>& lie,
                           ErrorCode code = ErrorCode::corrupt) {
    EXPECT_EQ(code_of(with_chunk(waves_file(), nth, [&](StepHeader& h, Bytes&) { lie(h); })), code);
  };
  for (std::size_t nth : {0u, 1u, 5u}) {
    refused(nth, [](StepHeader& h) { h.array = 1; });
    refused(nth, [](StepHeader& h) { h.group += 1; });
    refused(nth, [](StepHeader& h) { h.group = 4; });
    refused(nth, [](StepHeader& h) { h.group = ~0u; });
    refused(nth, [](StepHeader& h) { h.count += 1; });
    refused(nth, [](StepHeader& h) { h.count -= 1; });
    refused(nth, [](StepHeader& h) { h.count = 0; });
    refused(nth, [](StepHeader& h) { h.count = ~std::uint64_t{0}; });
    refused(nth, [](StepHeader& h) { h.step += 1; });
    for (const StepReference kind :
         {StepReference::before, StepReference::trend, StepReference::base})
      for (const std::uint64_t back : {std::uint64_t{1000}, ~std::uint64_t{0}})
        refused(nth, [&](StepHeader& h) {
          h.reference = kind;
          h.reference_step = h.step - back;
        });
    for (int codec : {0, 2, 3, 5, 6, 255})
      refused(nth, [&](StepHeader& h) { h.codec = static_cast<Codec>(codec); });
  }
  refused(1, [](StepHeader& h) { h.group = 0; });
  const auto refer = [](StepReference kind) { return [=](StepHeader& h) { h.reference = kind; }; };
  refused(5, refer(StepReference::nothing));                // differs from the previous group
  refused(8, [](StepHeader& h) { h.reference_step = 0; });  // not the previous step
  refused(4, refer(StepReference::trend));                  // from a single step
  const bool is_trend = headers[9].reference == StepReference::trend;
  refused(9, refer(is_trend ? StepReference::before : StepReference::trend));  // as 5
  refused(
      0, [](StepHeader& h) { h.step = h.reference_step = 1 << 21; }, ErrorCode::over_limit);
  // If `trend` is true, the header states that values are predicted from a trend, but refers to no
  // earlier steps. Only headers of version 0 can store this contradiction.
  for (const bool trend : {false, true}) {
    FileParts parts = take_apart(waves_file());
    Chunk& chunk = *parts.find(ChunkKind::step_values);
    auto steps = take_steps_apart(chunk);
    chunk.header.version = 0;
    chunk.payload = put_steps_together(std::move(*steps), 0);
    if (trend) chunk.payload[3] = std::byte{1};  // the fourth field; the others need one byte each
    list_anew(parts);
    const Bytes bytes = put_together(parts);
    if (trend) {
      EXPECT_EQ(code_of(bytes), ErrorCode::corrupt);
    } else {
      EXPECT_TRUE(read_values(bytes) == read_values(waves_file()));
    }
  }
}

TEST(StepValues, StepsThatAreMissing) {
  for (std::size_t nth = 0; nth < 12; ++nth) {
    FileParts parts = take_apart(waves_file());
    const Chunk* chunk = parts.find(ChunkKind::step_values, nth);
    parts.chunks.erase(parts.chunks.begin() + (chunk - parts.chunks.data()));
    EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt) << nth;
  }
}

TEST(StepValues, OneArrayAtATime) {
  Stepped stepped = with_steps(two_blocks(), Order::keep);
  stepped.options.group_cells = 120;
  const Bytes bytes = written(stepped);
  const auto headers = step_headers_of(bytes);
  ASSERT_EQ(headers[1].array, 0u);
  for (std::size_t i = 1; i < headers.size(); ++i) {
    if (headers[i].array == 0) continue;
    FileParts parts = take_apart(bytes);
    std::swap(*parts.find(ChunkKind::step_values, 1), *parts.find(ChunkKind::step_values, i));
    EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt);
  }
}

TEST(StepValues, DamagedBytesGiveAsManyValuesOrNone) {
  PlainRandom random(5);
  for (int i = 0; i < 200; ++i) {
    const Bytes bytes = with_chunk(waves_file(), random.below(12), [&](StepHeader&, Bytes& values) {
      if (i % 4 == 0)
        values.resize(random.below(values.size()));
      else
        values[random.below(values.size())] ^= static_cast<std::byte>(1 + random.below(255));
    });
    MemorySource source(bytes);
    auto reader = Reader::open(source);
    ASSERT_TRUE(reader);
    std::size_t got = 0;
    for (auto item = reader->next(); item && *item != nullptr; item = reader->next())
      if (const auto* piece = std::get_if<StepPiece>(*item)) got += piece->values.size();
    EXPECT_LE(got, 3u * 13 * 12 * 11 * 8);
  }
}

TEST(StepValues, AGroupMayTakeTooMuch) {
  ReadLimits limits;
  limits.max_group_bytes = 20000;  // enough for cells, but not for neighbourhoods
  EXPECT_EQ(code_of(written(with_steps(grid(6, 6, 6), Order::stream)), limits),
            ErrorCode::over_limit);
  Stepped stepped;
  stepped.mesh = grid(2, 2, 2);
  const auto a =
      add_stepped(stepped.mesh, array_of("a", Location::cell, ScalarType::float64, 2000));
  stepped.values[{a, 0}] = Bytes(8 * 8 * 2000);
  limits.max_group_bytes = 100000;
  EXPECT_EQ(code_of(written(stepped), limits), ErrorCode::over_limit);
}

TEST(StepValues, AWriterTakesNoMoreThanThereIs) {
  Stepped stepped = with_steps(grid(2, 2, 2), Order::keep);
  stepped.values.clear();
  stepped.values[{2, 0}] = Bytes(9 * 4);
  MemorySink sink;
  const auto report = write_mesh(stepped.mesh, sink, {}, [&](Writer& writer) {
    return writer.add_step_values(2, 0, stepped.values[{2, 0}]);
  });
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::misuse);
}

}  // namespace
}  // namespace shm
