// Tests that a reader of a whole file checks each entry of the index against the file. Each test
// replaces one field of one entry with a wrong value and corrects the checksums, in both versions
// of the index.
#include <gtest/gtest.h>

#include <bit>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "shm/damage.h"
#include "shm/reader.h"
#include "support/file_surgery.h"
#include "support/item_text.h"
#include "support/sanitized.h"
#include "support/stepped_mesh.h"

namespace shm {
namespace {

using container::ChunkKind;
using container::Index;
using container::IndexEntry;
using container::StepEntry;

Result<void> read_all(std::span<const std::byte> bytes, unsigned threads = 1) {
  MemorySource source(bytes);
  ReadOptions options;
  options.threads = threads;
  auto reader = Reader::open(source, {}, options);
  if (!reader) return reader.error();
  while (true) {
    const auto item = reader->next();
    if (!item) return item.error();
    if (*item == nullptr) return {};
  }
}

template <class T>
T other(T value) {
  if constexpr (std::is_enum_v<T>)
    return static_cast<T>(static_cast<std::uint8_t>(value) ^ 1);
  else if constexpr (std::is_floating_point_v<T>)
    return std::isfinite(value) ? std::nextafter(value, 1e300) : 0;
  else
    return value + 1;
}

struct Lie {
  std::string field;
  std::function<void(IndexEntry&)> tell;
  bool old_only = false;  // version 1 has totals instead
};

/// Returns all tested changes of an index entry. Each change replaces a single field with a value
/// that contradicts the file.
std::vector<Lie> lies_about(const IndexEntry& entry) {
  std::vector<Lie> lies;
  const auto add = [&](const char* field, auto IndexEntry::*member, bool old_only = false) {
    lies.push_back(
        {field, [=](IndexEntry& changed) { changed.*member = other(changed.*member); }, old_only});
  };
  add("kind", &IndexEntry::kind);
  add("offset", &IndexEntry::offset, true);
  add("bytes", &IndexEntry::bytes);
  if (entry.is(ChunkKind::group)) {
    add("segment", &IndexEntry::segment);
    add("first_cell", &IndexEntry::first_cell, true);
    add("cells", &IndexEntry::cells);
    add("first_vertex", &IndexEntry::first_vertex, true);
    add("vertices", &IndexEntry::vertices);
    add("header_bytes", &IndexEntry::header_bytes);
    for (std::size_t c = 0; c < 6; ++c) {
      lies.push_back({"box", [c](IndexEntry& changed) { changed.box[c] = other(changed.box[c]); }});
      lies.push_back({"box: NaN", [c](IndexEntry& changed) {
                        changed.box[c] = std::numeric_limits<double>::quiet_NaN();
                      }});
    }
  }
  for (std::size_t p = 0; p < entry.parts.size(); ++p) {
    const auto add_part = [&](const char* field, auto StepEntry::*member, bool old_only = false) {
      lies.push_back(
          {"part " + std::to_string(p) + ": " + field,
           [=](IndexEntry& changed) { changed.parts[p].*member = other(changed.parts[p].*member); },
           old_only});
    };
    add_part("array", &StepEntry::array);
    add_part("step", &StepEntry::step);
    add_part("first", &StepEntry::first, true);
    add_part("count", &StepEntry::count);
    add_part("group", &StepEntry::group);
    add_part("reference", &StepEntry::reference);
    add_part("codec", &StepEntry::codec);
  }
  return lies;
}

Index index_of(std::span<const std::byte> bytes) {
  Index index;
  with_index(bytes, [&](Index& it) { index = it; });
  return index;
}

/// Returns consistent files with steps. In some files, each chunk of step values has several parts;
/// in others, it has one part.
std::vector<std::pair<std::string, Bytes>> true_files() {
  std::vector<std::pair<std::string, Bytes>> files;
  for (const Bytes& bytes : {small_file(ScalarType::float64), written(waves(3))}) {
    files.emplace_back("version 1", bytes);
    files.emplace_back("version 0", with_old_index(bytes, [](Index&) {}));
  }
  return files;
}

TEST(IndexEntries, EachFieldOfEachIsHeldAgainstWhatIsThere) {
  std::size_t groups = 0, parts = 0, together = 0, lies = 0;
  for (const auto& [name, bytes] : true_files()) {
    ASSERT_TRUE(read_all(bytes)) << name << read_all(bytes).error().message();
    const Index index = index_of(bytes);
    for (std::size_t i = 0; i < index.entries.size(); ++i) {
      groups += index.entries[i].is(ChunkKind::group) ? 1 : 0;
      parts += index.entries[i].parts.size();
      together += index.entries[i].parts.size() > 1 ? 1 : 0;
      for (const Lie& lie : lies_about(index.entries[i])) {
        if ((lie.old_only && index.version > 0) || ++lies % every(5) != 0) continue;
        const Bytes inconsistent =
            with_index(bytes, [&](Index& changed) { lie.tell(changed.entries[i]); });
        for (const unsigned threads : {1u, 3u}) {
          if (threads > 1 && lies % 8 != 0) continue;
          const auto read = read_all(inconsistent, threads);
          const std::string what = name + ", entry " + std::to_string(i) + ": " + lie.field;
          ASSERT_FALSE(read) << what;
          EXPECT_EQ(read.error().code, ErrorCode::corrupt) << what;
          EXPECT_EQ(read.error().section, "index") << what << read.error().message();
          EXPECT_NE(read.error().offset, kNoOffset) << what;
        }
      }
    }
  }
  EXPECT_GE(lies, 2000u);
  RecordProperty("lies", std::to_string(lies / every(5)));
  EXPECT_GE(groups, 8u);
  EXPECT_GE(parts, 40u);
  EXPECT_GE(together, 1u);
}

TEST(IndexEntries, TheEntryAndItsFieldAreNamed) {
  const Bytes inconsistent = with_index(small_file(ScalarType::float64), [](Index& index) {
    entry_of(index, ChunkKind::group, 1).box[4] += 1;
  });
  const auto read = read_all(inconsistent);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().detail.find("of the group at byte "), std::string::npos);
  EXPECT_NE(read.error().detail.find("a different box"), std::string::npos)
      << read.error().message();
}

TEST(IndexEntries, ChunksThatAReaderMaySkipAreListedToo) {
  FileParts parts = take_apart(small_file(ScalarType::float64));
  Chunk unknown;
  unknown.header.kind = 11;
  unknown.header.flags = container::kChunkOptional;
  unknown.payload = Bytes(7);
  parts.chunks.insert(parts.chunks.end() - 1, unknown);
  list_anew(parts);
  const Bytes bytes = put_together(std::move(parts));
  const auto read = read_all(bytes);
  EXPECT_TRUE(read) << read.error().message();
  EXPECT_FALSE(read_all(with_index(bytes, [](Index& index) { ++index.entries.back().bytes; })));
  EXPECT_FALSE(read_all(with_index(bytes, [](Index& index) { ++index.entries.back().kind; })));
}

// --- bounding boxes of coordinates

/// Makes the same change to the box of a group and to its copy in the index, so that the two agree.
Bytes with_other_box(std::span<const std::byte> bytes, std::size_t group,
                     const std::function<void(std::array<double, 6>&)>& change) {
  FileParts parts = take_apart(bytes);
  Chunk& chunk = *parts.find(ChunkKind::group, group);
  auto apart = take_group_apart(chunk);
  const std::size_t before = chunk.bytes();
  change(apart->header.box);
  const auto box = apart->header.box;
  chunk.payload = put_group_together(std::move(*apart));
  const std::uint64_t longer = chunk.bytes() - before;
  return with_index(put_together(std::move(parts)), [&](Index& index) {
    IndexEntry& entry = entry_of(index, ChunkKind::group, group);
    entry.box = box;
    entry.bytes += longer;  // boxes have variable length
    entry.header_bytes += longer;
  });
}

TEST(IndexBoxes, AreHeldAgainstTheCoordinates) {
  const Bytes bytes = small_file(ScalarType::float64);
  ASSERT_TRUE(read_all(with_other_box(bytes, 1, [](auto&) {})));
  for (const std::size_t group : {0u, 1u, 2u, 3u})
    for (std::size_t c = 0; c < 6; ++c)
      for (const double by : {-.5, -1e-12, 1e-12, .5}) {
        const Bytes inconsistent = with_other_box(bytes, group, [&](auto& box) { box[c] += by; });
        for (const unsigned threads : {1u, 3u}) {
          if (threads > 1 && c != 4) continue;
          const auto read = read_all(inconsistent, threads);
          ASSERT_FALSE(read) << group << ' ' << c << ' ' << by;
          EXPECT_EQ(read.error().code, ErrorCode::corrupt);
          EXPECT_EQ(read.error().section, "group " + std::to_string(group));
        }
      }
}

TEST(IndexBoxes, OfRoundedCoordinatesMayDifferByTheBound) {
  Quantization bound;
  bound.bits = Quantization::kAbsolute;
  bound.max_abs = bound.spacing = 1e-3;
  bound.minimum = {0, 0, 0};
  const Bytes bytes = small_file(ScalarType::float64, bound);
  const auto read = read_all(bytes);
  ASSERT_TRUE(read) << read.error().message();
  for (std::size_t c = 0; c < 6; ++c)
    for (const double by : {-2.1e-3, 2.1e-3})
      EXPECT_FALSE(read_all(with_other_box(bytes, 2, [&](auto& box) { box[c] += by; })));
}

// --- repair of the index

TEST(IndexEntries, AnIndexThatLiesIsMadeAnew) {
  const Bytes bytes = small_file(ScalarType::float64);
  std::size_t lies = 0;
  const Index index = index_of(bytes);
  for (std::size_t i = 0; i < index.entries.size(); i += 4)
    for (const Lie& lie : lies_about(index.entries[i])) {
      if (lie.old_only || ++lies % every(5) != 0) continue;
      const Bytes inconsistent =
          with_index(bytes, [&](Index& changed) { lie.tell(changed.entries[i]); });
      MemoryRandomSource source(inconsistent);
      const auto damage = find_damage(source);
      ASSERT_TRUE(damage) << lie.field << damage.error().message();
      ASSERT_FALSE(damage->damages.empty()) << i << lie.field;
      EXPECT_EQ(damage->damages[0].section, "index") << i << lie.field;
      MemorySink healed;
      const auto status = write_in_order(source, healed);
      ASSERT_TRUE(status) << i << lie.field << status.error().message();
      EXPECT_EQ(healed.bytes, bytes) << i << lie.field;
    }
  EXPECT_GT(lies, 50u);
}

}  // namespace
}  // namespace shm
