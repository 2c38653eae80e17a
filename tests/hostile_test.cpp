// Damaged and lying files: every one is an error with a fitting code or decodes to the very same
// content; never other content, never a crash, never memory out of proportion.
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <limits>
#include <new>
#include <string>
#include <unordered_set>

#include "feature_files.h"
#include "file_surgery.h"
#include "item_text.h"
#include "packing.h"
#include "sanitized.h"
#include "schema_codec.h"

namespace {

// The largest single allocation since it was last set to zero.
std::size_t largest_allocation = 0;
// Bytes that are allocated, and the most that were since it was last set.
std::atomic<std::size_t> allocated = 0, most_allocated = 0;

}  // namespace

// Not inlined, or the compiler sees malloc and delete, and warns.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  largest_allocation = std::max(largest_allocation, bytes);
  void* memory = std::malloc(bytes > 0 ? bytes : 1);
  if (memory == nullptr) throw std::bad_alloc();
  const std::size_t now = allocated += ::malloc_usable_size(memory);
  if (now > most_allocated) most_allocated = now;
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  allocated -= ::malloc_usable_size(memory);
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  operator delete(memory);
}

namespace shm {
namespace {

using container::ChunkKind;
using Bytes = std::vector<std::byte>;

const std::vector<FeatureFile>& files() {
  static const std::vector<FeatureFile> all = feature_files();
  return all;
}
const Bytes& file(const std::string& name) {
  for (const FeatureFile& candidate : files())
    if (candidate.name == name) return candidate.bytes;
  ADD_FAILURE() << "no feature file " << name;
  return files().front().bytes;
}

std::string text_of(const Result<Decoded>& decoded) {
  return decoded ? ItemText::of(*decoded) : decoded.error().message();
}

/// The code of the error that decoding ends with; success is a failure of the test.
ErrorCode code_of(std::span<const std::byte> bytes, const ReadLimits& limits = {}) {
  const auto decoded = decode_in_pieces(bytes, 0, limits);
  EXPECT_FALSE(decoded) << "accepted:\n" << text_of(decoded);
  if (decoded) return {};
  EXPECT_FALSE(decoded.error().detail.empty());
  return decoded.error().code;
}

TEST(Hostile, WholeFilesAreReadInPiecesOfAnySize) {
  for (const FeatureFile& feature : files()) {
    SCOPED_TRACE(feature.name);
    const auto whole = decode_in_pieces(feature.bytes);
    ASSERT_TRUE(whole) << whole.error().message();
    const std::string text = ItemText::of(*whole);
    for (std::size_t piece : {1u, 7u, 33u, 1000u}) {
      const auto again = decode_in_pieces(feature.bytes, piece);
      ASSERT_TRUE(again) << again.error().message();
      EXPECT_EQ(ItemText::of(*again), text) << "in pieces of " << piece;
    }
  }
}

/// Files that are cut and flipped at every place; the others, for time's sake, here and there.
bool is_thorough(const FeatureFile& feature) {
  return feature.name == "one_hexahedron" || feature.name == "stream_turned" ||
         feature.name == "arrays_on_some_blocks" || feature.name == "steps_and_extras" ||
         feature.name == "shifts_quantized" || feature.name == "shifts_columns_quads";
}

/// Bytes from one place where a file is hurt to the next. What unpacks to much takes long.
std::size_t stride_of(const FeatureFile& feature, std::size_t usual) {
  const std::size_t stride = is_thorough(feature) ? 1 : feature.name == "large_extras" ? 97 : usual;
  return stride * every(7);
}

TEST(Hostile, EveryCutIsTruncated) {
  for (const FeatureFile& feature : files())
    for (std::size_t size = 0; size < feature.bytes.size(); size += stride_of(feature, 5)) {
      // An exact-size copy, so that a read past the end is seen.
      const Bytes cut(feature.bytes.begin(),
                      feature.bytes.begin() + static_cast<std::ptrdiff_t>(size));
      const auto decoded = decode_in_pieces(cut);
      ASSERT_FALSE(decoded) << feature.name << " cut to " << size;
      ASSERT_EQ(decoded.error().code, ErrorCode::truncated) << feature.name << " cut to " << size;
      ASSERT_EQ(decoded.error().offset, size) << feature.name;
    }
}

TEST(Hostile, EveryFlippedBitIsNoticed) {
  for (const FeatureFile& feature : files()) {
    const std::string text = text_of(decode_in_pieces(feature.bytes));
    Bytes bytes = feature.bytes;
    const bool thorough = is_thorough(feature);
    for (std::size_t at = 0; at < bytes.size(); at += stride_of(feature, 3))
      for (std::size_t bit = thorough ? 0 : at % 8; bit < 8; bit += thorough ? 1 : 8) {
        bytes[at] ^= std::byte{1} << bit;
        const auto decoded = decode_in_pieces(bytes);
        if (decoded) {
          ASSERT_EQ(ItemText::of(*decoded), text) << feature.name << " byte " << at;
        }
        bytes[at] ^= std::byte{1} << bit;
      }
  }
}

TEST(Hostile, TheFirstErrorSticks) {
  Bytes bytes = file("keep");
  bytes[100] ^= std::byte{1};
  Decoder decoder;
  ASSERT_TRUE(decoder.feed(bytes));
  Result<Decoder::Progress> progress = decoder.advance();
  while (progress && *progress == Decoder::Progress::item_ready) {
    decoder.take();
    progress = decoder.advance();
  }
  ASSERT_FALSE(progress);
  const std::string message = progress.error().message();
  EXPECT_EQ(decoder.advance().error().message(), message);
  EXPECT_EQ(decoder.feed(bytes).error().message(), message);
  EXPECT_EQ(decoder.advance().error().message(), message);
}

TEST(Hostile, BytesBehindTheEndAreReported) {
  for (std::size_t more : {1u, 15u, 1000u, 3u << 20}) {
    Bytes bytes = file("keep");
    bytes.resize(bytes.size() + more, std::byte{0x5a});
    for (std::size_t piece : {std::size_t{0}, std::size_t{10000}}) {
      const auto decoded = decode_in_pieces(bytes, piece);
      ASSERT_TRUE(decoded) << decoded.error().message();
      const Totals& totals = std::get<Totals>(decoded->items.back());
      EXPECT_EQ(totals.trailing_bytes, more);
      EXPECT_EQ(totals.total_bytes, file("keep").size());
    }
  }
}

TEST(Hostile, BytesBehindTheEndAreNotKept) {
  Decoder decoder;
  ASSERT_TRUE(decoder.feed(file("keep")));
  while (*decoder.advance() == Decoder::Progress::item_ready) decoder.take();
  const Bytes more(1 << 16);
  largest_allocation = 0;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(decoder.feed(more));
    ASSERT_EQ(*decoder.advance(), Decoder::Progress::need_input);
  }
  EXPECT_LE(largest_allocation, std::size_t{4} << 20);
}

TEST(Hostile, NoShmFileAtAll) {
  EXPECT_EQ(code_of({}), ErrorCode::truncated);
  Bytes bytes = file("keep");
  bytes[0] = std::byte{0x88};
  EXPECT_EQ(code_of(bytes), ErrorCode::corrupt);
  // What a transfer as text does: CR LF becomes LF.
  bytes = file("keep");
  bytes.erase(bytes.begin() + 4);
  EXPECT_EQ(code_of(bytes), ErrorCode::corrupt);
  EXPECT_EQ(code_of(Bytes(1000)), ErrorCode::corrupt);
}

TEST(Hostile, NewerVersionsAndFeaturesAreNamed) {
  for (auto change : {+[](container::FileStart& start) { start.major += 1; },
                      +[](container::FileStart& start) { start.minor += 1; },
                      +[](container::FileStart& start) { start.needed_features = 4; }}) {
    FileParts parts = take_apart(file("keep"));
    change(parts.start);
    EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported);
  }
  // The start of the file has no checksum; the schema chunk says it again.
  FileParts parts = take_apart(file("keep"));
  parts.chunks[0].payload[4] = std::byte{1};
  EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt);
}

// --- chunks

Chunk unknown_chunk(std::uint8_t flags) {
  Chunk chunk;
  chunk.header.kind = 77;
  chunk.header.flags = flags;
  chunk.payload.assign(10, std::byte{3});
  return chunk;
}

/// The index again, with as many lines as there are chunks before it.
void recount_index(FileParts& parts) {
  ByteReader in(parts.chunks.back().payload);
  container::Index index;
  ASSERT_TRUE(container::get(in, index, 1000));
  index.entries.resize(parts.chunks.size() - 1);
  ByteWriter out;
  container::put(out, index);
  parts.chunks.back().payload = std::move(out.bytes);
}

TEST(Hostile, UnknownChunksAreSkippedOrRefused) {
  const std::string text = text_of(decode_in_pieces(file("groups")));
  const std::size_t chunks = take_apart(file("groups")).chunks.size();
  for (std::size_t at = 1; at < chunks; ++at) {
    FileParts parts = take_apart(file("groups"));
    const auto place = parts.chunks.begin() + static_cast<std::ptrdiff_t>(at);
    parts.chunks.insert(place, unknown_chunk(container::kChunkOptional));
    recount_index(parts);
    EXPECT_EQ(text_of(decode_in_pieces(put_together(parts))), text);
    parts.chunks[at].header.flags = 0;
    EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported);
  }
  // A later version of a known kind is unknown too.
  FileParts parts = take_apart(file("groups"));
  parts.chunks[1].header.version = 1;
  EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported);
  parts.chunks[1].header.version = 0;
  parts.chunks[0].header.segment = 1;  // only groups have segments
  EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported);
  parts = take_apart(file("groups"));
  parts.chunks.back().header.segment = 1;
  EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported);
}

TEST(Hostile, SegmentNumbersThatJump) {
  for (const char* name : {"groups", "segments", "segments_stream", "shifts", "shifts_stream"}) {
    const FileParts whole = take_apart(file(name));
    for (std::size_t at = 1; at + 1 < whole.chunks.size(); ++at)
      for (const std::uint32_t segment : {0u, 1u, 2u, 3u, 4u, 5u, ~0u}) {
        FileParts parts = whole;
        if (parts.chunks[at].header.segment == segment) continue;
        parts.chunks[at].header.segment = segment;
        EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt)
            << name << ", chunk " << at << ", segment " << segment;
      }
  }
}

TEST(Hostile, ChunksMissingRepeatedOrSwapped) {
  for (const char* name : {"groups", "steps_and_extras"}) {
    SCOPED_TRACE(name);
    const FileParts whole = take_apart(file(name));
    for (const Numbering numbering : {Numbering::anew, Numbering::as_they_are})
      for (std::size_t at = 0; at < whole.chunks.size(); ++at) {
        const auto place = static_cast<std::ptrdiff_t>(at);
        FileParts parts = whole;
        parts.chunks.erase(parts.chunks.begin() + place);
        const ErrorCode missing = code_of(put_together(parts, numbering));
        EXPECT_TRUE(missing == ErrorCode::corrupt || missing == ErrorCode::truncated) << at;
        // The schema may be said twice, but every chunk counts in the index; behind the index
        // comes what is ignored.
        parts = whole;
        parts.chunks.insert(parts.chunks.begin() + place, whole.chunks[at]);
        EXPECT_EQ(code_of(put_together(parts, numbering)), ErrorCode::corrupt) << at;
        if (at == 0) continue;
        parts = whole;
        std::swap(parts.chunks[at], parts.chunks[at - 1]);
        // Only extras, times and steps may be numbered in another order.
        const auto movable = [](const Chunk& chunk) {
          return chunk.is(ChunkKind::extra) || chunk.is(ChunkKind::step_times) ||
                 chunk.is(ChunkKind::step_values);
        };
        const bool extra =
            whole.chunks[at].is(ChunkKind::extra) || whole.chunks[at - 1].is(ChunkKind::extra);
        const bool end = at == 1 || whole.chunks[at].is(ChunkKind::index);
        const bool may = numbering == Numbering::anew && !end &&
                         (extra || (movable(whole.chunks[at]) && movable(whole.chunks[at - 1])));
        if (!may) {
          EXPECT_FALSE(decode_in_pieces(put_together(parts, numbering))) << at;
        }
      }
  }
}

TEST(Hostile, AnotherSchemaInTheMiddle) {
  FileParts parts = take_apart(file("groups"));
  parts.chunks.insert(parts.chunks.begin() + 2, parts.chunks[0]);
  recount_index(parts);
  EXPECT_TRUE(decode_in_pieces(put_together(parts)));
  parts.chunks[2] = take_apart(file("mixed_cells")).chunks[0];
  EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt);
}

TEST(Hostile, GroupsBehindSteps) {
  FileParts parts = take_apart(file("steps_and_extras"));
  Chunk group = *parts.find(ChunkKind::group);
  parts.chunks.insert(parts.chunks.end() - 1, group);
  EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt);
}

// --- limits

TEST(Hostile, LimitsAreKept) {
  const auto expect_over = [](const char* name, const std::function<void(ReadLimits&)>& tighten) {
    ReadLimits limits;
    tighten(limits);
    const auto decoded = decode_in_pieces(file(name), 0, limits);
    ASSERT_FALSE(decoded) << name;
    EXPECT_EQ(decoded.error().code, ErrorCode::over_limit)
        << name << ": " << decoded.error().message();
  };
  expect_over("keep", [](ReadLimits& limits) { limits.max_active_vertices = 7; });
  expect_over("shifts", [](ReadLimits& limits) { limits.max_active_vertices = 7; });
  expect_over("shifts", [](ReadLimits& limits) { limits.max_group_bytes = 100; });
  expect_over("keep", [](ReadLimits& limits) { limits.max_chunk_bytes = 10; });
  expect_over("keep", [](ReadLimits& limits) { limits.max_group_bytes = 100; });
  expect_over("unmarked", [](ReadLimits& limits) { limits.max_group_bytes = 8 * 8 * 2 + 24 * 17; });
  expect_over("steps_and_extras", [](ReadLimits& limits) { limits.max_extra_bytes = 20; });
  expect_over("arrays", [](ReadLimits& limits) { limits.max_arrays = 19; });
  expect_over("arrays", [](ReadLimits& limits) { limits.max_static_components = 33; });
  expect_over("mixed_cells", [](ReadLimits& limits) { limits.max_blocks = 5; });
  expect_over("steps_and_extras", [](ReadLimits& limits) { limits.max_steps = 3; });
  expect_over("segments", [](ReadLimits& limits) { limits.max_segments = 2; });
}

/// A file of a start and chunks made of these payloads.
Bytes file_of(const std::vector<std::pair<ChunkKind, Bytes>>& chunks) {
  FileParts parts;
  for (const auto& [kind, payload] : chunks) {
    Chunk chunk;
    chunk.header.kind = static_cast<std::uint8_t>(kind);
    chunk.payload = payload;
    parts.chunks.push_back(std::move(chunk));
  }
  return put_together(parts);
}

TEST(Hostile, StatedSizesAllocateNothing) {
  constexpr std::size_t kSmall = 1 << 20;
  // Four gigabytes of payload, of which nothing is there.
  FileParts parts = take_apart(file("keep"));
  ByteWriter start;
  container::put(start, parts.start);
  container::ChunkHeader header;
  header.kind = static_cast<std::uint8_t>(ChunkKind::schema);
  header.payload_bytes = std::uint64_t{1} << 32;
  container::put(start, header);
  largest_allocation = 0;
  EXPECT_EQ(code_of(start.bytes), ErrorCode::over_limit);
  ReadLimits limits;
  limits.max_chunk_bytes = std::uint64_t{1} << 40;
  EXPECT_EQ(code_of(start.bytes, limits), ErrorCode::truncated);
  EXPECT_LE(largest_allocation, kSmall);

  // A schema that states to unpack to a gigabyte, raw and packed.
  for (const std::uint8_t method : {std::uint8_t{0}, std::uint8_t{1}}) {
    ByteWriter payload;
    payload.put_u16(container::kMajor);
    payload.put_u16(container::kMinor);
    payload.put_u32(0);
    payload.put_u8(method);
    payload.put_varint(std::uint64_t{1} << 30);
    payload.put_bytes(zstd_compress(Bytes(100), 1));
    largest_allocation = 0;
    EXPECT_EQ(code_of(file_of({{ChunkKind::schema, payload.bytes}})), ErrorCode::corrupt);
    EXPECT_LE(largest_allocation, kSmall);
  }

  // A group that states 2^20 cells and a gigabyte.
  parts = take_apart(file("keep"));
  auto group = take_group_apart(parts.chunks[1].payload);
  ASSERT_TRUE(group);
  group->header.cells = container::kMaxGroupCells;
  group->header.vertices = std::uint64_t{1} << 60;
  group->header.decoded_bytes = std::uint64_t{1} << 30;
  parts.chunks[1].payload = put_group_together(*group);
  largest_allocation = 0;
  EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt);
  EXPECT_LE(largest_allocation, std::size_t{32} << 20);
}

TEST(Hostile, LimitsOfTheSchemaComeBeforeItsMemory) {
  // A million blocks and a million arrays of no name pack to almost nothing.
  for (const bool arrays : {false, true}) {
    Schema schema;
    if (arrays)
      schema.arrays.resize(1000000);
    else
      schema.blocks.resize(1000000);
    const Bytes bytes = file_of({{ChunkKind::schema, schema_payload(schema)}});
    ReadLimits limits;
    limits.max_blocks = limits.max_arrays = 1000;
    largest_allocation = 0;
    EXPECT_EQ(code_of(bytes, limits), ErrorCode::over_limit);
    EXPECT_LE(largest_allocation, std::size_t{33} << 20) << (arrays ? "arrays" : "blocks");
  }
}

/// The most memory that `work` holds at once, in bytes.
std::size_t memory_of(const std::function<void()>& work) {
  const std::size_t before = allocated;
  most_allocated = before;
  work();
  return most_allocated - before;
}

/// Point arrays of so many components on a mesh.
TestMesh with_components(TestMesh mesh, std::uint32_t arrays, std::uint32_t components,
                         ScalarType type) {
  for (std::uint32_t a = 0; a < arrays; ++a)
    add_array(mesh, array_of("a" + std::to_string(a), Location::point, type, components),
              mesh.vertices);
  return mesh;
}
struct Components {
  std::uint32_t arrays, components;
  bool any_tables;  // whether columns of some of the arrays have tables
};
constexpr std::array<Components, 4> kManyComponents = {
    {{1, 4096, false}, {4096, 1, true}, {256, 16, true}, {64, 64, false}}};

// A component takes a few kilobytes, and tables are for few of them.
TEST(Hostile, ManyComponentsTakeLittleMemory) {
  constexpr std::size_t kPerComponent = 12 << 10, kTables = 32 << 20;
  for (const Components& many : kManyComponents)
    for (const Level level : {Level::fast, Level::standard, Level::best}) {
      if (kSanitized && level != Level::best) continue;
      SCOPED_TRACE(std::to_string(many.arrays) + " arrays, level " +
                   std::to_string(static_cast<int>(level)));
      const TestMesh mesh =
          with_components(grid(1, 1, 1), many.arrays, many.components, ScalarType::uint8);
      MemorySink sink;
      WriteOptions options;
      options.level = level;
      ASSERT_TRUE(write_mesh(mesh, sink, options));
      const std::size_t most =
          4096 * kPerComponent + (level == Level::best || many.any_tables ? kTables : 0);
      EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(sink.bytes)); }), most);

      FileParts parts = take_apart(sink.bytes);
      Bytes& payload = parts.find(ChunkKind::group)->payload;
      const auto group = take_group_apart(payload);
      ASSERT_TRUE(group);
      // Streams that are not there read as zeros: a file of a few bytes for each array.
      auto empty = *group;
      const auto first_array = static_cast<std::ptrdiff_t>(
          std::find_if(
              empty.header.streams.begin(), empty.header.streams.end(),
              [](const auto& entry) { return entry.kind == container::StreamKind::array; }) -
          empty.header.streams.begin());
      empty.header.streams.erase(empty.header.streams.begin() + first_array,
                                 empty.header.streams.end());
      empty.streams.erase(empty.streams.begin() + first_array, empty.streams.end());
      payload = put_group_together(empty);
      EXPECT_LE(memory_of([&] { (void)decode_in_pieces(put_together(parts)); }), most);

      // Mixed columns where there may be none.
      auto mixed = *group;
      mixed.header.streams.back().codec = container::Codec::mixed_columns;
      payload = put_group_together(mixed);
      EXPECT_LE(memory_of([&] { EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported); }),
                most + kTables);
    }
}

// Shifts remember values of a few components only; the others are under zstd alone.
TEST(Hostile, ManyComponentsOfShiftsTakeLittleMemory) {
  constexpr std::size_t kPerComponent = 4 << 10, kRings = 34 << 20;
  for (const Components& many : kManyComponents) {
    SCOPED_TRACE(many.arrays);
    const TestMesh mesh =
        with_components(bent_grid(2, 2, 2), many.arrays, many.components, ScalarType::float32);
    MemorySink sink;
    WriteOptions options;
    options.connectivity = ConnectivityCodec::shifts;
    options.segment_cells = 3;
    EXPECT_LE(memory_of([&] { EXPECT_TRUE(write_mesh(mesh, sink, options)); }),
              std::size_t{128} << 20);
    const Decoded whole = std::move(*decode_in_pieces(sink.bytes));
    const std::size_t most = kRings + 4096 * kPerComponent;
    EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(sink.bytes)); }), most);

    // Differences where there may be none.
    FileParts parts = take_apart(sink.bytes);
    Bytes& payload = parts.find(ChunkKind::group)->payload;
    auto group = take_group_apart(payload);
    ASSERT_TRUE(group);
    EXPECT_EQ(group->header.streams.back().codec, container::Codec::shuffled_zstd);
    group->header.streams.back().codec = container::Codec::differences;
    payload = put_group_together(*group);
    EXPECT_LE(memory_of([&] { EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported); }),
              most);
  }
}

// As many segments as there are cells hold what one holds.
TEST(Hostile, ManySegmentsOfShiftsTakeLittleMemory) {
  MemorySink sink;
  WriteOptions options;
  options.connectivity = ConnectivityCodec::shifts;
  options.segment_cells = 1;
  ASSERT_TRUE(write_mesh(bent_grid(6, 6, 6), sink, options));
  EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(sink.bytes)); }), std::size_t{8} << 20);
}

/// Which group is the first of the second segment.
std::size_t second_segment(const FileParts& parts) {
  std::size_t nth = 0;
  for (const Chunk& chunk : parts.chunks) {
    if (!chunk.is(ChunkKind::group)) continue;
    if (chunk.header.segment == 1) break;
    ++nth;
  }
  return nth;
}

/// The second segment's first group of the file "shifts" or its kin, changed.
Bytes shifts_with(const std::function<void(GroupParts&)>& change, const char* name = "shifts") {
  FileParts parts = take_apart(file(name));
  Chunk* chunk = parts.find(ChunkKind::group, second_segment(parts));
  auto group = take_group_apart(chunk->payload);
  EXPECT_TRUE(group);
  if (!group) return {};
  change(*group);
  chunk->payload = put_group_together(*group);
  return put_together(parts);
}

TEST(Hostile, StatedSizesOfShiftsAllocateNothing) {
  // A gigabyte of shifts or values, of which nothing is there.
  for (const std::size_t stream : {0u, 1u, 2u, 3u}) {
    const Bytes bytes = shifts_with([&](GroupParts& group) {
      group.header.decoded_bytes = std::uint64_t{1} << 30;
      group.header.cells = container::kMaxGroupCells;
      ASSERT_EQ(group.streams.size(), 4u);
      ByteWriter out;
      if (stream == 0) out.put_u8(0);
      out.put_varint(stream == 0 ? std::uint64_t{1} << 30 : std::uint64_t{1} << 26);
      if (stream > 0) {
        const int components = stream == 1 ? 3 : stream == 2 ? 2 : 1;
        out.put_u8(0);
        for (int c = 0; c < components; ++c) {
          out.put_u8(stream == 2 ? 5 : 0);  // integers, or any float
          out.put_signed(0);
          out.put_u8(stream == 2 ? 2 : 4);
        }
        group.header.streams[stream].codec = container::Codec::differences;
      }
      out.put_bytes(zstd_compress(Bytes(100), 1));
      group.streams[stream] = std::move(out.bytes);
    });
    largest_allocation = 0;
    EXPECT_EQ(code_of(bytes), ErrorCode::corrupt) << stream;
    EXPECT_LE(largest_allocation, std::size_t{4} << 20) << stream;
  }
}

TEST(Hostile, QuantizedComponentsShareTheirSchema) {
  TestMesh mesh = with_components(grid(1, 1, 1), 1, 4096, ScalarType::float32);
  Quantization& quantization = mesh.schema.arrays[0].quantization;
  quantization.bits = 16;
  quantization.minimum.assign(4096, 0.0);
  quantization.maximum.assign(4096, 1.0);
  const Bytes bytes = written(mesh);
  EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(bytes)); }), std::size_t{64} << 20);
}

// Of each component a Writer holds several copies while it tries, and tables of few: 1.3 MB of
// values in 4096 components do not take gigabytes.
TEST(Hostile, ManyComponentsAreWrittenInBoundedMemory) {
  for (const Components& many : kManyComponents) {
    SCOPED_TRACE(many.arrays);
    const TestMesh mesh =
        with_components(bent_grid(4, 3, 3), many.arrays, many.components, ScalarType::float32);
    WriteOptions options;
    options.level = Level::best;
    MemorySink sink;
    EXPECT_LE(memory_of([&] { EXPECT_TRUE(write_mesh(mesh, sink, options)); }),
              std::size_t{256} << 20);
  }
}

// --- lies behind good checksums

TEST(Hostile, LyingSchema) {
  const auto refused = [](const std::function<void(Schema&)>& lie,
                          ErrorCode code = ErrorCode::corrupt) {
    Schema schema = hexahedra_schema();
    schema.arrays.push_back(array_of("a", Location::cell, ScalarType::float32, 1, {0}));
    lie(schema);
    EXPECT_EQ(code_of(file_of({{ChunkKind::schema, schema_payload(schema)}})), code);
  };
  refused([](Schema&) {}, ErrorCode::truncated);  // no lie: nothing follows
  refused([](Schema& s) { s.order = static_cast<Order>(3); });
  refused([](Schema& s) { s.corner_order = false; });
  refused([](Schema& s) { s.coordinate_type = ScalarType::int32; });
  refused([](Schema& s) { s.coordinate_quantization = {8, {0, 0}, {1, 1}}; });
  refused([](Schema& s) { s.coordinate_quantization = {53, {0, 0, 0}, {1, 1, 1}}; });
  refused([](Schema& s) { s.coordinate_quantization = {8, {0, 0, 2}, {1, 1, 1}}; });
  for (const double lie : {0.0, -1e-6, 1e300, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    refused([&](Schema& s) { s.coordinate_quantization = Quantization::absolute(lie, 3); });
    refused([&](Schema& s) {
      s.coordinate_quantization = Quantization::absolute(1e-6, 3);
      s.coordinate_quantization.spacing = 2 * lie;
    });
  }
  refused([](Schema& s) { s.coordinate_quantization = Quantization::absolute(1e-6, 2); });
  refused([](Schema& s) {
    s.coordinate_quantization = Quantization::absolute(1e-6, 3);
    s.coordinate_quantization.minimum[2] = -std::numeric_limits<double>::infinity();
  });
  refused([](Schema& s) {
    s.arrays[0].type = ScalarType::int64;
    s.arrays[0].quantization = Quantization::absolute(1e-6, 1);
  });
  refused([](Schema& s) { s.blocks[0].shape = static_cast<CellShape>(11); });
  refused([](Schema& s) { s.blocks[0].nodes_per_cell = kMaxNodesPerCell + 1; });
  refused([](Schema& s) { s.arrays[0].type = static_cast<ScalarType>(0); });
  refused([](Schema& s) { s.arrays[0].type = static_cast<ScalarType>(11); });
  refused([](Schema& s) { s.arrays[0].location = static_cast<Location>(2); });
  refused([](Schema& s) { s.arrays[0].components = 0; });
  refused([](Schema& s) { s.arrays[0].components = 65536; });
  refused([](Schema& s) { s.arrays[0].blocks = {1}; });
  refused([](Schema& s) { s.arrays[0].blocks = {0, 0}; });
  refused(
      [](Schema& s) {
        s.arrays.assign(3, array_of("a", Location::point, ScalarType::int8, 65535));
      },
      ErrorCode::over_limit);
  // Every cut, and something behind: a byte that says nothing of references, or more than one.
  Schema schema = mixed_cells().schema;
  schema.arrays.push_back(array_of("a", Location::cell, ScalarType::float32, 1, {0}));
  ByteWriter blob;
  put(blob, schema);
  for (std::size_t size = 0; size <= blob.bytes.size() + 2; ++size) {
    Bytes cut = blob.bytes;
    cut.resize(size, std::byte{2});
    if (size > blob.bytes.size() + 1) cut[blob.bytes.size()] = std::byte{0};
    const bool whole = size == blob.bytes.size();
    EXPECT_EQ(code_of(file_of({{ChunkKind::schema, schema_payload(cut)}})),
              whole ? ErrorCode::truncated : ErrorCode::corrupt)
        << size;
  }
}

TEST(Hostile, LyingGroupHeader) {
  std::size_t nth = 0;
  const auto refused = [&](const char* name,
                           const std::function<void(container::GroupHeader&)>& lie,
                           ErrorCode code = ErrorCode::corrupt) {
    FileParts parts = take_apart(file(name));
    Chunk* chunk = parts.find(ChunkKind::group, nth);
    auto group = take_group_apart(chunk->payload);
    ASSERT_TRUE(group);
    lie(group->header);
    ByteWriter out;
    container::put(out, group->header);
    for (const auto& stream : group->streams) out.put_bytes(stream);
    chunk->payload = std::move(out.bytes);
    EXPECT_EQ(code_of(put_together(parts)), code);
  };
  using Header = container::GroupHeader;
  for (const char* name : {"keep", "groups", "mixed_cells", "arrays", "segments", "segments_stream",
                           "shifts", "shifts_stream"}) {
    SCOPED_TRACE(name);
    const bool shifts = std::string(name).starts_with("shifts");
    // The first of the second segment.
    const bool segments = shifts || std::string(name).starts_with("segments");
    nth = segments ? second_segment(take_apart(file(name))) : 0;
    refused(name, [](Header& h) { h.imported_vertices += 1; });
    refused(name, [](Header& h) { h.imported_vertices -= 1; });
    refused(name, [](Header& h) { h.imported_vertices = ~std::uint64_t{0}; });
    refused(name, [](Header& h) { h.first_cell += 1; });
    refused(name, [](Header& h) { h.first_vertex += 1; });
    refused(name, [](Header& h) { h.cells += 1; });
    refused(name, [](Header& h) { h.cells -= 1; });
    refused(name, [](Header& h) { h.cells = 0; });
    refused(name, [](Header& h) { h.cells = container::kMaxGroupCells + 1; });
    refused(name, [](Header& h) { h.vertices += 1; });
    refused(name, [](Header& h) { h.vertices -= 1; });
    refused(name, [](Header& h) { h.loose_vertices = h.vertices + 1; });
    refused(name, [](Header& h) { h.max_active_vertices += 1; });
    refused(name, [](Header& h) { h.max_active_vertices -= 1; });
    refused(name, [](Header& h) { h.max_active_vertices = 0; });
    refused(
        name, [](Header& h) { h.max_active_vertices = std::uint64_t{1} << 28; },
        ErrorCode::over_limit);
    refused(name, [](Header& h) { h.decoded_bytes += 1; });
    refused(name, [](Header& h) { h.decoded_bytes -= 1; });
    refused(name, [](Header& h) { h.decoded_bytes = 0; });
    refused(
        name, [](Header& h) { h.decoded_bytes = std::uint64_t{1} << 31; }, ErrorCode::over_limit);
    refused(name, [](Header& h) { h.streams[0].bytes += 1; });
    refused(name, [](Header& h) { h.streams[0].bytes = ~std::uint64_t{0}; });
    refused(name, [](Header& h) { h.streams.back().bytes -= 1; });
    refused(name, [](Header& h) { h.streams.back().bytes = 0; });
    refused(name, [](Header& h) { h.streams.back().checksum ^= 1; });
    refused(name, [](Header& h) { h.streams.pop_back(); });
    refused(name, [](Header& h) { h.streams.push_back(h.streams.back()); });
    // Where no connectivity says that cells are shifts, their values are in no known codec.
    refused(
        name,
        [](Header& h) {
          std::swap(h.streams[0].kind, h.streams[1].kind);
          std::swap(h.streams[0].codec, h.streams[1].codec);
        },
        std::string(name) == "shifts" ? ErrorCode::unsupported : ErrorCode::corrupt);
    refused(name, [](Header& h) { h.streams[0].kind = static_cast<container::StreamKind>(0); });
    refused(name, [](Header& h) { h.streams[0].kind = static_cast<container::StreamKind>(8); });
    refused(name, [](Header& h) {
      h.streams.back().kind = container::StreamKind::array;
      h.streams.back().array = 1000;
    });
    refused(
        name, [](Header& h) { h.streams[0].codec = static_cast<container::Codec>(99); },
        ErrorCode::unsupported);
    refused(
        name, [](Header& h) { h.streams.back().codec = container::Codec::paper; },
        ErrorCode::unsupported);
  }
  nth = 0;
  refused("keep", [](Header& h) {  // no segment before has anything to import
    h.streams.back().kind = container::StreamKind::imports;
  });
  refused("unmarked", [](Header& h) { h.loose_vertices += 1; });
  refused("unmarked", [](Header& h) { h.loose_vertices -= 1; });
}

/// What a group of shifts says, before zstd.
struct ShiftWords {
  Bytes words, symbols;
};
ShiftWords words_of(const GroupParts& group) {
  ByteReader in(group.streams[0]);
  (void)in.get_u8();  // what is remembered
  const std::uint64_t words = in.get_varint();
  const auto all = zstd_decompress(in.get_bytes(in.left()), words + group.header.cells);
  EXPECT_TRUE(all.has_value());
  if (!all) return {};
  const auto middle = all->begin() + static_cast<std::ptrdiff_t>(words);
  return {Bytes(all->begin(), middle), Bytes(middle, all->end())};
}
Bytes bytes_of(const ShiftWords& said, std::uint8_t ring_bits = 0) {
  ByteWriter out, all;
  out.put_u8(ring_bits);
  out.put_varint(said.words.size());
  all.put_bytes(said.words);
  all.put_bytes(said.symbols);
  out.put_bytes(zstd_compress(all.bytes, 1));
  return std::move(out.bytes);
}

// Every vertex is born once, alive where it is used, and imported where an earlier segment has it.
void expect_shifts_refuse_lies(const char* name) {
  SCOPED_TRACE(name);
  EXPECT_EQ(text_of(decode_in_pieces(shifts_with([](GroupParts&) {}, name))),
            text_of(decode_in_pieces(file(name))));
  using Shift = std::vector<std::uint64_t>;  // block, nodes, births, imports, last uses
  const auto with_first = [&](const std::function<void(Shift&)>& lie) {
    return shifts_with(
        [&](GroupParts& group) {
          ShiftWords said = words_of(group);
          ByteReader in(said.words);
          Shift first;
          for (int i = 0; i < 12; ++i) first.push_back(in.get_varint());
          lie(first);
          ByteWriter out;
          for (const std::uint64_t it : first) out.put_varint(it);
          out.put_bytes(in.get_bytes(in.left()));
          said.words = std::move(out.bytes);
          group.streams[0] = bytes_of(said);
        },
        name);
  };
  EXPECT_TRUE(decode_in_pieces(with_first([](Shift&) {})));
  constexpr std::size_t kBirths = 9, kImports = 10, kLastUse = 11;
  const std::vector<std::function<void(Shift&)>> lies = {
      [](Shift& s) { s[0] = 1; },                               // no such block
      [](Shift& s) { s[1] += 2; },                              // another vertex
      [](Shift& s) { s[1] = s[2]; },                            // born twice
      [](Shift& s) { s[1] = 1 << 20; },                         // imported from nowhere
      [](Shift& s) { s[1] = ~std::uint64_t{1}; },               // the same
      [](Shift& s) { s[kBirths] &= s[kBirths] - 1; },           // used, not born
      [](Shift& s) { s[kBirths] = s[kImports] = 0; },           // none is
      [](Shift& s) { s[kImports] &= s[kImports] - 1; },         // an earlier segment's, born here
      [](Shift& s) { s[kImports] = 0; },                        // all of them
      [](Shift& s) { s[kImports] = 0xff; },                     // an own one, imported
      [](Shift& s) { s[kLastUse] = 0xff; },                     // used later
      [](Shift& s) { s[kBirths] |= 0x100; },                    // a node that is not there
      [](Shift& s) { s[kLastUse] |= std::uint64_t{1} << 63; },  // again
  };
  for (std::size_t i = 0; i < lies.size(); ++i)
    EXPECT_EQ(code_of(with_first(lies[i])), ErrorCode::corrupt) << "lie " << i;

  const auto with_symbols = [&](const std::function<void(Bytes&)>& lie) {
    return shifts_with(
        [&](GroupParts& group) {
          ShiftWords said = words_of(group);
          lie(said.symbols);
          group.streams[0] = bytes_of(said);
        },
        name);
  };
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) { s[0] = std::byte{0}; })), ErrorCode::corrupt);
  // One more new shift than is said.
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) {
              const auto old =
                  std::find_if(s.begin(), s.end(), [](std::byte b) { return b != std::byte{255}; });
              ASSERT_NE(old, s.end());
              *old = std::byte{255};
            })),
            ErrorCode::corrupt);
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) { s.back() = std::byte{254}; })), ErrorCode::corrupt);
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) { s.pop_back(); })), ErrorCode::corrupt);
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) { s.push_back(s.back()); })), ErrorCode::corrupt);
}
TEST(Hostile, LyingShifts) { expect_shifts_refuse_lies("shifts"); }
TEST(Hostile, LyingShiftsOfOrderStream) { expect_shifts_refuse_lies("shifts_stream"); }

// Where vertices are numbered by birth, each is born with the next number, and no other.
TEST(Hostile, ShiftsThatLeaveNumbersOut) {
  TestMesh mesh = with_order(grid(1, 1, 1), Order::stream, false, 0);
  const Bytes good = written(mesh, 65536, ConnectivityCodec::shifts, Level::fast);
  const auto with_numbers = [&](const std::vector<std::uint64_t>& numbers, std::uint64_t imports) {
    FileParts parts = take_apart(good);
    Chunk* chunk = parts.find(ChunkKind::group, 0);
    auto group = take_group_apart(chunk->payload);
    ByteWriter words;
    words.put_varint(0);
    for (const std::uint64_t number : numbers) words.put_signed(static_cast<std::int64_t>(number));
    words.put_varint(0xff);
    if (imports > 0) words.put_varint(imports);
    words.put_varint(0xff);
    group->streams[0] = bytes_of({std::move(words.bytes), {std::byte{255}}});
    chunk->payload = put_group_together(*group);
    return put_together(parts);
  };
  const std::uint64_t import = std::uint64_t{1} << 63;
  EXPECT_EQ(with_numbers({0, 1, 2, 3, 4, 5, 6, 7}, 0), good);
  using Numbers = std::vector<std::uint64_t>;
  for (const Numbers& numbers :
       {Numbers{1, 2, 3, 4, 5, 6, 7, 8}, Numbers{0, 1, 2, 3, 4, 5, 6, 8},
        Numbers{0, 1, 2, 3, 4, 5, 7, 6}, Numbers{0, 1, 2, 3, 4, 5, 6, 6},
        Numbers{import, 1, 2, 3, 4, 5, 6, 7}, Numbers{0, 1, 2, 3, 4, 5, 6, import},
        Numbers{0, 1, 2, 3, 4, 5, 6, ~std::uint64_t{0}}})
    EXPECT_EQ(code_of(with_numbers(numbers, 0)), ErrorCode::corrupt);
  // The first segment has nothing to import.
  EXPECT_EQ(code_of(with_numbers({0, 1, 2, 3, 4, 5, 6, import}, 0x80)), ErrorCode::corrupt);
}

// The stream numbers of imported vertices.
TEST(Hostile, LyingNumbersOfImportsOfShifts) {
  const auto code_with = [](const std::function<void(GroupParts&)>& change) {
    return code_of(shifts_with(change, "shifts_stream"));
  };
  const auto is_there = [](GroupParts& group) {
    ASSERT_EQ(group.header.streams[1].kind, container::StreamKind::vertex_numbers);
  };
  EXPECT_EQ(code_with([&](GroupParts& group) {  // the same one again and again
              is_there(group);
              group.streams.erase(group.streams.begin() + 1);
              group.header.streams.erase(group.header.streams.begin() + 1);
            }),
            ErrorCode::corrupt);
  for (std::size_t byte = 0; byte < 256; ++byte) {  // others, own ones, none
    const auto code = code_with([&](GroupParts& group) {
      is_there(group);
      group.streams[1] = Bytes(20, static_cast<std::byte>(byte));
    });
    EXPECT_EQ(code, ErrorCode::corrupt) << byte;
  }
  EXPECT_EQ(code_with([&](GroupParts& group) {
              is_there(group);
              group.header.streams[1].codec = container::Codec::shifts;
            }),
            ErrorCode::unsupported);
  // In the first segment, which has no imports, and in order keep.
  for (const char* name : {"shifts_stream", "shifts"}) {
    FileParts parts = take_apart(file(name));
    for (const std::size_t nth : {0u, 2u}) {
      if (nth == 2 && std::string(name) == "shifts_stream") continue;
      FileParts changed = parts;
      Chunk* chunk = changed.find(ChunkKind::group, nth);
      auto group = take_group_apart(chunk->payload);
      ASSERT_TRUE(group);
      container::StreamEntry entry;
      entry.kind = container::StreamKind::vertex_numbers;
      entry.codec = container::Codec::predictive;
      group->header.streams.insert(group->header.streams.begin() + 1, entry);
      group->streams.insert(group->streams.begin() + 1, Bytes(3));
      chunk->payload = put_group_together(*group);
      EXPECT_EQ(code_of(put_together(changed)), ErrorCode::corrupt) << name << nth;
    }
  }
}

/// The nth group of the file "shifts_columns", its ring of another size.
Bytes with_ring(std::size_t nth, int ring_bits) {
  FileParts parts = take_apart(file("shifts_columns"));
  Chunk* chunk = parts.find(ChunkKind::group, nth);
  auto group = take_group_apart(chunk->payload);
  EXPECT_TRUE(group);
  if (!group) return {};
  group->streams[0][0] = static_cast<std::byte>(ring_bits);
  chunk->payload = put_group_together(*group);
  return put_together(parts);
}

TEST(Hostile, RingsOfShiftsAreNoLargerThanTheirGroups) {
  const int ring = std::to_integer<int>(
      take_group_apart(take_apart(file("shifts_columns")).find(ChunkKind::group)->payload)
          ->streams[0][0]);
  ASSERT_EQ(ring, 5);  // of twelve cells: 48 places at most
  EXPECT_EQ(text_of(decode_in_pieces(with_ring(0, ring))),
            text_of(decode_in_pieces(file("shifts_columns"))));
  for (const std::size_t nth : {0u, 1u}) {
    for (const int bits : {ring + 1, 19, 20, 63, 64, 255}) {
      largest_allocation = 0;
      EXPECT_EQ(code_of(with_ring(nth, bits)), ErrorCode::corrupt) << bits;
      EXPECT_LE(largest_allocation, std::size_t{1} << 20) << bits;
    }
    // Values are in columns that have no neighbourhoods.
    EXPECT_EQ(code_of(with_ring(nth, 0)), ErrorCode::unsupported);
    // A smaller one is as good as any; what comes out is something else, or makes no sense.
    for (int bits = 1; bits < ring; ++bits) (void)decode_in_pieces(with_ring(nth, bits));
  }
}

// What columns keep by number is bounded by places, and these by cells.
TEST(Hostile, ColumnsOverShiftsTakeLittleMemory) {
  const Bytes bytes = written(with_components(bent_grid(2, 2, 2), 1, 28, ScalarType::float32),
                              65536, ConnectivityCodec::shifts);
  EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(bytes)); }), std::size_t{16} << 20);
}

TEST(Hostile, StreamsOfShiftsMissingRepeatedOrSwapped) {
  const std::size_t streams = 4;
  for (std::size_t at = 0; at < streams; ++at) {
    const auto place = static_cast<std::ptrdiff_t>(at);
    const auto refused = [&](const std::function<void(GroupParts&)>& lie) {
      EXPECT_FALSE(decode_in_pieces(shifts_with(lie))) << at;
    };
    refused([&](GroupParts& group) {
      ASSERT_EQ(group.streams.size(), streams);
      group.streams.erase(group.streams.begin() + place);
      group.header.streams.erase(group.header.streams.begin() + place);
    });
    refused([&](GroupParts& group) {
      group.streams.insert(group.streams.begin() + place, group.streams[at]);
      group.header.streams.insert(group.header.streams.begin() + place, group.header.streams[at]);
    });
    if (at > 0) {
      refused([&](GroupParts& group) {
        std::swap(group.streams[at], group.streams[at - 1]);
        std::swap(group.header.streams[at], group.header.streams[at - 1]);
      });
    }
    for (const auto codec : {container::Codec::predictive, container::Codec::paper,
                             container::Codec::mixed_columns, container::Codec::shifts,
                             container::Codec::differences, static_cast<container::Codec>(99)})
      refused([&](GroupParts& group) {
        auto& is = group.header.streams[at].codec;
        is = is == codec ? static_cast<container::Codec>(98) : codec;
      });
  }
  // Shifts behind another codec of the same segment, and the other way round.
  for (const auto codec : {container::Codec::predictive, container::Codec::paper}) {
    FileParts parts = take_apart(file("shifts"));
    for (const std::size_t nth : {0u, 1u}) {
      FileParts changed = parts;
      Chunk* chunk = changed.find(ChunkKind::group, nth);
      auto group = take_group_apart(chunk->payload);
      ASSERT_TRUE(group);
      group->header.streams[0].codec = codec;
      chunk->payload = put_group_together(*group);
      EXPECT_FALSE(decode_in_pieces(put_together(changed))) << nth;
    }
  }
}

// Shifts in files whose schema does not take them.
TEST(Hostile, ShiftsOfAnotherSchema) {
  const auto code_with = [](const std::function<void(Schema&)>& change) {
    TestMesh mesh = bent_grid(3, 2, 2);
    const Bytes good = written(mesh, 65536, ConnectivityCodec::shifts);
    change(mesh.schema);
    FileParts parts = take_apart(good);
    parts.chunks[0].payload = schema_payload(mesh.schema);
    return code_of(put_together(parts));
  };
  EXPECT_EQ(code_with([](Schema& s) { s.order = Order::stream; }), ErrorCode::corrupt);
  EXPECT_EQ(code_with([](Schema& s) { s.order = Order::free; }), ErrorCode::corrupt);
  EXPECT_EQ(code_with([](Schema& s) { s.delay = 5; }), ErrorCode::unsupported);
  EXPECT_EQ(code_with([](Schema& s) { s.blocks[0].nodes_per_cell = 0; }), ErrorCode::unsupported);
  EXPECT_EQ(code_with([](Schema& s) { s.blocks[0].nodes_per_cell = 65; }), ErrorCode::unsupported);
  EXPECT_EQ(code_with([](Schema& s) {
              s.arrays.push_back(array_of("a", Location::cell, ScalarType::int8, 33));
              s.arrays[0].per_step = true;
            }),
            ErrorCode::unsupported);
  EXPECT_EQ(code_with([](Schema& s) { s.blocks[0].nodes_per_cell = 7; }), ErrorCode::corrupt);
  EXPECT_EQ(code_with([](Schema& s) { s.coordinate_type = ScalarType::float64; }),
            ErrorCode::corrupt);
}

TEST(Hostile, ImportsOfVerticesThatAreNotThere) {
  for (const char* name : {"segments", "segments_stream"})
    for (const auto kind :
         {container::StreamKind::imports, container::StreamKind::vertex_numbers}) {
      // A stream that is left out reads as zeros: all are imported, or the same one again and
      // again.
      FileParts parts = take_apart(file(name));
      Chunk* chunk = parts.find(ChunkKind::group, 2);
      auto group = take_group_apart(chunk->payload);
      ASSERT_TRUE(group);
      auto& entries = group->header.streams;
      const auto at = std::find_if(entries.begin(), entries.end(),
                                   [&](const auto& entry) { return entry.kind == kind; });
      ASSERT_NE(at, entries.end());
      group->streams.erase(group->streams.begin() + (at - entries.begin()));
      entries.erase(at);
      chunk->payload = put_group_together(*group);
      EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt) << name;
    }
}

TEST(Hostile, EndlessLooseVertices) {
  // No stream is needed for vertices that are all zero: what is stated must fit what is promised.
  FileParts parts = take_apart(file("no_cells"));
  container::GroupHeader header;
  header.vertices = header.loose_vertices = std::uint64_t{1} << 40;
  header.max_active_vertices = 1;
  header.decoded_bytes = 12;
  ByteWriter payload;
  container::put(payload, header);
  Chunk group;
  group.header.kind = static_cast<std::uint8_t>(ChunkKind::group);
  group.payload = std::move(payload.bytes);
  parts.chunks.insert(parts.chunks.begin() + 1, group);
  const Bytes bytes = put_together(parts);
  Decoder decoder;
  ASSERT_TRUE(decoder.feed(bytes));
  for (int blocks = 0; blocks < 20; ++blocks) {
    const auto progress = decoder.advance();
    if (!progress) {
      EXPECT_EQ(progress.error().code, ErrorCode::corrupt);
      return;
    }
    ASSERT_EQ(*progress, Decoder::Progress::item_ready);
    decoder.take();
  }
  FAIL() << "20 blocks came out of a group of no bytes";
}

TEST(Hostile, LyingIndex) {
  const auto decode_with = [](const std::function<void(container::Index&)>& lie) {
    FileParts parts = take_apart(file("steps_and_extras"));
    ByteReader in(parts.chunks.back().payload);
    container::Index index;
    EXPECT_TRUE(container::get(in, index, 1000));
    lie(index);
    ByteWriter out;
    container::put(out, index);
    parts.chunks.back().payload = std::move(out.bytes);
    return put_together(parts);
  };
  using container::Index;
  EXPECT_TRUE(decode_in_pieces(decode_with([](Index&) {})));
  const std::vector<std::function<void(Index&)>> lies = {
      [](Index& i) { i.previous_index = 16; },
      [](Index& i) { ++i.vertices; },
      [](Index& i) { ++i.cells; },
      [](Index& i) { ++i.hexahedra; },
      [](Index& i) { ++i.max_active_vertices; },
      [](Index& i) { ++i.steps; },
      [](Index& i) { i.block_cells.push_back(0); },
      [](Index& i) { i.block_cells.clear(); },
      [](Index& i) { ++i.block_cells[0]; },
      [](Index& i) { ++i.streams[0].bytes; },
      [](Index& i) { i.streams[0].name += 'x'; },
      [](Index& i) { i.streams.pop_back(); },
      [](Index& i) {
        i.streams.push_back({"more", 1});
      },
      [](Index& i) { i.entries.pop_back(); },
      [](Index& i) { i.entries.push_back(i.entries.back()); },
      [](Index& i) { i.entries.resize(100000); },
  };
  for (std::size_t i = 0; i < lies.size(); ++i)
    EXPECT_EQ(code_of(decode_with(lies[i])), ErrorCode::corrupt) << "lie " << i;
}

TEST(Hostile, LyingTrailer) {
  Bytes bytes = file("keep");
  ByteWriter trailer;
  container::put_trailer(trailer, 16);
  std::copy(trailer.bytes.begin(), trailer.bytes.end(), bytes.end() - container::kTrailerBytes);
  EXPECT_EQ(code_of(bytes), ErrorCode::corrupt);
}

TEST(Hostile, LyingStepHeader) {
  const auto refused = [](const std::function<void(container::StepHeader&)>& lie,
                          ErrorCode code = ErrorCode::corrupt) {
    FileParts parts = take_apart(file("steps_and_extras"));
    Chunk* chunk = parts.find(ChunkKind::step_values);
    ByteReader in(chunk->payload);
    container::StepHeader header;
    ASSERT_TRUE(container::get(in, header));
    const auto values = in.get_bytes(in.left());
    lie(header);
    ByteWriter out;
    container::put(out, header);
    out.put_bytes(values);
    chunk->payload = std::move(out.bytes);
    EXPECT_EQ(code_of(put_together(parts)), code);
  };
  using container::StepHeader;
  refused([](StepHeader& h) { h.array = 3; });
  refused([](StepHeader& h) { h.array = ~0u; });
  refused([](StepHeader& h) { h.count = 0; });
  refused([](StepHeader& h) { h.count += 1; });
  refused([](StepHeader& h) { h.count = ~std::uint64_t{0}; });
  refused([](StepHeader& h) { h.group = 1; });
  refused([](StepHeader& h) { h.group = ~0u; });
  refused([](StepHeader& h) { h.step = h.reference_step = std::uint64_t{1} << 40; });
  refused([](StepHeader& h) { h.step = h.reference_step = 1 << 21; }, ErrorCode::over_limit);
  refused([](StepHeader& h) { h.reference_step += 1; });
  refused([](StepHeader& h) { h.codec = static_cast<container::Codec>(3); });
  refused([](StepHeader& h) { h.codec = container::Codec::predictive; });
}

TEST(Hostile, LyingExtra) {
  const auto refused = [](const Bytes& blob) {
    ByteWriter payload;
    put_packed(payload, blob);
    FileParts parts = take_apart(file("keep"));
    Chunk chunk;
    chunk.header.kind = static_cast<std::uint8_t>(ChunkKind::extra);
    chunk.payload = std::move(payload.bytes);
    parts.chunks.insert(parts.chunks.begin() + 1, chunk);
    recount_index(parts);
    EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt);
  };
  const auto blob_of = [](int type, int refers, const std::vector<std::uint64_t>& shape,
                          std::size_t data) {
    ByteWriter out;
    out.put_text("key");
    out.put_u8(static_cast<std::uint8_t>(type));
    out.put_u8(static_cast<std::uint8_t>(refers));
    out.put_varint(shape.size());
    for (std::uint64_t side : shape) out.put_varint(side);
    out.put_bytes(Bytes(data));
    return std::move(out.bytes);
  };
  refused({});
  refused(blob_of(0, 0, {4}, 4));
  refused(blob_of(11, 0, {4}, 4));
  refused(blob_of(2, 3, {4}, 4));
  refused(blob_of(2, 1, {4}, 4));  // references are int32 or int64
  refused(blob_of(2, 0, {4}, 5));
  refused(blob_of(2, 0, {5}, 4));
  refused(blob_of(8, 0, {1}, 7));
  constexpr std::uint64_t kHuge = std::uint64_t{1} << 32;
  refused(blob_of(2, 0, {kHuge, kHuge}, 0));  // the product wraps to nothing
  refused(blob_of(8, 0, {std::uint64_t{1} << 61}, 0));
  refused(blob_of(2, 0, {~std::uint64_t{0}, 3}, 4));
  Bytes long_shape = blob_of(2, 0, {}, 0);
  long_shape.back() = std::byte{0x7f};  // 127 sides, none there
  refused(long_shape);
}

// Damage inside the bitstreams, behind right checksums: nothing can be promised of the content, but
// every value that comes out must be one that a caller may use without asking.
TEST(Hostile, DamagedBitstreams) {
  PlainRandom random(7);
  ReadLimits limits;
  limits.max_active_vertices = 1 << 16;
  for (const FeatureFile& feature : files()) {
    const FileParts whole = take_apart(feature.bytes);
    for (int n = 0; n < 60; ++n) {
      FileParts parts = whole;
      for (Chunk& chunk : parts.chunks) {
        if (!chunk.is(ChunkKind::group) && !chunk.is(ChunkKind::step_values)) continue;
        auto group = chunk.is(ChunkKind::group) ? take_group_apart(chunk.payload) : std::nullopt;
        if (group && !group->streams.empty()) {
          auto& stream = group->streams[random.below(group->streams.size())];
          for (std::uint64_t flips = random.below(4) + 1; flips > 0 && !stream.empty(); --flips)
            stream[random.below(stream.size())] = static_cast<std::byte>(random.bits());
          if (random.below(4) == 0) stream.resize(random.below(stream.size() + 1));
          group->header.decoded_bytes += random.below(2) * 10000;
          chunk.payload = put_group_together(*group);
        } else if (!group && chunk.payload.size() > 10) {
          chunk.payload[10 + random.below(chunk.payload.size() - 10)] ^=
              static_cast<std::byte>(random.bits());
        }
      }
      Decoder decoder(limits);
      ASSERT_TRUE(decoder.feed(put_together(parts)));
      decoder.end_of_input();
      std::unordered_set<std::uint64_t> alive;  // order stream promises that corners are
      for (auto progress = decoder.advance();
           progress && *progress == Decoder::Progress::item_ready; progress = decoder.advance()) {
        const Item item = decoder.take();
        if (const auto* block = std::get_if<MeshBlock>(&item)) {
          for (std::uint32_t b : block->cell_blocks) ASSERT_LT(b, decoder.schema()->blocks.size());
          ASSERT_EQ(block->corner_begin.size(), block->cell_count() + 1);
          ASSERT_EQ(block->corner_begin.back(), block->corners.size());
          if (decoder.schema()->order == Order::keep) continue;
          for_each_event(*block, decoder.schema()->coordinate_type, [&](const Event& event) {
            if (const auto* vertex = std::get_if<VertexEvent>(&event)) alive.insert(vertex->number);
            if (const auto* end = std::get_if<FinalizeEvent>(&event)) alive.erase(end->vertex);
            if (const auto* cell = std::get_if<CellEvent>(&event)) {
              for (std::uint64_t corner : cell->corners) ASSERT_TRUE(alive.contains(corner));
            }
          });
        }
      }
    }
  }
}

}  // namespace
}  // namespace shm
