// Tests of read_summary: it returns the same summary as a Reader, reads only headers, and detects
// damaged headers.
#include "shm/summary.h"
#include "codecs/shared/codec_id.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <random>

#include "shm/damage.h"
#include "shm/mesh_extract.h"
#include "support/counted_source.h"
#include "support/file_surgery.h"
#include "support/golden_files.h"
#include "support/item_text.h"
#include "support/sanitized.h"
#include "support/stepped_mesh.h"

namespace shm {
namespace {

using container::ChunkKind;
using container::IndexEntry;

Result<Summary> summary_of(std::span<const std::byte> bytes, const ReadLimits& limits = {}) {
  MemoryRandomSource source(bytes);
  return read_summary(source, limits);
}

Result<Summary> summary_by_reader(std::span<const std::byte> bytes) {
  auto decoded = decode_in_pieces(bytes);
  if (!decoded) return decoded.error();
  Summary summary;
  summary.schema = std::move(decoded->schema);
  for (Item& item : decoded->items) {
    if (const auto* times = std::get_if<StepTimes>(&item))
      summary.step_times.insert(summary.step_times.end(), times->times.begin(), times->times.end());
    if (auto* extra = std::get_if<Extra>(&item)) summary.extras.push_back(std::move(*extra));
    if (auto* totals = std::get_if<Totals>(&item)) summary.totals = std::move(*totals);
  }
  return summary;
}

void expect_same(const Summary& a, const Summary& b, const std::string& name) {
  SCOPED_TRACE(name);
  EXPECT_EQ(a.schema, b.schema);
  EXPECT_TRUE(std::equal(a.step_times.begin(), a.step_times.end(), b.step_times.begin(),
                         b.step_times.end(), [](double x, double y) {
                           return std::bit_cast<std::uint64_t>(x) ==
                                  std::bit_cast<std::uint64_t>(y);
                         }));
  EXPECT_EQ(a.extras, b.extras);
  EXPECT_EQ(a.totals.vertices, b.totals.vertices);
  EXPECT_EQ(a.totals.cells, b.totals.cells);
  EXPECT_EQ(a.totals.hexahedra, b.totals.hexahedra);
  EXPECT_EQ(a.totals.max_active_vertices, b.totals.max_active_vertices);
  EXPECT_EQ(a.totals.segment_starts, b.totals.segment_starts);
  EXPECT_EQ(a.totals.segment_connectivity, b.totals.segment_connectivity);
  EXPECT_EQ(a.totals.imported_vertices, b.totals.imported_vertices);
  EXPECT_EQ(a.totals.total_bytes, b.totals.total_bytes);
  EXPECT_EQ(a.totals.streams, b.totals.streams);
  EXPECT_EQ(a.totals.steps, b.totals.steps);
  EXPECT_EQ(a.totals.block_cells, b.totals.block_cells);
  EXPECT_EQ(a.totals.trailing_bytes, b.totals.trailing_bytes);
}

/// Checks that read_summary() returns the same summary as a Reader.
void expect_as_the_reader(std::span<const std::byte> bytes, const std::string& name) {
  const auto expected = summary_by_reader(bytes);
  ASSERT_TRUE(expected) << name << ": " << expected.error().message();
  const auto summary = summary_of(bytes);
  ASSERT_TRUE(summary) << name << ": " << summary.error().message();
  expect_same(*summary, *expected, name);
}

/// Returns a small file. The time of its last step is NaN, which means that the step has no time.
Bytes small_file() {
  return shm::small_file(ScalarType::float32, {}, std::numeric_limits<double>::quiet_NaN());
}

TEST(Summary, OfEveryFeatureIsWhatTheReaderTells) {
  for (const FeatureFile& file : feature_files()) expect_as_the_reader(file.bytes, file.name);
  expect_as_the_reader(small_file(), "small_file");
}

TEST(Summary, OfEveryGoldenFileIsWhatTheReaderTells) {
  std::size_t files = 0;
  for (const auto& path : golden_files()) {
    const std::string text = content(path);
    const auto bytes = std::as_bytes(std::span(text));
    if (looks_like_archive(bytes)) continue;
    expect_as_the_reader(bytes, path.string());
    ++files;
  }
  EXPECT_GE(files, 100u);
}

TEST(Summary, ArchivesAndOtherFilesAreRefusedAsTheReaderDoes) {
  const Bytes text = [] {
    const std::string words = "no mesh at all, but long enough to be one, perhaps, or two of them";
    const auto bytes = std::as_bytes(std::span(words));
    return Bytes(bytes.begin(), bytes.end());
  }();
  Bytes newer = small_file();
  newer[8] = std::byte{9};
  for (const Bytes& bytes : {archive_file().bytes, text, newer}) {
    const auto summary = summary_of(bytes);
    const auto expected = summary_by_reader(bytes);
    ASSERT_FALSE(summary || expected);
    EXPECT_EQ(summary.error().message(), expected.error().message());
    EXPECT_EQ(summary.error().code, expected.error().code);
  }
}

// --- bytes read

TEST(Summary, ReadsNoValues) {
  Stepped stepped = waves(12);
  stepped.mesh.schema.arrays.push_back(array_of("noise", Location::cell, ScalarType::float64, 16));
  std::mt19937_64 random(5);
  stepped.mesh.arrays.emplace_back();
  for (std::size_t i = 0; i < 16 * stepped.mesh.cells.size(); ++i)
    append(stepped.mesh.arrays.back(), std::uint64_t{random()});
  stepped.options.group_cells = 300;
  const Bytes bytes = written(stepped);
  const FileParts parts = take_apart(bytes);
  std::size_t index_bytes = 0, schema_bytes = 0;
  for (const Chunk& chunk : parts.chunks) {
    if (chunk.is(ChunkKind::index)) index_bytes += chunk.payload.size();
    if (chunk.is(ChunkKind::schema)) schema_bytes += chunk.payload.size();
  }
  CountedSource source(bytes);
  ASSERT_TRUE(read_summary(source));
  // read_summary() reads each chunk header twice. For a group, it also reads the group header that
  // follows.
  EXPECT_LT(source.bytes, index_bytes + schema_bytes + 200 * parts.chunks.size());
  EXPECT_LT(source.bytes, bytes.size() / 10);
}

TEST(Summary, EveryFlippedBitThatIsReadIsFound) {
  const Bytes bytes = small_file();
  WatchedSource watched(bytes);
  const auto expected = read_summary(watched);
  ASSERT_TRUE(expected);
  std::mt19937 random(1);
  std::size_t unread = 0;
  for (std::size_t at = 0; at < bytes.size(); at += every(7)) {
    Bytes damaged = bytes;
    damaged[at] ^= std::byte{1} << random() % 8;
    const auto summary = summary_of(damaged);
    if (!summary) {
      EXPECT_TRUE(watched.touched[at]) << at;
      EXPECT_NE(summary.error().offset, kNoOffset) << summary.error().message();
      continue;
    }
    // read_summary() has not used the flipped bit: either it did not read the bit, or the bit is in
    // step values that it read together with the preceding header.
    expect_same(*summary, *expected, "byte " + std::to_string(at));
    ++unread;
  }
  EXPECT_GT(unread, bytes.size() / every(7) / 4);
}

// --- truncated files and files with missing chunks

TEST(Summary, EveryCutIsFound) {
  const Bytes bytes = small_file();
  for (std::size_t size = 0; size < bytes.size(); size += every(7)) {
    const auto summary = summary_of(std::span(bytes).first(size));
    ASSERT_FALSE(summary) << size;
    EXPECT_EQ(summary.error().code, ErrorCode::truncated) << summary.error().message();
    EXPECT_EQ(summary.error().offset, size) << summary.error().message();
  }
}

TEST(Summary, CutFilesAreWalkedByTheirHeadersAlone) {
  const Bytes bytes = small_file();
  const std::size_t chunks = take_apart(bytes).chunks.size();
  CountedSource source{std::span(bytes).first(bytes.size() - 1)};
  EXPECT_FALSE(read_summary(source));
  EXPECT_LE(source.bytes, container::kLongHeaderBytes * (chunks + 1));
}

TEST(Summary, BytesBehindATornAppendAreTold) {
  const Bytes bytes = small_file();
  for (const std::size_t torn : {1u, 15u, 16u, 40u, 5000u}) {
    Bytes more = bytes;
    for (std::size_t i = 0; i < torn; ++i) more.push_back(std::byte(i * 7 + 1));
    expect_as_the_reader(more, std::to_string(torn));
    EXPECT_EQ(summary_of(more)->totals.trailing_bytes, torn);
  }
}

TEST(Summary, ACutFileWithDamageIsNoWalk) {
  Bytes bytes = small_file();
  bytes.resize(bytes.size() - 1);
  const std::size_t second = container::kFileStartBytes + take_apart(bytes).chunks[0].bytes();
  bytes[second + 3] ^= std::byte{1};
  const auto summary = summary_of(bytes);
  ASSERT_FALSE(summary);
  EXPECT_EQ(summary.error().code, ErrorCode::corrupt);
  EXPECT_EQ(summary.error().offset, second);
}

// --- inconsistent files

TEST(Summary, TheIndexIsNotBelieved) {
  const Bytes bytes = small_file();
  ASSERT_TRUE(summary_of(with_index(bytes, [](container::Index&) {})));
  const auto refused = [&](const std::string& what,
                           const std::function<void(container::Index&)>& lie) {
    const auto summary =
        summary_of(with_old_index(bytes, lie));  // version 0 stores the most fields
    ASSERT_FALSE(summary) << what;
    EXPECT_NE(summary.error().offset, kNoOffset) << what;
    EXPECT_FALSE(summary.error().section.empty()) << what;
  };
  const auto of_entry = [&](const std::string& what, ChunkKind kind, std::size_t n,
                            const std::function<void(IndexEntry&)>& lie) {
    refused(what, [&](container::Index& index) { lie(entry_of(index, kind, n)); });
  };
  constexpr std::uint64_t kMuch = ~std::uint64_t{0};
  for (const ChunkKind kind : {ChunkKind::schema, ChunkKind::group, ChunkKind::step_values,
                               ChunkKind::step_times, ChunkKind::extra}) {
    const bool many = kind == ChunkKind::group || kind == ChunkKind::step_values;
    for (std::size_t n = 0; n < (many ? 3u : 1u); ++n) {
      of_entry("kind", kind, n, [](IndexEntry& e) { e.kind ^= 1; });
      of_entry("no kind", kind, n, [](IndexEntry& e) { e.kind = 77; });
      of_entry("offset", kind, n, [](IndexEntry& e) { e.offset += 1; });
      of_entry("far", kind, n, [](IndexEntry& e) { e.offset = kMuch - 5; });
      of_entry("bytes", kind, n, [](IndexEntry& e) { e.bytes -= 1; });
      of_entry("few", kind, n, [](IndexEntry& e) { e.bytes = 3; });
      of_entry("many", kind, n, [](IndexEntry& e) { e.bytes = kMuch; });
    }
  }
  for (const std::size_t n : {0u, 1u, 3u}) {
    const auto lies = [&](const std::string& what, const std::function<void(IndexEntry&)>& lie) {
      of_entry("group " + what, ChunkKind::group, n, lie);
    };
    lies("segment", [](IndexEntry& e) { e.segment += 1; });
    lies("cells", [](IndexEntry& e) { e.cells += 1; });
    lies("first cell", [](IndexEntry& e) { e.first_cell += 1; });
    lies("vertices", [](IndexEntry& e) { e.vertices -= 1; });
    lies("first vertex", [](IndexEntry& e) { e.first_vertex += 1; });
    lies("box", [](IndexEntry& e) { e.box[0] -= 1; });
    lies("header", [](IndexEntry& e) { e.header_bytes += 1; });
    lies("no header", [](IndexEntry& e) { e.header_bytes = 0; });
    lies("large header", [](IndexEntry& e) { e.header_bytes = kMuch; });
  }
  for (const std::size_t n : {0u, 1u, 9u}) {
    const auto lies = [&](const std::string& what, const std::function<void(IndexEntry&)>& lie) {
      of_entry("step " + what, ChunkKind::step_values, n, lie);
    };
    lies("array", [](IndexEntry& e) { e.parts[0].array ^= 1; });
    lies("no array", [](IndexEntry& e) { e.parts[0].array = ~0u; });
    lies("step", [](IndexEntry& e) { e.parts[0].step += 1; });
    lies("first", [](IndexEntry& e) { e.parts[0].first += 1; });
    lies("count", [](IndexEntry& e) { e.parts[0].count -= 1; });
    lies("group", [](IndexEntry& e) { e.parts[0].group += 1; });
    lies("codec", [](IndexEntry& e) { e.parts[0].codec = static_cast<container::Codec>(77); });
    lies("reference", [](IndexEntry& e) { e.parts[0].reference = static_cast<StepReference>(77); });
  }
  using Index = container::Index;
  refused("vertices", [](Index& index) { index.vertices += 1; });
  refused("cells", [](Index& index) { index.cells -= 1; });
  refused("hexahedra", [](Index& index) { index.hexahedra -= 1; });
  refused("active", [](Index& index) { index.max_active_vertices += 1; });
  refused("steps", [](Index& index) { index.steps += 1; });
  refused("segments", [](Index& index) { index.segments += 1; });
  refused("imported", [](Index& index) { index.imported_vertices += 1; });
  refused("previous", [](Index& index) { index.previous_index = 16; });
  refused("blocks", [](Index& index) { index.block_cells.push_back(0); });
  refused("no blocks", [](Index& index) { index.block_cells.clear(); });
  refused("of a block", [](Index& index) { index.block_cells[0] = kMuch; });
  refused("a stream's bytes", [](Index& index) { index.streams[0].bytes += 1; });
  refused("a stream's name", [](Index& index) { index.streams[0].name += "!"; });
  refused("a stream less", [](Index& index) { index.streams.pop_back(); });
  refused("order of streams", [](Index& index) { std::swap(index.streams[0], index.streams[1]); });
  refused("no entries", [](Index& index) { index.entries.clear(); });
  refused("an entry less", [](Index& index) { index.entries.pop_back(); });
  refused("an entry twice", [](Index& index) { index.entries.push_back(index.entries.back()); });
  refused("no schema", [](Index& index) { index.entries.erase(index.entries.begin()); });
}

/// Recomputes the offsets and sizes of all chunks in the index.
Bytes with_places(FileParts parts, const std::function<void(container::Index&)>& change) {
  return with_index(put_together(parts), [&](container::Index& index) {
    change(index);
    std::uint64_t at = container::kFileStartBytes;
    for (std::size_t c = 0; c < index.entries.size(); ++c) {
      index.entries[c].offset = at;
      index.entries[c].bytes = parts.chunks[c].bytes();
      at += index.entries[c].bytes;
    }
  });
}

TEST(Summary, HeadersThatLieAreFound) {
  // An index of version 0 stores the size of each stream in bytes.
  const Bytes bytes = with_old_index(small_file(), [](container::Index&) {});
  using container::GroupHeader;
  const auto code_with = [&](const std::function<void(GroupHeader&)>& lie) {
    FileParts parts = take_apart(bytes);
    Chunk* chunk = parts.find(ChunkKind::group, 1);
    auto group = take_group_apart(*chunk);
    lie(group->header);
    ByteWriter out;
    container::put(out, group->header);
    const std::size_t header_bytes = out.bytes.size();
    for (const auto& stream : group->streams) out.put_bytes(stream);
    chunk->payload = std::move(out.bytes);
    const auto summary = summary_of(with_places(std::move(parts), [&](container::Index& index) {
      entry_of(index, ChunkKind::group, 1).header_bytes = header_bytes;
    }));
    return summary ? std::optional<ErrorCode>() : summary.error().code;
  };
  EXPECT_EQ(code_with([](GroupHeader&) {}), std::nullopt);
  const auto refused = [&](const char* what, const std::function<void(GroupHeader&)>& lie,
                           ErrorCode code = ErrorCode::corrupt) {
    EXPECT_EQ(code_with(lie), code) << what;
  };
  refused("cells", [](GroupHeader& header) { header.cells += 1; });
  refused("vertices", [](GroupHeader& header) { header.vertices += 1; });
  refused("first cell", [](GroupHeader& header) { header.first_cell += 1; });
  refused("imported", [](GroupHeader& header) { header.imported_vertices += 1; });
  refused("active", [](GroupHeader& header) { header.max_active_vertices += 1000; });
  refused("stream", [](GroupHeader& header) { header.streams[1].bytes += 1; });
  refused("bytes of one for the other", [](GroupHeader& header) {
    header.streams[0].bytes += 1;
    header.streams[1].bytes -= 1;
  });
  refused("far", [](GroupHeader& header) { header.streams[0].bytes = ~std::uint64_t{0}; });
  refused("no connectivity", [](GroupHeader& header) { header.streams[0].kind = {}; });
  refused("twice", [](GroupHeader& header) { header.streams[1].kind = header.streams[0].kind; });
  refused("no array", [](GroupHeader& header) {
    header.streams.back().kind = container::StreamKind::array;
    header.streams.back().array = 1000;
  });
  refused(
      "codec",
      [](GroupHeader& header) { header.streams[0].codec = static_cast<container::Codec>(99); },
      ErrorCode::unsupported);
  refused("codec differs from that of earlier groups", [](GroupHeader& header) {
    const bool rows = header.streams[0].codec == container::Codec::rows;
    header.streams[0].codec = rows ? container::Codec::mixed : container::Codec::rows;
  });
}

/// The payload length in a chunk header is so large that the sum of header and payload wraps around
/// to the chunk length in the index. The reader must detect this.
TEST(Summary, LengthsDoNotWrap) {
  FileParts parts = take_apart(small_file());
  Chunk unknown;
  unknown.header.kind = 200;
  unknown.header.flags = container::kChunkOptional;
  unknown.header.is_long = true;
  parts.chunks.insert(parts.chunks.begin() + 1, unknown);
  Bytes bytes = with_places(parts, [](container::Index& index) {
    IndexEntry entry;
    entry.kind = 200;
    index.entries.insert(index.entries.begin() + 1, entry);
  });
  // Sets the payload length to 2^64 - 1 and reduces the chunk length in the index by one byte. In
  // 64-bit arithmetic, adding 2^64 - 1 is the same as subtracting 1, so the two lengths seem to
  // agree.
  parts = take_apart(bytes);
  const std::size_t at = container::kFileStartBytes + parts.chunks[0].bytes();
  parts.chunks[1].header.payload_bytes = ~std::uint64_t{0};
  ByteWriter header;
  container::put(header, parts.chunks[1].header);
  bytes = with_index(bytes, [](container::Index& index) {
    --index.entries[1].bytes;
    for (std::size_t c = 2; c < index.entries.size(); ++c) --index.entries[c].offset;
  });
  std::copy(header.bytes.begin(), header.bytes.end(),
            bytes.begin() + static_cast<std::ptrdiff_t>(at));
  EXPECT_FALSE(summary_of(bytes));
}

TEST(Summary, LongHeadersAreReadWhereShortOnesWouldDo) {
  for (const bool all : {true, false}) {
    FileParts parts = take_apart(small_file());
    for (std::size_t c = 0; c < parts.chunks.size(); ++c)
      parts.chunks[c].header.is_long = all || c % 2 == 1;
    const Bytes bytes = with_places(std::move(parts), [](container::Index&) {});
    expect_as_the_reader(bytes, all ? "all" : "every other");
    MemoryRandomSource source(bytes);
    auto extractor = MeshExtractor::open(source);
    ASSERT_TRUE(extractor) << extractor.error().message();
    ASSERT_TRUE(extractor->begin({.arrays = std::vector<std::uint32_t>()}));
    std::uint64_t cells = 0;
    while (true) {
      const auto block = extractor->next();
      ASSERT_TRUE(block) << block.error().message();
      if (*block == nullptr) break;
      cells += (*block)->cell_count();
    }
    EXPECT_EQ(cells, extractor->cells());
    const auto report = find_damage(source);
    ASSERT_TRUE(report);
    EXPECT_TRUE(report->complete && report->damages.empty());
    // A file without the end of its index is recovered. The new index has a short header.
    const Bytes cut(bytes.begin(), bytes.end() - container::kTrailerBytes);
    MemoryRandomSource of_cut(cut);
    const auto healed = find_damage(of_cut);
    ASSERT_TRUE(healed);
    EXPECT_TRUE(healed->lacks_index && healed->complete);
    MemorySink sink;
    ASSERT_TRUE(write_in_order(of_cut, sink));
    const std::size_t chunks = take_apart(bytes).last_offset();
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(chunks),
                           sink.bytes.begin()));
    MemoryRandomSource of_healed(sink.bytes);
    const auto totals = read_summary(of_healed);
    ASSERT_TRUE(totals);
    EXPECT_EQ(totals->totals.cells, extractor->cells());
  }
}

TEST(Summary, ChunksThatNobodyKnows) {
  for (const bool optional : {true, false}) {
    FileParts parts = take_apart(small_file());
    Chunk chunk;
    chunk.header.kind = 50;
    chunk.header.flags = optional ? container::kChunkOptional : 0;
    chunk.header.is_long = true;
    chunk.payload.resize(9);
    parts.chunks.insert(parts.chunks.begin() + 1, chunk);
    const Bytes bytes = with_places(std::move(parts), [](container::Index& index) {
      IndexEntry entry;
      entry.kind = 50;
      index.entries.insert(index.entries.begin() + 1, entry);
    });
    if (optional) {
      expect_as_the_reader(bytes, "optional");
    } else {
      ASSERT_FALSE(summary_of(bytes));
      EXPECT_EQ(summary_of(bytes).error().message(), summary_by_reader(bytes).error().message());
    }
  }
}

// For each segment, the summary states the codec of its cells. This must work even if the first
// group of the segment has no cells and therefore no such codec.
TEST(Summary, AGroupOfUnusedVerticesComesFirst) {
  const TestMesh mesh = with_order(grid(2, 2, 2), Order::stream, true, 0);
  MemorySink sink;
  WriteOptions options;
  options.connectivity = ConnectivityCodec::mixed;
  auto writer = Writer::create(sink, mesh.schema, options);
  ASSERT_TRUE(writer);
  constexpr std::uint64_t kFullGroup = 65536;
  const auto xyz = std::span(mesh.xyz);
  for (std::uint64_t v = mesh.vertices; v < mesh.vertices + kFullGroup; ++v) {
    ASSERT_TRUE(writer->add_unused_vertex(v, xyz.first(mesh.xyz.size() / mesh.vertices)));
  }
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    ASSERT_TRUE(writer->add_vertex(
        v, xyz.subspan(v * xyz.size() / mesh.vertices, xyz.size() / mesh.vertices)));
  for (const auto& cell : mesh.cells) ASSERT_TRUE(writer->add_cell(cell.block, cell.corners, 0));
  ASSERT_TRUE(writer->end_mesh());
  ASSERT_TRUE(writer->finish());
  EXPECT_NE(take_apart(sink.bytes).find(ChunkKind::group, 1), nullptr);
  expect_as_the_reader(sink.bytes, "unused vertices first");
  EXPECT_EQ(summary_of(sink.bytes)->totals.segment_connectivity,
            std::vector{ConnectivityCodec::mixed});
}

TEST(Summary, LiesOfAllKindsEndSomehow) {
  const Bytes bytes = small_file();
  std::mt19937_64 random(11);
  for (std::size_t i = 0; i < 400; i += every(4)) {
    // Changes a byte of a chunk and recomputes its checksums.
    FileParts parts = take_apart(bytes);
    Chunk& chunk = parts.chunks[random() % parts.chunks.size()];
    if (chunk.payload.empty()) continue;
    chunk.payload[random() % chunk.payload.size()] ^= std::byte{1} << random() % 8;
    if (chunk.is(ChunkKind::group))
      if (auto group = take_group_apart(chunk)) chunk.payload = put_group_together(*group);
    const Bytes inconsistent = put_together(std::move(parts));
    const auto summary = summary_of(inconsistent);
    if (!summary) continue;
    if (const auto expected = summary_by_reader(inconsistent))
      expect_same(*summary, *expected, "a lie");
  }
}

TEST(Summary, LimitsAreKept) {
  const Bytes bytes = small_file();
  const auto code = [&](const std::function<void(ReadLimits&)>& set) {
    ReadLimits limits;
    set(limits);
    const auto summary = summary_of(bytes, limits);
    return summary ? std::optional<ErrorCode>() : summary.error().code;
  };
  using enum ErrorCode;
  EXPECT_EQ(code([](ReadLimits& limits) { limits.max_segments = 1; }), corrupt);
  EXPECT_EQ(code([](ReadLimits& limits) { limits.max_steps = 3; }), over_limit);
  EXPECT_EQ(code([](ReadLimits& limits) { limits.max_extra_bytes = 3; }), over_limit);
  EXPECT_EQ(code([](ReadLimits& limits) { limits.max_chunk_bytes = 30; }), over_limit);
  EXPECT_EQ(code([](ReadLimits& limits) { limits.max_arrays = 1; }), over_limit);
  EXPECT_EQ(
      code([](ReadLimits& limits) { limits.max_active_vertices = limits.max_group_bytes = 1; }),
      std::nullopt);
}

TEST(Summary, ErrorsOfTheSourceArePassedOn) {
  class Broken final : public RandomSource {
   public:
    std::uint64_t size() const override { return 1000; }
    Result<void> read_at(std::uint64_t, std::span<std::byte>) override {
      return Error{ErrorCode::io, "broken", {}, kNoOffset, {}};
    }
  } broken;
  EXPECT_EQ(read_summary(broken).error().code, ErrorCode::io);
}

}  // namespace
}  // namespace shm
