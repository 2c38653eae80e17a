// Tests of damaged and inconsistent files. Reading such a file must either return an error with a
// fitting code, or return exactly the original contents. It must never return other contents,
// crash, or use excessive memory.
#include <functional>
#include <limits>
#include <string>
#include <unordered_set>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/shared/codec_id.h"
#include "format/schema.h"
#include "hostile/hostile.h"
#include "shm/summary.h"
#include "steps/step_topology.h"
#include "support/sanitized.h"

namespace shm {
namespace {

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

/// Returns true if the tests truncate and change this file at every position. To save time, the
/// tests damage all other files only at some positions.
bool is_thorough(const FeatureFile& feature) {
  return feature.name == "one_hexahedron" || feature.name == "stream_turned" ||
         feature.name == "arrays_on_some_blocks" || feature.name == "steps_and_extras" ||
         feature.name == "shifts_quantized" || feature.name == "shifts_columns_quads" ||
         feature.name == "patterns_special_values" || feature.name == "patterns_steps";
}

/// Returns the distance in bytes between the positions at which the test damages a file. The
/// distance is larger for a file that unpacks to a large amount of data.
std::size_t stride_of(const FeatureFile& feature, std::size_t usual) {
  const std::size_t stride = is_thorough(feature) ? 1 : feature.name == "large_extras" ? 97 : usual;
  return stride * every(7);
}

/// Returns true if a commit ends here, or if less than the header of a chunk follows it. A file cut
/// after a commit is a whole file.
bool ends_with_commit(const Bytes& bytes) {
  MemoryRandomSource source(bytes);
  const auto end = bytes_of_file(source);
  return end && bytes.size() - *end < container::kShortHeaderBytes;
}

TEST(Hostile, EveryCutIsTruncated) {
  for (const FeatureFile& feature : files())
    for (std::size_t size = 0; size < feature.bytes.size(); size += stride_of(feature, 5)) {
      // An exact-size copy, so that a read past the end is detected.
      const Bytes cut(feature.bytes.begin(),
                      feature.bytes.begin() + static_cast<std::ptrdiff_t>(size));
      const auto decoded = decode_in_pieces(cut);
      if (decoded && ends_with_commit(cut)) continue;
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

TEST(Hostile, NoShmFileAtAll) {
  EXPECT_EQ(code_of({}), ErrorCode::truncated);
  Bytes bytes = file("keep");
  bytes[0] = std::byte{0x88};
  EXPECT_EQ(code_of(bytes), ErrorCode::corrupt);
  // A file transfer in text mode changes CR LF to LF.
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
  // The file start has no checksum. Instead, the schema chunk contains a copy of the fields of the
  // file start.
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

TEST(Hostile, UnknownChunksAreSkippedOrRefused) {
  const std::string text = text_of(decode_in_pieces(file("groups")));
  const std::size_t chunks = take_apart(file("groups")).chunks.size();
  for (std::size_t at = 1; at < chunks; ++at) {
    FileParts parts = take_apart(file("groups"));
    const auto place = parts.chunks.begin() + static_cast<std::ptrdiff_t>(at);
    parts.chunks.insert(place, unknown_chunk(container::kChunkOptional));
    list_anew(parts);
    EXPECT_EQ(text_of(decode_in_pieces(put_together(parts))), text);
    parts.chunks[at].header.flags = 0;
    EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported);
  }
  // A known kind of chunk with a later version counts as unknown, too.
  FileParts parts = take_apart(file("groups"));
  parts.chunks[1].header.version = 2;
  EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported);
  parts.chunks[1].header.version = 1;
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
        // The index states the number of chunks, so a repeated chunk is an error, even though a
        // file may store the schema twice. Data after the index is ignored.
        parts = whole;
        parts.chunks.insert(parts.chunks.begin() + place, whole.chunks[at]);
        EXPECT_EQ(code_of(put_together(parts, numbering)), ErrorCode::corrupt) << at;
        if (at == 0) continue;
        parts = whole;
        std::swap(parts.chunks[at], parts.chunks[at - 1]);
        // If two neighbouring chunks are swapped and renumbered, the file is valid only if both are
        // extras, step times or step values.
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
  list_anew(parts);
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

// --- inconsistent data with correct checksums

TEST(Hostile, LyingSchema) {
  const auto refused = [](const std::function<void(Schema&)>& lie,
                          ErrorCode code = ErrorCode::corrupt) {
    Schema schema = hexahedra_schema();
    schema.arrays.push_back(array_of("a", Location::cell, ScalarType::float32, 1, {0}));
    lie(schema);
    EXPECT_EQ(code_of(file_of({{ChunkKind::schema, schema_payload(schema)}})), code);
  };
  refused([](Schema&) {}, ErrorCode::truncated);  // unchanged, but nothing follows
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
  refused([](Schema& s) { s.blocks[0].shape = static_cast<CellShape>(12); });
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
  // Truncates the schema at every position. Also appends one byte, which is read as the field for
  // step references and has an invalid value, or two bytes.
  Schema schema = mixed_cells().schema;
  schema.arrays.push_back(array_of("a", Location::cell, ScalarType::float32, 1, {0}));
  ByteWriter blob;
  put(blob, schema);
  for (std::size_t size = 0; size <= blob.bytes.size() + 2; ++size) {
    Bytes cut = blob.bytes;
    cut.resize(size, std::byte{3});
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
    auto group = take_group_apart(*chunk);
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
    // the first group of the second segment
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
    refused(name, [](Header& h) { h.unused_vertices = h.vertices + 1; });
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
    // Swaps the kinds and codecs of the first two streams. In the file "shifts", one of the two
    // streams then has a codec that is not allowed for its kind of stream. A reader must report
    // that this is unsupported.
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
  refused("keep", [](Header& h) {  // the first segment cannot import vertices
    h.streams.back().kind = container::StreamKind::imports;
  });
  refused("unmarked", [](Header& h) { h.unused_vertices += 1; });
  refused("unmarked", [](Header& h) { h.unused_vertices -= 1; });
}

// To decode step values, StepTopology decodes the groups a second time. It does not make the checks
// of a Reader, so it must detect wrong vertex counts itself.
TEST(Hostile, ReplayThatCountsOtherVerticesThanStated) {
  for (const char* name :
       {"keep", "groups", "mixed_cells", "segments", "shifts", "shifts_stream"}) {
    SCOPED_TRACE(name);
    const auto decoded = decode_in_pieces(file(name));
    ASSERT_TRUE(decoded);
    const bool shifts = std::string(name).starts_with("shifts");
    // A group of the shifts codec provides neighbourhoods only if it has a ring, which stores
    // recent elements. The test therefore requests no neighbourhoods from such groups.
    const ElementNeeds wants{!shifts, !shifts, true, true};
    const auto replayed = [&](const std::function<void(container::GroupHeader&)>& lie) {
      StepTopology replay(decoded->schema, std::uint64_t{1} << 30, wants);
      FileParts parts = take_apart(file(name));
      auto group = take_group_apart(*parts.find(ChunkKind::group));
      EXPECT_TRUE(group);
      lie(group->header);
      replay.add_group(
          0, group->header,
          std::vector<std::span<const std::byte>>(group->streams.begin(), group->streams.end()));
      const auto elements = replay.elements(0);
      return elements ? std::string() : elements.error().message();
    };
    EXPECT_EQ(replayed([](auto&) {}), "");
    EXPECT_NE(replayed([](auto& header) { --header.vertices; }), "");
    EXPECT_NE(replayed([](auto& header) { header.vertices = 0; }), "");
    EXPECT_NE(replayed([](auto& header) { ++header.vertices; }), "");
    EXPECT_NE(replayed([](auto& header) { header.vertices = ~std::uint64_t{0}; }), "");
  }
}

TEST(Hostile, ImportsOfVerticesThatAreNotThere) {
  for (const char* name : {"segments", "segments_stream"})
    for (const auto kind :
         {container::StreamKind::imports, container::StreamKind::vertex_numbers}) {
      // A missing stream is read as zeros. If the stream of imports is missing, every vertex counts
      // as imported. If the stream of vertex numbers is missing, the same vertex is imported
      // repeatedly.
      FileParts parts = take_apart(file(name));
      Chunk* chunk = parts.find(ChunkKind::group, 2);
      auto group = take_group_apart(*chunk);
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

TEST(Hostile, EndlessUnusedVertices) {
  // Vertices whose coordinates are all zero need no stream, but their declared number must still be
  // within the limits.
  FileParts parts = take_apart(file("no_cells"));
  container::GroupHeader header;
  header.vertices = header.unused_vertices = std::uint64_t{1} << 40;
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
  FAIL() << "a group without bytes gave 20 blocks";
}

TEST(Hostile, LyingIndex) {
  using container::Index;
  const Bytes whole = file("steps_and_extras");
  EXPECT_TRUE(decode_in_pieces(with_index(whole, [](Index&) {})));
  EXPECT_TRUE(decode_in_pieces(with_old_index(whole, [](Index&) {})));
  std::vector<std::function<void(Index&)>> lies = {
      [](Index& i) { ++i.vertices; },
      [](Index& i) { ++i.cells; },
      [](Index& i) { ++i.hexahedra; },
      [](Index& i) { ++i.max_active_vertices; },
      [](Index& i) { ++i.steps; },
      [](Index& i) { i.block_cells.push_back(0); },
      [](Index& i) { i.block_cells.clear(); },
      [](Index& i) { ++i.block_cells[0]; },
      [](Index& i) { i.entries.pop_back(); },
      [](Index& i) { i.entries.push_back(i.entries.back()); },
      [](Index& i) { i.entries.resize(100000); },
  };
  for (std::size_t i = 0; i < lies.size(); ++i)
    EXPECT_EQ(code_of(with_index(whole, lies[i])), ErrorCode::corrupt) << "lie " << i;
  lies.insert(lies.end(), {
                              [](Index& i) { i.previous_index = 16; },
                              [](Index& i) { ++i.streams[0].bytes; },
                              [](Index& i) { i.streams[0].name += 'x'; },
                              [](Index& i) { i.streams.pop_back(); },
                              [](Index& i) {
                                i.streams.push_back({"more", 1});
                              },
                          });
  for (std::size_t i = 0; i < lies.size(); ++i)
    EXPECT_EQ(code_of(with_old_index(whole, lies[i])), ErrorCode::corrupt) << "old change " << i;
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
    change_step_header(*parts.find(ChunkKind::step_values), lie);
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
  refused([](StepHeader& h) {
    h.reference = StepReference::before;
    h.reference_step += 1;
  });
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
    list_anew(parts);
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
  refused(blob_of(2, 0, {kHuge, kHuge}, 0));  // the product wraps around to 0
  refused(blob_of(8, 0, {std::uint64_t{1} << 61}, 0));
  refused(blob_of(2, 0, {~std::uint64_t{0}, 3}, 4));
  Bytes long_shape = blob_of(2, 0, {}, 0);
  long_shape.back() = std::byte{0x7f};  // 127 sides, all missing
  refused(long_shape);
}

// Damages bytes inside the bitstreams and corrects the checksums. The decoded contents are
// arbitrary, but a caller must be able to use every decoded value without checks.
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
        auto group = chunk.is(ChunkKind::group) ? take_group_apart(chunk) : std::nullopt;
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
      std::unordered_set<std::uint64_t> alive;  // vertices not yet finalized; in order `stream`,
                                                // cells may use only these vertices
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
