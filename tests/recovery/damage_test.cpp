// Tests that readers report every damaged part of a file and can read every intact part, whichever
// parts are damaged.
#include "shm/damage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "shm/mesh_extract.h"
#include "shm/step_reader.h"
#include "shm/summary.h"
#include "support/counted_source.h"
#include "support/feature_files.h"
#include "support/file_surgery.h"
#include "support/golden_files.h"
#include "support/item_text.h"
#include "support/sanitized.h"
#include "support/stepped_mesh.h"

namespace shm {
namespace {

using container::ChunkKind;

/// Returns a file with segments of a few cells, arrays, and steps that refer to each other.
Bytes file(Order order, std::uint32_t segment_cells = 60, std::uint32_t group_cells = 30) {
  Stepped stepped = with_steps(two_blocks(), order);
  stepped.options.segment_cells = segment_cells;
  stepped.options.group_cells = group_cells;
  return written(stepped);
}

/// Returns the begin and end offset of each chunk.
std::vector<std::pair<std::size_t, std::size_t>> places(const Bytes& bytes) {
  std::vector<std::pair<std::size_t, std::size_t>> out;
  std::size_t at = container::kFileStartBytes;
  for (const Chunk& chunk : take_apart(bytes).chunks) {
    out.emplace_back(at, at + chunk.bytes());
    at = out.back().second;
  }
  return out;
}

DamageReport found(const Bytes& bytes) {
  MemoryRandomSource source(bytes);
  auto report = find_damage(source);
  EXPECT_TRUE(report) << (report ? "" : report.error().message());
  return report ? std::move(*report) : DamageReport();
}

/// The data that can still be read from a damaged file: coordinates by vertex, corners and values
/// by cell, and values by step.
struct Left {
  std::map<std::uint64_t, Bytes> points;
  std::map<std::uint64_t, std::vector<std::uint64_t>> cells;
  std::map<std::tuple<std::uint32_t, std::uint64_t, std::uint64_t>, Bytes> values;  // array, step
};

Result<Left> left_of(const Bytes& bytes) {
  MemoryRandomSource source(bytes);
  auto extractor = MeshExtractor::open_damaged(source);
  if (!extractor) return extractor.error();
  Left left;
  if (auto status = extractor->begin({}); !status) return status.error();
  const Schema& schema = extractor->schema();
  while (true) {
    const auto part = extractor->next();
    if (!part) return part.error();
    if (*part == nullptr) break;
    const MeshBlock& block = **part;
    const std::size_t xyz = 3 * scalar_bytes(schema.coordinate_type);
    for (std::size_t v = 0; v < block.vertex_count(); ++v)
      left.points[block.vertex_numbers[v]] =
          Bytes(block.xyz.begin() + static_cast<std::ptrdiff_t>(v * xyz),
                block.xyz.begin() + static_cast<std::ptrdiff_t>((v + 1) * xyz));
    for (std::size_t c = 0; c < block.cell_count(); ++c)
      left.cells[block.cell_numbers[c]].assign(
          block.corners.begin() + static_cast<std::ptrdiff_t>(block.corner_begin[c]),
          block.corners.begin() + static_cast<std::ptrdiff_t>(block.corner_begin[c + 1]));
  }
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    if (!schema.arrays[a].per_step) continue;
    const std::size_t stride = scalar_bytes(schema.arrays[a].type) * schema.arrays[a].components;
    const auto steps = extractor->steps(a);
    if (!steps) return steps.error();
    for (const std::uint64_t step : *steps) {
      if (auto status = extractor->begin_values(a, step); !status) return status.error();
      while (true) {
        const auto values = extractor->next_values();
        if (!values) return values.error();
        if (*values == nullptr) break;
        for (std::size_t i = 0; i < (*values)->numbers.size(); ++i)
          left.values[{a, step, (*values)->numbers[i]}] =
              Bytes((*values)->values.begin() + static_cast<std::ptrdiff_t>(i * stride),
                    (*values)->values.begin() + static_cast<std::ptrdiff_t>((i + 1) * stride));
      }
    }
  }
  return left;
}

/// Returns true if `all` contains every entry of `part` with an equal value.
template <class Map>
bool is_within(const Map& part, const Map& all) {
  return std::all_of(part.begin(), part.end(), [&](const auto& it) {
    const auto at = all.find(it.first);
    return at != all.end() && at->second == it.second;
  });
}
void expect_within(const Left& part, const Left& all, const std::string& what) {
  EXPECT_TRUE(is_within(part.points, all.points)) << what;
  EXPECT_TRUE(is_within(part.cells, all.cells)) << what;
  EXPECT_TRUE(is_within(part.values, all.values)) << what;
}

TEST(Damage, NothingInWholeFiles) {
  for (const FeatureFile& feature : feature_files()) {
    const DamageReport report = found(feature.bytes);
    EXPECT_TRUE(report.damages.empty()) << feature.name;
    EXPECT_TRUE(report.complete && report.restorable) << feature.name;
    MemoryRandomSource source(feature.bytes);
    MemorySink sink;
    ASSERT_TRUE(write_in_order(source, sink)) << feature.name;
    EXPECT_EQ(sink.bytes, feature.bytes) << feature.name;
  }
}

TEST(Damage, AllOfAnUndamagedFileIsLeft) {
  for (const Order order : {Order::keep, Order::stream}) {
    const Bytes bytes = file(order);
    const auto left = left_of(bytes);
    ASSERT_TRUE(left) << left.error().message();
    const Stepped stepped = with_steps(two_blocks(), order);
    EXPECT_EQ(left->cells.size(), stepped.mesh.cells.size());
    EXPECT_EQ(left->points.size(), stepped.mesh.vertices);
    std::size_t values = 0;
    for (const auto& [key, of_step] : stepped.values)
      values += of_step.size() / stepped.mesh.stride(key.first);
    EXPECT_EQ(left->values.size(), values);
  }
}

TEST(Damage, EachChunkIsNamedAndTheOthersAreLeft) {
  SomeCases some(5);
  for (const Order order : {Order::keep, Order::stream}) {
    for (const bool with_index : {true, false}) {
      const Bytes whole = file(order);
      const Left all = *left_of(whole);
      const FileParts parts = take_apart(whole);
      const auto at = places(whole);
      for (std::size_t c = 0; c + 1 < at.size(); ++c) {
        // Only some of the many step values.
        if (parts.chunks[c].is(ChunkKind::step_values) && c % 7 != 0) continue;
        for (const bool header : {true, false}) {
          if (some.skips_next()) continue;
          Bytes bytes = whole;
          bytes[header ? at[c].first + 9 : at[c].second - 1] ^= std::byte{4};
          if (!with_index) bytes[at.back().first + 3] ^= std::byte{1};
          const std::string what = "chunk " + std::to_string(c) + (header ? ", header" : "") +
                                   (with_index ? "" : ", no index");
          const DamageReport report = found(bytes);
          if (c + 2 == at.size() && header && !with_index)
            continue;  // forms one damaged range with the index
          ASSERT_EQ(report.damages.size(), with_index ? 1u : 2u) << what;
          const Damage& damage = report.damages[0];
          EXPECT_EQ(damage.kind, DamageKind::damaged) << what;
          EXPECT_EQ(damage.offset, at[c].first) << what;
          EXPECT_EQ(damage.bytes, at[c].second - at[c].first) << what;
          if (with_index || !header) {
            EXPECT_EQ(damage.section, container::chunk_name(parts.chunks[c].header.kind)) << what;
            if (parts.chunks[c].is(ChunkKind::group)) {
              EXPECT_EQ(damage.segment, parts.chunks[c].header.segment) << what;
              const auto group = take_group_apart(parts.chunks[c]);
              EXPECT_EQ(damage.first_cell, group->header.first_cell) << what;
              EXPECT_EQ(damage.cells, group->header.cells) << what;
            }
          }
          const auto left = left_of(bytes);
          // A file of this size stores the schema only once, so losing the schema makes the file
          // unreadable.
          if (c == 0) {
            EXPECT_FALSE(left) << what;
            continue;
          }
          ASSERT_TRUE(left) << what << ": " << left.error().message();
          expect_within(*left, all, what);
          const std::size_t lost = all.cells.size() - left->cells.size();
          if (!parts.chunks[c].is(ChunkKind::group)) {
            EXPECT_EQ(lost, 0u) << what;
            EXPECT_GT(left->values.size(), all.values.size() / 2) << what;
          } else if (with_index || !header) {
            EXPECT_LE(lost, 60u) << what;
          }
        }
      }
    }
  }
}

TEST(Damage, ArraysThatAreHurtAreNamed) {
  Stepped stepped = with_steps(two_blocks(), Order::keep);
  stepped.options.segment_cells = 60;
  stepped.mesh.schema.arrays.push_back(array_of("static", Location::cell, ScalarType::float64));
  Bytes noise;
  std::mt19937_64 random(7);
  for (std::size_t c = 0; c < stepped.mesh.cells.size(); ++c)
    append(noise, static_cast<double>(random()) * .37);
  stepped.mesh.arrays.push_back(noise);
  const Bytes whole = written(stepped);
  const FileParts parts = take_apart(whole);
  const auto at = places(whole);
  const auto array = static_cast<std::uint32_t>(stepped.mesh.schema.arrays.size() - 1);
  for (std::size_t c = 0; c < at.size(); ++c) {
    if (!parts.chunks[c].is(ChunkKind::group)) continue;
    const auto group = take_group_apart(parts.chunks[c]);
    std::size_t end = at[c].second;
    for (std::size_t s = group->streams.size(); s-- > 0; end -= group->streams[s + 0].size()) {
      const container::StreamEntry& stream = group->header.streams[s];
      if (stream.bytes == 0) continue;
      Bytes bytes = whole;
      bytes[end - 1] ^= std::byte{1};
      const DamageReport report = found(bytes);
      ASSERT_EQ(report.damages.size(), 1u);
      const bool of_array = stream.kind == container::StreamKind::array;
      EXPECT_EQ(report.damages[0].arrays,
                of_array ? std::vector<std::uint32_t>{stream.array} : std::vector<std::uint32_t>{});
      const auto left = left_of(bytes);
      ASSERT_TRUE(left) << left.error().message();
      EXPECT_EQ(left->cells.size() == stepped.mesh.cells.size(), of_array);
      MemoryRandomSource source(bytes);
      const auto extractor = MeshExtractor::open_damaged(source);
      if (of_array) {
        const auto lost = extractor->lost_arrays(parts.chunks[c].header.segment);
        EXPECT_EQ(std::vector<std::uint32_t>(lost.begin(), lost.end()),
                  std::vector<std::uint32_t>{array});
      }
    }
  }
}

// A header with a correct checksum refers to an array that the file does not have. A reader must
// not report that values of this array are lost.
TEST(Damage, ValuesOfNoArrayAreNotNamed) {
  Stepped stepped = with_steps(two_blocks(), Order::keep);
  stepped.mesh.schema.arrays.push_back(array_of("static", Location::cell, ScalarType::float64));
  Bytes& values = stepped.mesh.arrays.emplace_back();
  for (std::size_t c = 0; c < stepped.mesh.cells.size(); ++c)
    append(values, 1. / (1. + static_cast<double>(c)));
  FileParts parts = take_apart(written(stepped));
  Chunk& chunk = *parts.find(ChunkKind::group);
  auto group = take_group_apart(chunk);
  ASSERT_EQ(group->header.streams.back().kind, container::StreamKind::array);
  group->header.streams.back().array = 99;
  chunk.payload = put_group_together(*group);
  Bytes bytes = put_together(parts);
  bytes[places(bytes)[1].second - 1] ^= std::byte{1};
  for (const Damage& damage : found(bytes).damages) EXPECT_TRUE(damage.arrays.empty());
  MemoryRandomSource source(bytes);
  const auto extractor = MeshExtractor::open_damaged(source);
  ASSERT_TRUE(extractor);
  for (std::size_t s = 0; s < extractor->segments().size(); ++s)
    EXPECT_TRUE(extractor->lost_arrays(s).empty());
}

TEST(Damage, OrderOfChunksDoesNotMatter) {
  const Bytes whole = file(Order::stream);
  const FileParts parts = take_apart(whole);
  std::mt19937 random(3);
  for (int round = 0; round < 20; ++round) {
    FileParts mixed = parts;
    std::shuffle(mixed.chunks.begin(), mixed.chunks.end() - 1, random);
    mixed.chunks.insert(mixed.chunks.begin() + round % 5, mixed.chunks[7]);
    Bytes bytes = put_together(mixed, Numbering::as_they_are);
    const DamageReport report = found(bytes);
    EXPECT_TRUE(report.restorable && report.complete);
    EXPECT_TRUE(std::any_of(report.damages.begin(), report.damages.end(),
                            [](const Damage& it) { return it.kind == DamageKind::repeated; }));
    MemoryRandomSource source(bytes);
    MemorySink sink;
    ASSERT_TRUE(write_in_order(source, sink));
    EXPECT_EQ(sink.bytes, whole);
  }
}

TEST(Damage, CutAnywhere) {
  const Bytes whole = file(Order::keep, 40, 40);
  const Left all = *left_of(whole);
  const auto at = places(whole);
  std::size_t cells = 0;
  for (std::size_t end = 0; end < whole.size(); end += every(7) * 37) {
    const Bytes bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(end));
    MemoryRandomSource source(bytes);
    const auto report = find_damage(source);
    if (end < 8) {
      EXPECT_FALSE(report);
      continue;
    }
    ASSERT_TRUE(report) << end;
    EXPECT_FALSE(report->damages.empty()) << end;
    const auto left = left_of(bytes);
    ASSERT_EQ(static_cast<bool>(left), end >= at[0].second) << end;
    if (!left) continue;
    expect_within(*left, all, "cut at " + std::to_string(end));
    EXPECT_GE(left->cells.size(), cells) << end;
    cells = left->cells.size();
  }
  EXPECT_EQ(cells, all.cells.size());
}

TEST(Damage, BytesAtRandom) {
  constexpr int kRounds = kSanitized ? 18 : 50;
  for (const Order order : {Order::keep, Order::stream}) {
    const Bytes whole = file(order);
    const Left all = *left_of(whole);
    std::mt19937 random(11);
    for (int round = 0; round < kRounds; ++round) {
      Bytes bytes = whole;
      for (int hits = round % 6; hits >= 0; --hits) {
        const std::size_t begin = random() % bytes.size();
        const std::size_t end = std::min<std::size_t>(bytes.size(), begin + random() % 400);
        std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                  bytes.begin() + static_cast<std::ptrdiff_t>(end), std::byte{0});
      }
      MemoryRandomSource source(bytes);
      const auto report = find_damage(source);
      ASSERT_TRUE(report) << round;
      if (!report->schema) continue;
      const auto left = left_of(bytes);
      ASSERT_TRUE(left) << round << ": " << left.error().message();
      expect_within(*left, all, "round " + std::to_string(round));
    }
  }
}

/// Each of very many headers claims that all following bytes belong to its chunk. These bytes must
/// not be read again for each header.
TEST(Damage, ManyHeadersTakeTheirBytesOnly) {
  constexpr std::size_t kHeaders = 50'000;
  ByteWriter out;
  container::put(out, container::FileStart{});
  for (std::size_t i = 0; i < kHeaders; ++i) {
    container::ChunkHeader header;
    header.kind = static_cast<std::uint8_t>(ChunkKind::group);
    header.sequence = static_cast<std::uint32_t>(i * 85'000);
    header.segment = static_cast<std::uint32_t>(i % 7);
    header.payload_bytes = (kHeaders - 1 - i) * header.bytes();
    container::put(out, header);
  }
  CountedSource source(out.bytes);
  const auto report = find_damage(source);
  ASSERT_TRUE(report);
  EXPECT_FALSE(report->complete);
  EXPECT_LT(source.bytes, 60 * out.bytes.size());
}

/// Returns the error of opening the file.
ErrorCode error_of(const Bytes& bytes) {
  MemoryRandomSource source(bytes);
  const auto report = find_damage(source);
  EXPECT_FALSE(report);
  EXPECT_FALSE(MeshExtractor::open_damaged(source));
  return report ? ErrorCode::misuse : report.error().code;
}

Bytes without_index(const FileParts& parts) {
  Bytes bytes = put_together(parts);
  bytes.resize(places(bytes).back().first);
  return bytes;
}

// If chunks of two files are mixed, a reader cannot determine which file a chunk belongs to. The
// two files of this test have different error bounds, so the same bytes represent different values.
TEST(Damage, PartsOfTwoFilesAreRefused) {
  const Bytes one = file(Order::keep);
  FileParts parts = take_apart(one);
  FileParts others = take_apart(file(Order::stream));
  Chunk schema = others.chunks[0];
  ASSERT_TRUE(schema.is(ChunkKind::schema));
  parts.chunks.insert(parts.chunks.begin() + 3, parts.chunks[0]);
  EXPECT_TRUE(found(put_together(parts)).schema);
  parts.chunks[3] = schema;
  EXPECT_EQ(error_of(put_together(parts)), ErrorCode::corrupt);
  // A chunk has the sequence number of another chunk. If both chunks have the same contents, the
  // reader reports a repeated chunk. If their contents differ, the index determines which chunk is
  // correct; without an index, the file is refused.
  parts = take_apart(one);
  Bytes joined = without_index(parts);
  const auto at = places(one);
  Bytes other = one;
  Bytes second(other.begin() + static_cast<std::ptrdiff_t>(at[2].first),
               other.begin() + static_cast<std::ptrdiff_t>(at[2].second));
  joined.insert(joined.end(), second.begin(), second.end());
  EXPECT_EQ(found(joined).damages.front().kind, DamageKind::repeated);
  FileParts changed = take_apart(one);
  changed.chunks[2].payload.back() ^= std::byte{1};
  const Bytes all = put_together(changed);
  second.assign(all.begin() + static_cast<std::ptrdiff_t>(at[2].first),
                all.begin() + static_cast<std::ptrdiff_t>(at[2].second));
  joined.resize(joined.size() - second.size());
  joined.insert(joined.end(), second.begin(), second.end());
  EXPECT_EQ(error_of(joined), ErrorCode::corrupt);
}

// If a header states a large step number, a reader must not conclude that the file has this number
// of steps.
TEST(Damage, StepsBeyondTheLimitAreRefused) {
  Stepped stepped = with_steps(two_blocks(), Order::keep);
  stepped.values[{0, 5000}] =
      moving_values(stepped.mesh.schema.arrays[0], elements_of(stepped.mesh, 0), 7);
  stepped.options.key_steps = 1;
  const Bytes bytes = without_index(take_apart(written(stepped)));
  MemoryRandomSource source(bytes);
  ReadLimits limits;
  EXPECT_TRUE(StepReader::open_damaged(source, limits));
  limits.max_steps = 5000;
  const auto reader = StepReader::open_damaged(source, limits);
  ASSERT_FALSE(reader);
  EXPECT_EQ(reader.error().code, ErrorCode::over_limit);
}

// A chunk is lost between two groups. A reader regards it as a group only if cells or vertices are
// missing, too. If a reader cannot determine whether the lost chunk was a group, the numbers of the
// following groups are uncertain. Step values refer to groups by number, so the reader must not
// assign them to elements.
TEST(Damage, ALostExtraAmongGroupsIsNoGroup) {
  const Bytes whole = file(Order::stream, 60, 60);
  const Left all = *left_of(whole);
  FileParts parts = take_apart(whole);
  std::size_t group = 0;
  while (!parts.chunks[group].is(ChunkKind::group) || parts.chunks[group].header.segment != 2)
    ++group;
  Chunk extra = parts.chunks[group];
  extra.header.kind = static_cast<std::uint8_t>(ChunkKind::extra);
  extra.header.segment = 0;
  extra.payload.assign(40, std::byte{7});
  parts.chunks.insert(parts.chunks.begin() + static_cast<std::ptrdiff_t>(group) + 1, extra);
  Bytes bytes = put_together(parts);
  const auto at = places(bytes);
  const auto clear = [&](std::size_t from, std::size_t count) {
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(from), count, std::byte{0});
  };
  clear(at[group].first + container::kShortHeaderBytes, 20);
  clear(at[group + 1].first, container::kShortHeaderBytes);
  bytes.resize(at.back().first);
  const auto left = left_of(bytes);
  ASSERT_TRUE(left) << left.error().message();
  EXPECT_GT(left->cells.size(), 0u);
  expect_within(*left, all, "an extra among groups");
}

// A copy of the index in the middle of the file does not end the file, because the trailer points
// to another index.
TEST(Damage, ACopyOfTheIndexIsNoEnd) {
  const Bytes whole = file(Order::keep);
  const auto at = places(whole);
  const std::size_t index = at.back().first, bytes = at.back().second - index;
  const std::size_t middle = at[at.size() / 2].first + 50;
  ASSERT_LT(middle + bytes, index);
  Bytes damaged = whole;
  std::copy(whole.begin() + static_cast<std::ptrdiff_t>(index),
            whole.begin() + static_cast<std::ptrdiff_t>(index + bytes),
            damaged.begin() + static_cast<std::ptrdiff_t>(middle));
  const DamageReport report = found(damaged);
  EXPECT_TRUE(report.cells);
  EXPECT_FALSE(report.damages.empty());
  for (const Damage& damage : report.damages)
    EXPECT_LT(damage.offset, middle + bytes) << damage.section;
}

// Bytes in a damaged chunk that look like the mark of a chunk header are skipped.
TEST(Damage, MarksWithinADamagedChunkAreSkipped) {
  const Bytes whole = file(Order::keep);
  const auto at = places(whole);
  const auto largest = std::max_element(at.begin(), at.end(), [](const auto& a, const auto& b) {
    return a.second - a.first < b.second - b.first;
  });
  ASSERT_GT(largest->second - largest->first, 200u);
  Bytes damaged = whole;
  damaged[largest->first + 5] ^= std::byte{1};
  const DamageReport without_marks = found(damaged);
  constexpr std::string_view kMark = "SHMc";
  for (const std::size_t offset : {40u, 43u, 100u, 150u})
    for (std::size_t i = 0; i < kMark.size(); ++i)
      damaged[largest->first + offset + i] = static_cast<std::byte>(kMark[i]);
  const DamageReport report = found(damaged);
  ASSERT_EQ(report.damages.size(), without_marks.damages.size());
  for (std::size_t i = 0; i < report.damages.size(); ++i) {
    EXPECT_EQ(report.damages[i].offset, without_marks.damages[i].offset);
    EXPECT_EQ(report.damages[i].bytes, without_marks.damages[i].bytes);
  }
}

/// Returns copies of the file in which the index is unusable. The first copies have a damaged byte
/// in the index, a damaged header of the index, or damaged headers of index and trailer. In the
/// last copy, a byte of the index is damaged and all chunks are in reverse order.
std::vector<Bytes> without_index(const Bytes& whole) {
  const auto at = places(whole);
  const std::size_t begin = at.back().first, trailer = whole.size() - container::kTrailerBytes;
  std::vector<Bytes> damaged(4, whole);
  damaged[0][trailer - 1] ^= std::byte{1};
  damaged[1][begin + 5] ^= std::byte{1};
  damaged[2][begin + 5] ^= std::byte{1};
  damaged[2][trailer + 5] ^= std::byte{1};
  damaged[3][trailer - 1] ^= std::byte{1};
  auto to = damaged[3].begin() + container::kFileStartBytes;
  for (std::size_t c = at.size() - 1; c-- > 0;)
    to = std::copy(whole.begin() + static_cast<std::ptrdiff_t>(at[c].first),
                   whole.begin() + static_cast<std::ptrdiff_t>(at[c].second), to);
  return damaged;
}

TEST(Damage, ALostIndexIsMadeAnew) {
  std::size_t same = 0;
  for (const FeatureFile& feature : feature_files()) {
    const bool has_commits = feature.name.substr(0, 4) == "live";
    const std::vector<Bytes> copies = without_index(feature.bytes);
    for (const Bytes& damaged : copies) {
      // Without the last index and its trailer, a file with commits is one whose writer was killed.
      if (has_commits && &damaged == &copies[2]) {
        MemoryRandomSource killed(damaged);
        const auto end = bytes_of_file(killed);
        ASSERT_TRUE(end) << feature.name;
        EXPECT_LE(*end, places(feature.bytes).back().first) << feature.name;
        EXPECT_TRUE(found(damaged).damages.empty()) << feature.name;
        continue;
      }
      const DamageReport report = found(damaged);
      ASSERT_TRUE(report.schema) << feature.name;
      EXPECT_TRUE(report.lacks_index && !report.restorable) << feature.name;
      EXPECT_FALSE(report.has_other_ranges) << feature.name;
      MemoryRandomSource source(damaged);
      MemorySink sink;
      const auto status = write_in_order(source, sink);
      ASSERT_TRUE(status) << feature.name << ": " << status.error().message();
      if (has_commits) {  // the new index lists all chunks
        MemorySource whole(feature.bytes), restored(sink.bytes);
        EXPECT_EQ(*read_mesh(restored), *read_mesh(whole)) << feature.name;
        EXPECT_TRUE(found(sink.bytes).damages.empty()) << feature.name;
      } else {
        EXPECT_EQ(sink.bytes, feature.bytes) << feature.name;
      }
      ++same;
    }
  }
  EXPECT_GT(same, 80u);
}

// The index of a file of format version 0.9 can be rebuilt, too. The value ranges in the new index
// are computed from the decoded values.
TEST(Damage, ALostIndexOfVersion0IsMadeAnew) {
  std::size_t same = 0, with_other_ranges = 0;
  for (const auto& path : golden_files()) {
    const bool is_plain = path.stem() != "archive" && path.stem() != "parity";
    if (path.parent_path().filename() != "0.9" || !is_plain) continue;
    const std::string text = content(path);
    const auto bytes = std::as_bytes(std::span(text));
    const Bytes whole(bytes.begin(), bytes.end());
    const auto index = static_cast<std::ptrdiff_t>(places(whole).back().first);
    const Bytes damaged = without_index(whole)[0];
    const DamageReport report = found(damaged);
    ASSERT_TRUE(report.schema) << path;
    MemoryRandomSource source(damaged);
    MemorySink sink;
    const auto status = write_in_order(source, sink);
    ASSERT_TRUE(status) << path << ": " << status.error().message();
    const auto begin = sink.bytes.begin();
    if (report.has_other_ranges)
      EXPECT_EQ(Bytes(begin, begin + index), Bytes(whole.begin(), whole.begin() + index));
    else
      EXPECT_EQ(sink.bytes, whole) << path;
    ++(report.has_other_ranges ? with_other_ranges : same);
  }
  EXPECT_GT(same, 10u);
  EXPECT_GT(with_other_ranges, 0u);
}

void expect_not_written(const Bytes& damaged) {
  MemoryRandomSource source(damaged);
  MemorySink sink;
  const auto status = write_in_order(source, sink);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::corrupt);
  EXPECT_TRUE(sink.bytes.empty());
}

TEST(Damage, AnIndexIsMadeOnlyWhereThereWasNoMore) {
  const Bytes whole = file(Order::keep);
  const auto at = places(whole);
  const auto cut = [&](std::size_t bytes) {
    return Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(bytes));
  };
  const std::size_t last = at.end()[-2].first, index = at.back().first;
  Bytes without_last = whole;
  std::fill(without_last.begin() + static_cast<std::ptrdiff_t>(last), without_last.end(),
            std::byte{});
  for (const Bytes& damaged : {cut(index), cut(index + 9), without_last}) {
    const DamageReport report = found(damaged);
    EXPECT_TRUE(report.lacks_index && !report.complete);
    expect_not_written(damaged);
  }
}

// The checksums of a chunk are correct, but its payload cannot be decoded.
TEST(Damage, AnIndexIsMadeOfWhatCanBeDecodedOnly) {
  FileParts parts = take_apart(file(Order::keep));
  Chunk extra = parts.chunks.back();
  extra.header.kind = static_cast<std::uint8_t>(ChunkKind::extra);
  extra.header.version = container::without_digest(extra.header.version);
  parts.chunks.insert(parts.chunks.end() - 1, extra);
  Bytes bytes = put_together(parts);
  const auto at = places(bytes);
  bytes[at.back().first + 5] ^= std::byte{1};
  EXPECT_TRUE(found(bytes).complete);
  expect_not_written(bytes);
}

TEST(Damage, NothingOfAFile) {
  const Bytes bytes(5000, std::byte{'x'});
  MemoryRandomSource source(bytes);
  const auto report = find_damage(source);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::corrupt);
  EXPECT_FALSE(MeshExtractor::open_damaged(source));
}

}  // namespace
}  // namespace shm
