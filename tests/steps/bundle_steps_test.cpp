// Tests of bundles in files: steps of small arrays are coded together, and every reader returns the
// same values as without bundles. Inconsistent bundles are refused.
#include "codecs/bundles/bundle.h"
#include "codecs/shared/codec_id.h"

#include <set>

#include "shm/appender.h"
#include "shm/step_reader.h"
#include "shm/summary.h"
#include "support/counted_source.h"
#include "support/file_surgery.h"
#include "support/sanitized.h"
#include "support/stepped_mesh.h"

namespace shm {
namespace {

using container::ChunkKind;
using container::Codec;
using container::StepHeader;
using container::StepPart;

constexpr std::uint64_t kSteps = 30;

/// Returns a mesh with `arrays` stepped arrays, with values at kSteps steps. Types, locations and
/// numbers of components vary.
Stepped many_arrays(std::uint32_t arrays, TestMesh mesh = grid(2, 2, 1, ScalarType::float64)) {
  Stepped stepped;
  stepped.mesh = with_order(std::move(mesh), Order::keep, true, 0);
  stepped.options = {};
  for (std::uint32_t a = 0; a < arrays; ++a) {
    constexpr std::array kTypes = {ScalarType::float64, ScalarType::float32, ScalarType::int32};
    const auto array =
        add_stepped(stepped.mesh,
                    array_of("a" + std::to_string(a), a % 3 == 0 ? Location::point : Location::cell,
                             kTypes[a % 3], a % 5 == 4 ? 6 : 1));
    for (std::uint64_t step = 0; step < kSteps; ++step)
      stepped.values[{array, step}] = moving_values(stepped.mesh.schema.arrays[array],
                                                    elements_of(stepped.mesh, array), step + a % 4);
  }
  return stepped;
}

std::size_t bundles_in(std::span<const std::byte> bytes) {
  std::size_t count = 0;
  for (const Chunk& chunk : take_apart(bytes).chunks)
    count += chunk.is(ChunkKind::step_values) &&
             container::without_digest(chunk.header.version) == container::kBundleVersion;
  return count;
}

Values read_values(std::span<const std::byte> bytes) {
  const auto back = read_mesh(bytes);
  EXPECT_TRUE(back) << (back ? "" : back.error().message());
  Values values;
  if (!back) return values;
  for (const StepPiece& piece : back->steps) {
    Bytes& to = values[{piece.array, piece.step}];
    to.insert(to.end(), piece.values.begin(), piece.values.end());
  }
  return values;
}

/// Writes the file, and compares the values of a Reader and of a StepReader with the source.
Bytes expect_values_back(const Stepped& stepped) {
  const Bytes bytes = written(stepped);
  EXPECT_TRUE(read_values(bytes) == stepped.values);
  MemoryRandomSource source(bytes);
  auto reader = StepReader::open(source);
  EXPECT_TRUE(reader) << (reader ? "" : reader.error().message());
  if (!reader) return bytes;
  for (const auto& [key, values] : stepped.values) {
    const auto pieces = reader->read({key.first, key.second});
    EXPECT_TRUE(pieces) << (pieces ? "" : pieces.error().message());
    Bytes all;
    if (pieces)
      for (const StepValues& piece : *pieces)
        all.insert(all.end(), piece.values.begin(), piece.values.end());
    EXPECT_TRUE(all == values) << "array " << key.first << " step " << key.second;
  }
  return bytes;
}

Stepped without_bundles(Stepped stepped) {
  stepped.options.waiting_bytes = 0;
  return stepped;
}

TEST(BundleSteps, ReadersReturnAllValues) {
  for (const Level level : {Level::fast, Level::standard, Level::best})
    for (const std::uint32_t arrays : {1u, 2u, 40u}) {
      SCOPED_TRACE(std::to_string(arrays) + " arrays, level " +
                   std::to_string(static_cast<int>(level)));
      Stepped stepped = many_arrays(arrays);
      stepped.options.level = level;
      const Bytes bytes = expect_values_back(stepped);
      EXPECT_GT(bundles_in(bytes), 0u);
      EXPECT_LT(bytes.size(), expect_values_back(without_bundles(stepped)).size());
    }
}

// Twenty equal arrays need hardly more bytes than one.
TEST(BundleSteps, EqualArraysAreStoredOnce) {
  const auto size_of = [](std::uint32_t arrays) {
    Stepped stepped = many_arrays(1);
    for (std::uint32_t a = 1; a < arrays; ++a) {
      const auto array =
          add_stepped(stepped.mesh, array_of("b", Location::point, ScalarType::float64));
      for (std::uint64_t step = 0; step < kSteps; ++step)
        stepped.values[{array, step}] = stepped.values[{0, step}];
    }
    return expect_values_back(stepped).size();
  };
  EXPECT_LE(size_of(20), size_of(1) + 20 * 8);
}

// Arrays of random values fill several bundles. An array that equals one of them is in its bundle.
TEST(BundleSteps, CopiesAreInTheBundleOfTheirOriginal) {
  const auto size_of = [](std::uint32_t copies) {
    Stepped stepped;
    stepped.mesh = with_order(grid(4, 4, 4, ScalarType::float64), Order::keep, true, 0);
    stepped.options = {};
    PlainRandom random(3);
    for (std::uint32_t a = 0; a < 9 + copies; ++a) {
      add_stepped(stepped.mesh, array_of("a", Location::point, ScalarType::float64));
      for (std::uint64_t step = 0; step < 80; ++step)
        for (std::uint64_t v = 0; v < stepped.mesh.vertices; ++v)
          append(stepped.values[{a, step}], static_cast<double>(random.below(1 << 30)));
      if (a >= 9)
        for (std::uint64_t step = 0; step < 80; ++step)
          stepped.values[{a, step}] = stepped.values[{a % 9, step}];
    }
    const Bytes bytes = expect_values_back(stepped);
    EXPECT_GT(bundles_in(bytes), 2u);
    return bytes.size();
  };
  EXPECT_LE(size_of(20), size_of(0) + 20 * 12);
}

// The order in which steps are written and the sizes of the pieces do not change the file.
TEST(BundleSteps, TheOrderOfStepsDoesNotMatter) {
  const Stepped stepped = many_arrays(12);
  const Bytes bytes = written(stepped);
  EXPECT_TRUE(written(stepped, 1) == bytes);
  MemorySink sink;
  const auto report =
      write_mesh(stepped.mesh, sink, stepped.options, [&](Writer& writer) -> Result<void> {
        for (std::uint64_t step = 0; step < kSteps; ++step)
          for (std::uint32_t a = 0; a < 12; ++a)
            if (auto status = writer.add_step_values(a, step, stepped.values.at({a, step}));
                !status)
              return status;
        return {};
      });
  ASSERT_TRUE(report);
  EXPECT_TRUE(sink.bytes == bytes);
}

// Some arrays lack steps, some have many elements, and some belong to several groups.
TEST(BundleSteps, OtherArraysHavePartsOfTheirOwn) {
  Stepped stepped = many_arrays(8, grid(12, 12, 12, ScalarType::float64));
  const std::uint32_t last = static_cast<std::uint32_t>(stepped.mesh.schema.blocks.size());
  stepped.mesh.schema.blocks.push_back({2, "small", CellShape::hexahedron, 8});
  for (std::size_t c = 1000; c < 1010; ++c) stepped.mesh.cells[c].block = last;
  const auto small =
      add_stepped(stepped.mesh, array_of("s", Location::cell, ScalarType::float64, 1, {last}));
  const auto rare =
      add_stepped(stepped.mesh, array_of("r", Location::cell, ScalarType::float64, 1, {last}));
  for (std::uint64_t step = 0; step < kSteps; ++step) {
    const Bytes values = moving_values(stepped.mesh.schema.arrays[small], 10, step);
    stepped.values[{small, step}] = values;
    if (step % 7 < 2) stepped.values[{rare, step}] = values;
  }
  stepped.options.group_cells = 500;
  const Bytes bytes = expect_values_back(stepped);
  std::set<std::uint32_t> in_bundles, in_parts;
  for (const StepHeader& header : step_headers_of(bytes))
    for (std::uint32_t a = 0; a < header.arrays; ++a)
      (header.codec == Codec::bundle ? in_bundles : in_parts).insert(header.array + a);
  EXPECT_TRUE(in_bundles.contains(small));
  EXPECT_TRUE(in_parts.contains(rare));
  EXPECT_TRUE(in_parts.contains(0));
}

TEST(BundleSteps, BoundsAreKept) {
  Stepped stepped = many_arrays(1);
  ArrayInfo lossy = array_of("lossy", Location::point, ScalarType::float64);
  lossy.quantization = Quantization::absolute(.01, 1);
  const auto array = add_stepped(stepped.mesh, lossy);
  for (std::uint64_t step = 0; step < kSteps; ++step)
    for (std::uint64_t v = 0; v < stepped.mesh.vertices; ++v)
      append(stepped.values[{array, step}], std::sin(static_cast<double>(v + 3 * step)));
  const Bytes bytes = written(stepped);
  ASSERT_GT(bundles_in(bytes), 0u);
  const Values values = read_values(bytes);
  double most = 0;
  for (std::uint64_t step = 0; step < kSteps; ++step)
    for (std::uint64_t v = 0; v < stepped.mesh.vertices; ++v) {
      double before = 0, after = 0;
      std::memcpy(&before, &stepped.values.at({array, step})[8 * v], 8);
      std::memcpy(&after, &values.at({array, step})[8 * v], 8);
      most = std::max(most, std::abs(before - after));
    }
  EXPECT_LE(most, .01);
  EXPECT_GT(most, 0);
}

// Steps that are appended are in bundles, too, and may come after bundles.
TEST(BundleSteps, AppendedSteps) {
  const Stepped all = many_arrays(12);
  Stepped first = all;
  std::erase_if(first.values, [](const auto& it) { return it.first.second >= kSteps / 2; });
  for (const std::uint64_t waiting_bytes : {std::uint64_t{0}, std::uint64_t{8} << 20}) {
    Bytes bytes = written(first);
    for (const std::uint64_t end : {kSteps / 2 + 1, kSteps}) {
      MemoryRandomSource source(bytes);
      MemorySink sink;
      AppendOptions options;
      options.waiting_bytes = waiting_bytes;
      auto appender = Appender::open(source, sink, options);
      ASSERT_TRUE(appender) << appender.error().message();
      const std::uint64_t begin = end == kSteps ? kSteps / 2 + 1 : kSteps / 2;
      for (const auto& [key, values] : all.values)
        if (key.second >= begin && key.second < end) {
          ASSERT_TRUE(appender->add_step_values(key.first, key.second, values));
        }
      ASSERT_TRUE(appender->finish());
      bytes = std::move(sink.bytes);
    }
    EXPECT_EQ(bundles_in(bytes) > bundles_in(written(first)), waiting_bytes > 0);
    EXPECT_TRUE(read_values(bytes) == all.values);
  }
}

// If many steps exceed the memory limit, several bundles follow each other.
TEST(BundleSteps, FewBytesWait) {
  Stepped stepped = many_arrays(6);
  const std::size_t at_once = bundles_in(expect_values_back(stepped));
  stepped.options.waiting_bytes = 2000;
  EXPECT_GT(bundles_in(expect_values_back(stepped)), at_once);
}

TEST(BundleSteps, SummariesListArraysAndSteps) {
  const Stepped stepped = many_arrays(12);
  const Bytes bytes = written(stepped);
  MemoryRandomSource source(bytes);
  const auto summary = read_summary(source);
  ASSERT_TRUE(summary) << summary.error().message();
  EXPECT_EQ(summary->totals.steps, kSteps);
}

// A reader of one array at one step reads one bundle, and none of the others.
TEST(BundleSteps, OneStepNeedsOneBundle) {
  Stepped stepped = many_arrays(6);
  stepped.options.waiting_bytes = 2000;
  const Bytes bytes = written(stepped);
  ASSERT_GT(bundles_in(bytes), 4u);
  CountedSource source(bytes);
  auto reader = StepReader::open(source);
  ASSERT_TRUE(reader);
  source.bytes = 0;
  ASSERT_TRUE(reader->read({3, 17}));
  EXPECT_LT(source.bytes, bytes.size() / 4);
}

/// Changes the parts of the first bundle of the file. The index is made to agree with them.
Bytes with_bundle(std::span<const std::byte> bytes,
                  const std::function<void(std::vector<StepPart>&, Bytes&)>& change) {
  FileParts parts = take_apart(bytes);
  for (Chunk& chunk : parts.chunks) {
    if (!chunk.is(ChunkKind::step_values) ||
        container::without_digest(chunk.header.version) != container::kBundleVersion)
      continue;
    auto steps = take_steps_apart(chunk);
    EXPECT_TRUE(steps);
    change(steps->heads, steps->values[0]);
    chunk.payload = put_steps_together(std::move(*steps), chunk.header.version);
    break;
  }
  list_anew(parts);
  return put_together(parts);
}

/// Returns the error of reading the whole file, or nullopt if it is read without an error.
std::optional<ErrorCode> code_of(std::span<const std::byte> bytes) {
  const auto back = read_mesh(bytes);
  return back ? std::nullopt : std::optional(back.error().code);
}

/// Returns the error of reading all steps of the first array with a StepReader.
std::optional<ErrorCode> code_of_steps(const Bytes& bytes) {
  MemoryRandomSource source(bytes);
  auto reader = StepReader::open(source);
  if (!reader) return reader.error().code;
  for (const std::uint64_t step : reader->steps(0))
    if (const auto values = reader->read({0, step}); !values) return values.error().code;
  return std::nullopt;
}

TEST(BundleSteps, LyingHeadersAreRefused) {
  const Bytes bytes = written(many_arrays(12));
  using Parts = std::vector<StepPart>;
  const std::vector<std::pair<std::string, std::function<void(Parts&)>>> lies = {
      {"array", [](Parts& parts) { parts.back().header.array += 1; }},
      {"arrays", [](Parts& parts) { parts.back().header.arrays += 1; }},
      {"fewer arrays", [](Parts& parts) { parts.pop_back(); }},
      {"no arrays", [](Parts& parts) { parts.back().header.arrays = 0; }},
      {"all arrays", [](Parts& parts) { parts.back().header.arrays = ~0u; }},
      {"steps", [](Parts& parts) { parts[0].header.steps += 1; }},
      {"fewer steps", [](Parts& parts) { parts[0].header.steps -= 1; }},
      {"no steps", [](Parts& parts) { parts[0].header.steps = 0; }},
      {"all steps", [](Parts& parts) { parts[0].header.steps = ~std::uint64_t{0}; }},
      {"last step", [](Parts& parts) { parts[0].header.step = ~0u; }},
      {"group", [](Parts& parts) { parts[0].header.group = 1; }},
      {"count", [](Parts& parts) { parts[0].header.count += 1; }},
      {"fewer elements", [](Parts& parts) { parts[0].header.count -= 1; }},
      {"no elements", [](Parts& parts) { parts[0].header.count = 0; }},
      {"all elements", [](Parts& parts) { parts[0].header.count = ~std::uint64_t{0}; }},
  };
  for (const auto& [name, lie] : lies) {
    SCOPED_TRACE(name);
    const Bytes changed = with_bundle(bytes, [&lie = lie](Parts& parts, Bytes&) { lie(parts); });
    EXPECT_TRUE(code_of(changed));
    EXPECT_TRUE(code_of_steps(changed));
  }
}

TEST(BundleSteps, DamagedBundlesAreRefusedOrReturnOtherValues) {
  Stepped stepped = many_arrays(12);
  stepped.options.digest = false;
  const Bytes bytes = written(stepped);
  PlainRandom random(5);
  for (int i = 0; i < 300; ++i) {
    const Bytes changed = with_bundle(bytes, [&](auto&, Bytes& bundle) {
      if (i % 4 == 0)
        bundle.resize(random.below(bundle.size()));
      else
        bundle[random.below(bundle.size())] ^= static_cast<std::byte>(1 + random.below(255));
    });
    const auto code = code_of(changed);
    if (!code) {
      EXPECT_EQ(read_values(changed).size(), 12 * kSteps);
    } else {
      EXPECT_EQ(code, ErrorCode::corrupt);
    }
    EXPECT_EQ(code_of_steps(changed), code);
  }
}

// The index states sizes of chunks that the file does not have. Otherwise, these sizes would permit
// any number of arrays and steps.
TEST(BundleSteps, AnIndexOfBytesThatDoNotExistIsRefused) {
  const Bytes bytes = with_index(written(many_arrays(2)), [](container::Index& index) {
    auto& entry = entry_of(index, ChunkKind::step_values, 0);
    entry.bytes += std::uint64_t{1} << 40;
  });
  EXPECT_EQ(code_of_steps(bytes), ErrorCode::corrupt);
}

// A bundle must contain all elements of a single group.
TEST(BundleSteps, MoreElementsThanTheGroupHasAreRefused) {
  Stepped stepped = many_arrays(1, grid(6, 6, 6, ScalarType::float64));
  stepped.mesh.schema.arrays[0].location = Location::cell;
  stepped.options.group_cells = 100;
  for (auto& [key, values] : stepped.values) values.resize(216 * 8);
  const Bytes bytes = with_index(written(stepped), [](container::Index& index) {
    for (container::IndexEntry& entry : index.entries)
      if (entry.is(ChunkKind::step_values))
        for (container::StepEntry& part : entry.parts)
          if (part.group == 0) {
            part.codec = Codec::bundle;
            part.count = 216;
          }
  });
  EXPECT_EQ(code_of_steps(bytes), ErrorCode::corrupt);
}

TEST(BundleSteps, TooManyStepsAreRefused) {
  const Bytes bytes = written(many_arrays(12));
  ReadLimits limits;
  limits.max_steps = kSteps - 1;
  MemorySource whole(bytes);
  const auto back = read_mesh(whole, limits);
  ASSERT_FALSE(back);
  EXPECT_EQ(back.error().code, ErrorCode::over_limit);
  MemoryRandomSource source(bytes);
  const auto reader = StepReader::open(source, limits);
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::over_limit);
}

TEST(BundleSteps, WrongNumbersOfValuesAreRefused) {
  Stepped stepped = many_arrays(1);
  for (const std::ptrdiff_t more : {-8, 8}) {
    MemorySink sink;
    const auto report = write_mesh(stepped.mesh, sink, stepped.options, [&](Writer& writer) {
      Bytes values = stepped.values.at({0, 0});
      values.resize(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(values.size()) + more));
      return writer.add_step_values(0, 0, values);
    });
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::misuse);
  }
}

}  // namespace
}  // namespace shm
