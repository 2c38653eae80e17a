// Faulty files: one small file for each fault that a reader must reject ("What a reader must
// reject" in spec/). Each file has exactly one fault. Its lengths and checksums are correct, unless
// the fault is a wrong length or checksum. The files are stored, numbered, in tests/golden/faulty,
// so that other readers can be tested with them. A file keeps its number forever; new files are
// added at the end.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/patterns/byte_planes.h"
#include "codecs/patterns/copied_vertices.h"
#include "codecs/shared/codec_id.h"
#include "format/random_chunks.h"
#include "support/feature_files.h"
#include "support/file_surgery.h"
#include "support/item_text.h"

namespace shm {

struct FaultyFile {
  ErrorCode code;        ///< expected error of this project's reader
  std::string sentence;  ///< the fault, as a sentence
  std::vector<std::byte> bytes;
};

inline std::string word_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::truncated: return "truncated";
    case ErrorCode::corrupt: return "corrupt";
    case ErrorCode::unsupported: return "unsupported";
    case ErrorCode::over_limit: return "over_limit";
    default: return "other";
  }
}

class FaultyFiles {
 public:
  FaultyFiles() : files_(feature_files()) {
    writer_digests = false;
    starts();
    chunks();
    schemas();
    blobs();
    group_headers();
    bitstreams();
    steps();
    extras();
    indices();
    ends();
    archives();
    many_extras();
    packed_indices();
    broken_bitstreams({"polyhedra", "polyhedra_stream"});
    parts_of_step_values();
    broken_bitstreams({"broken", "shifts_broken", "replay_strays"});
    large_blobs();
    entries_of_indices();
    headers_of_bundles();
    columns_of_bundles();
    many_bundles();
    special_values_in_groups();
    special_values_in_parts();
    fill_values();
    scaled_copies();
    weighted_parts();
    arrays_beside_mesh();
    relative_bounds_of_schema();
    references_to_bases();
    copied_components();
    histories();
    copies_of_vertices();
    broken_bitstreams({"copied_vertices"});
    broken_bitstreams({"grid_nodes", "patterns_grid_nodes"});
    node_schemes();
    digests();
    commits();
    writer_digests = true;
  }
  std::vector<FaultyFile> take() { return std::move(faulty_); }

 private:
  using Bytes = std::vector<std::byte>;
  using ChunkKind = container::ChunkKind;
  static constexpr auto kCorrupt = ErrorCode::corrupt;
  static constexpr auto kTruncated = ErrorCode::truncated;
  static constexpr auto kUnsupported = ErrorCode::unsupported;

  void add(ErrorCode code, std::string sentence, Bytes bytes) {
    faulty_.push_back({code, std::move(sentence), std::move(bytes)});
  }
  const Bytes& file(const std::string& name) const {
    return std::find_if(files_.begin(), files_.end(), [&](auto& it) { return it.name == name; })
        ->bytes;
  }
  /// Takes the feature file `name` apart and passes its parts to `change`. Returns the changed file
  /// with correct checksums.
  Bytes with(const std::string& name, const std::function<void(FileParts&)>& change,
             Numbering numbering = Numbering::anew) const {
    FileParts parts = take_apart(file(name));
    change(parts);
    return put_together(std::move(parts), numbering);
  }
  Bytes first_bytes(const std::string& name, std::size_t size) const {
    const Bytes& all = file(name);
    return Bytes(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(size));
  }
  static Chunk chunk_of(ChunkKind kind, Bytes payload) {
    Chunk chunk;
    chunk.header.kind = static_cast<std::uint8_t>(kind);
    chunk.payload = std::move(payload);
    return chunk;
  }
  static void insert(FileParts& parts, std::size_t at, Chunk chunk) {
    parts.chunks.insert(parts.chunks.begin() + static_cast<std::ptrdiff_t>(at), std::move(chunk));
  }
  void starts() {
    add(kTruncated, "The file is empty.", {});
    add(kTruncated, "The file ends within its first 16 bytes.", first_bytes("keep", 15));
    const auto started = [&](ErrorCode code, const char* sentence,
                             const std::function<void(FileParts&)>& change) {
      add(code, sentence, with("keep", [&](FileParts& parts) {
            change(parts);
            ByteWriter version;
            container::put_version(version, parts.start);
            std::copy(version.bytes.begin(), version.bytes.end(), parts.chunks[0].payload.begin());
          }));
    };
    started(kUnsupported, "The major version is 65535.", [](auto& it) { it.start.major = 65535; });
    started(kUnsupported, "The minor version of major version 0 is 65535.",
            [](auto& it) { it.start.minor = 65535; });
    started(kUnsupported, "It needs the private feature, bit 31.",
            [](auto& it) { it.start.needed_features = 1u << 31; });
    Bytes bytes = file("keep");
    bytes[0] = std::byte{0x88};
    add(kCorrupt, "The first byte of the signature is wrong.", bytes);
    bytes = file("keep");
    bytes.erase(bytes.begin() + 4);
    add(kCorrupt, "A transfer as text changed CR LF in the signature to LF.", bytes);
    add(kCorrupt, "The schema chunk contains another minor version than the file start.",
        with("keep", [](auto& it) { it.chunks[0].payload[2] ^= std::byte{1}; }));
    add(kCorrupt, "The schema chunk contains other features than the file start.",
        with("keep", [](auto& it) { it.chunks[0].payload[4] = std::byte{1}; }));
  }

  void chunks() {
    const auto flipped = [&](const char* sentence, std::size_t at) {
      Bytes bytes = file("keep");
      bytes[at] ^= std::byte{1};
      add(kCorrupt, sentence, std::move(bytes));
    };
    constexpr std::size_t kFirst = container::kFileStartBytes;
    flipped("The sync mark of a chunk is wrong.", kFirst);
    flipped("A bit of a chunk header is flipped, which its checksum detects.", kFirst + 6);
    flipped("The header checksum of a chunk is wrong.", kFirst + 18);
    flipped("A bit of a payload is flipped, which its checksum detects.",
            kFirst + container::kShortHeaderBytes + 9);
    add(kTruncated, "The file ends within a chunk header.", first_bytes("keep", kFirst + 15));
    add(kTruncated, "The file ends within a payload.", first_bytes("keep", kFirst + 40));
    const auto as_numbered = Numbering::as_they_are;
    add(kCorrupt, "The sequence of the second chunk is 2.",
        with(
            "keep", [](auto& it) { it.chunks[1].header.sequence = 2; }, as_numbered));
    add(kCorrupt, "The second chunk occurs twice.",
        with(
            "groups", [](auto& it) { insert(it, 1, it.chunks[1]); }, as_numbered));
    add(kCorrupt, "The second chunk occurs twice, and chunks are renumbered.",
        with("groups", [](auto& it) { insert(it, 1, it.chunks[1]); }));
    add(kCorrupt, "A group in the middle is missing.",
        with(
            "groups", [](auto& it) { it.chunks.erase(it.chunks.begin() + 2); }, as_numbered));
    add(kCorrupt, "A group in the middle is missing, and chunks are renumbered.",
        with("groups", [](auto& it) { it.chunks.erase(it.chunks.begin() + 2); }));
    add(kCorrupt, "Two groups are exchanged, and chunks are renumbered.",
        with("groups", [](auto& it) { std::swap(it.chunks[1], it.chunks[2]); }));
    add(kCorrupt, "The first chunk is not a schema.",
        with("keep", [](auto& it) { std::swap(it.chunks[0], it.chunks[1]); }));
    add(kCorrupt, "The index comes before the last group.", with("groups", [](auto& it) {
          std::swap(*(it.chunks.end() - 1), *(it.chunks.end() - 2));
        }));
    Chunk unknown = chunk_of(static_cast<ChunkKind>(255), Bytes(10));
    add(kUnsupported, "A private chunk (kind 255) that is not optional.",
        with("keep", [&](auto& it) {
          insert(it, 1, unknown);
          list_anew(it);
        }));
    add(kUnsupported, "A group of version 255.",
        with("keep", [](auto& it) { it.chunks[1].header.version = 255; }));
    for (const std::uint32_t segment : {1u, 7u})
      add(kCorrupt, "The first group is of segment " + std::to_string(segment) + ".",
          with("keep", [&](auto& it) { it.chunks[1].header.segment = segment; }));
    add(kCorrupt, "A group's segment is one below that of the group before.",
        with("segments", [](auto& it) { it.find(ChunkKind::group, 4)->header.segment = 0; }));
  }

  /// Adds a file whose schema is changed by `lie`.
  void add_schema(const std::string& sentence, const std::function<void(Schema&)>& lie) {
    Schema schema = hexahedra_schema();
    schema.arrays.push_back(array_of("a", Location::cell, ScalarType::float32, 1, {0}));
    lie(schema);
    FileParts parts;
    parts.chunks.push_back(chunk_of(ChunkKind::schema, schema_payload(schema)));
    add(kCorrupt, "Schema: " + sentence, put_together(std::move(parts)));
  }

  void schemas() {
    const auto of = [&](const std::string& sentence, const std::function<void(Schema&)>& lie) {
      add_schema(sentence, lie);
    };
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    of("order 3.", [](Schema& s) { s.order = static_cast<Order>(3); });
    of("order keep without corner_order.", [](Schema& s) { s.corner_order = false; });
    of("coordinates of type int32.", [](Schema& s) { s.coordinate_type = ScalarType::int32; });
    of("two ranges for three coordinates.", [](Schema& s) {
      s.coordinate_quantization = {8, {0, 0}, {1, 1}};
    });
    of("a quantization of 53 bits.", [](Schema& s) {
      s.coordinate_quantization = {53, {0, 0, 0}, {1, 1, 1}};
    });
    of("a range that ends before it begins.", [](Schema& s) {
      s.coordinate_quantization = {8, {0, 0, 2}, {1, 1, 1}};
    });
    of("an absolute bound of 0.",
       [](Schema& s) { s.coordinate_quantization = Quantization::absolute(0, 3); });
    of("an absolute bound that is not a number.", [](Schema& s) {
      s.coordinate_quantization =
          Quantization::absolute(std::numeric_limits<double>::quiet_NaN(), 3);
    });
    of("an infinite spacing.", [](Schema& s) {
      s.coordinate_quantization = Quantization::absolute(1e-6, 3);
      s.coordinate_quantization.spacing = kInfinity;
    });
    of("an infinite anchor.", [](Schema& s) {
      s.coordinate_quantization = Quantization::absolute(1e-6, 3);
      s.coordinate_quantization.minimum[2] = -kInfinity;
    });
    of("two anchors for three coordinates.",
       [](Schema& s) { s.coordinate_quantization = Quantization::absolute(1e-6, 2); });
    of("a quantized integer array.", [](Schema& s) {
      s.arrays[0].type = ScalarType::int64;
      s.arrays[0].quantization = Quantization::absolute(1e-6, 1);
    });
    of("65537 nodes a cell.", [](Schema& s) { s.blocks[0].nodes_per_cell = 65537; });
    of("scalar type 0.", [](Schema& s) { s.arrays[0].type = static_cast<ScalarType>(0); });
    of("an array on neither points nor cells.",
       [](Schema& s) { s.arrays[0].location = static_cast<Location>(255); });
    of("no components.", [](Schema& s) { s.arrays[0].components = 0; });
    of("65536 components.", [](Schema& s) { s.arrays[0].components = 65536; });
    of("an array on a block that does not exist.", [](Schema& s) { s.arrays[0].blocks = {1}; });
    of("an array on the same block twice.", [](Schema& s) { s.arrays[0].blocks = {0, 0}; });
    of("a point array on some blocks.", [](Schema& s) { s.arrays[0].location = Location::point; });
    ByteWriter blob;
    put(blob, hexahedra_schema());
    for (const bool more : {false, true}) {
      Bytes other = blob.bytes;
      other.resize(more ? other.size() + 3 : other.size() / 2, std::byte{2});
      FileParts parts;
      parts.chunks.push_back(chunk_of(ChunkKind::schema, schema_payload(other)));
      add(kCorrupt, more ? "Schema: bytes are left over." : "Schema: it ends in its middle.",
          put_together(std::move(parts)));
    }
    add(kCorrupt, "A later schema differs from the first.", with("groups", [&](auto& it) {
          insert(it, 2, take_apart(file("mixed_cells")).chunks[0]);
          list_anew(it);
        }));
  }

  /// Adds files with a chunk of extras whose packed blob contradicts its declared size and method.
  void node_schemes() {
    const auto add_block = [&](const std::string& sentence, CellShape shape, std::uint32_t nodes,
                               NodeScheme scheme) {
      add_schema(sentence, [&](Schema& s) { s.blocks[0] = {1, "", shape, nodes, scheme}; });
    };
    add_block("node scheme 3.", CellShape::hexahedron, 27, static_cast<NodeScheme>(3));
    add_block("a serendipity hexahedron of 20 nodes.", CellShape::hexahedron, 20,
              NodeScheme::serendipity);
    add_block("a serendipity line.", CellShape::line, 4, NodeScheme::serendipity);
    add_block("a Bezier polygon.", CellShape::polygon, 6, NodeScheme::bezier);
    add_block("a Bezier quad of 4 nodes.", CellShape::quad, 4, NodeScheme::bezier);
    add_block("Bezier cells with any number of nodes.", CellShape::quad, 0, NodeScheme::bezier);
  }

  void blobs() {
    const auto extra = [&](const char* sentence, Bytes payload, ErrorCode code = kCorrupt) {
      add(code, std::string("A packed blob: ") + sentence, with("keep", [&](auto& it) {
            insert(it, 1, chunk_of(ChunkKind::extra, std::move(payload)));
            list_anew(it);
          }));
    };
    const Bytes blob = extra_blob(2, 0, {200}, 200);
    const Bytes frame = zstd_compress(blob, 3);
    const auto packed = [](int method, std::uint64_t size, const Bytes& bytes) {
      ByteWriter out;
      out.put_u8(static_cast<std::uint8_t>(method));
      out.put_varint(size);
      out.put_bytes(bytes);
      return std::move(out.bytes);
    };
    extra("it contains more bytes than its size.", packed(0, blob.size() - 1, blob));
    extra("it contains fewer bytes than its size.", packed(0, blob.size() + 1, blob));
    extra("the zstd frame unpacks to more than its size.", packed(1, blob.size() - 1, frame));
    extra("the zstd frame unpacks to less than its size.", packed(1, blob.size() + 1, frame));
    Bytes other = frame;
    other.push_back(std::byte{0});
    extra("other bytes follow the zstd frame.", packed(1, blob.size(), other));
    other = frame;
    other.resize(other.size() - 3);
    extra("the zstd frame is cut.", packed(1, blob.size(), other));
    other = frame;
    other[0] ^= std::byte{1};
    extra("no zstd frame.", packed(1, blob.size(), other));
    // A skippable zstd frame of four bytes.
    extra("a skippable zstd frame.",
          packed(1, 0,
                 {std::byte{0x50}, std::byte{0x2a}, std::byte{0x4d}, std::byte{0x18}, std::byte{4},
                  std::byte{0}, std::byte{0}, std::byte{0}, std::byte{1}, std::byte{2},
                  std::byte{3}, std::byte{4}}));
    // A zstd frame of four parts: the magic number, a descriptor without a content size, a window
    // of 2^28 bytes, and an empty last block.
    extra("a zstd frame with a window of 2^28 bytes.",
          packed(1, 0,
                 {std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f}, std::byte{0xfd}, std::byte{0},
                  std::byte{18 << 3}, std::byte{1}, std::byte{0}, std::byte{0}}));
    extra("it claims to unpack to 2^62 bytes.", packed(1, std::uint64_t{1} << 62, frame),
          ErrorCode::over_limit);
    extra("no planes.", [&] {
      Bytes out = packed(2, blob.size(), {std::byte{0}});
      out.insert(out.end(), frame.begin(), frame.end());
      return out;
    }());
    extra("it is empty.", {});
  }

  void group_headers() {
    using Header = container::GroupHeader;
    const auto of = [&](const char* name, std::size_t nth, const std::string& sentence,
                        const std::function<void(Header&)>& lie, ErrorCode code = kCorrupt) {
      add(code, "Group header: " + sentence, with(name, [&](FileParts& parts) {
            Chunk* chunk = parts.find(ChunkKind::group, nth);
            auto group = take_group_apart(*chunk);
            lie(group->header);
            ByteWriter out;
            container::put(out, group->header);
            for (const auto& stream : group->streams) out.put_bytes(stream);
            chunk->payload = std::move(out.bytes);
          }));
    };
    of("groups", 1, "first_cell is one too large.", [](Header& h) { h.first_cell += 1; });
    of("groups", 1, "first_vertex is one too large.", [](Header& h) { h.first_vertex += 1; });
    of("keep", 0, "cells is one too large.", [](Header& h) { h.cells += 1; });
    of("keep", 0, "cells is one too small.", [](Header& h) { h.cells -= 1; });
    of("keep", 0, "cells is above 2^20.", [](Header& h) { h.cells = (1u << 20) + 1; });
    of("keep", 0, "vertices is one too large.", [](Header& h) { h.vertices += 1; });
    of("keep", 0, "vertices is one too small.", [](Header& h) { h.vertices -= 1; });
    of("keep", 0, "unused_vertices is above vertices.",
       [](Header& h) { h.unused_vertices = h.vertices + 1; });
    of("unmarked", 0, "unused_vertices is one too small.",
       [](Header& h) { h.unused_vertices -= 1; });
    of("keep", 0, "max_active_vertices is one too large.",
       [](Header& h) { h.max_active_vertices += 1; });
    of("keep", 0, "max_active_vertices is one too small.",
       [](Header& h) { h.max_active_vertices -= 1; });
    of("keep", 0, "decoded_bytes is one too large.", [](Header& h) { h.decoded_bytes += 1; });
    of("keep", 0, "decoded_bytes is one too small.", [](Header& h) { h.decoded_bytes -= 1; });
    of("keep", 0, "vertices are imported into segment 0.",
       [](Header& h) { h.imported_vertices += 1; });
    of("segments", 2, "imported_vertices is one too large.",
       [](Header& h) { h.imported_vertices += 1; });
    of("segments", 2, "imported_vertices is one too small.",
       [](Header& h) { h.imported_vertices -= 1; });
    of("segments", 2, "imported_vertices is 2^64 - 1.",
       [](Header& h) { h.imported_vertices = ~std::uint64_t{0}; });
    of("keep", 0, "a stream ends beyond the payload.", [](Header& h) { h.streams[0].bytes += 1; });
    of("keep", 0, "a stream is of 2^64 - 1 bytes.",
       [](Header& h) { h.streams[0].bytes = ~std::uint64_t{0}; });
    of("keep", 0, "a byte is left over after the last stream.",
       [](Header& h) { h.streams.back().bytes -= 1; });
    of("keep", 0, "a stream's checksum does not match.",
       [](Header& h) { h.streams.back().checksum ^= 1; });
    of("keep", 0, "the last stream is not listed.", [](Header& h) { h.streams.pop_back(); });
    of("keep", 0, "the last stream is listed twice.",
       [](Header& h) { h.streams.push_back(h.streams.back()); });
    of("keep", 0, "two streams are out of order.", [](Header& h) {
      std::swap(h.streams[0].kind, h.streams[1].kind);
      std::swap(h.streams[0].codec, h.streams[1].codec);
    });
    of("keep", 0, "a stream of kind 0.",
       [](Header& h) { h.streams[0].kind = static_cast<container::StreamKind>(0); });
    of("keep", 0, "a stream of array 1000, which does not exist.", [](Header& h) {
      h.streams.back().kind = container::StreamKind::array;
      h.streams.back().array = 1000;
    });
    of(
        "keep", 0, "a private codec, 255.",
        [](Header& h) { h.streams[0].codec = static_cast<container::Codec>(255); }, kUnsupported);
    of(
        "keep", 0, "coordinates in the codec of connectivity.",
        [](Header& h) { h.streams.back().codec = container::Codec::paper; }, kUnsupported);
    add(kCorrupt, "Group header: its own checksum does not match.",
        with("keep",
             [](FileParts& parts) { parts.find(ChunkKind::group)->payload[0] ^= std::byte{1}; }));
    for (const auto kind : {container::StreamKind::imports, container::StreamKind::vertex_numbers})
      add(kCorrupt,
          "Group header: stream " + container::stream_name(kind) +
              " is left out, so that all of its numbers are 0.",
          with("segments", [&](FileParts& parts) {
            Chunk* chunk = parts.find(ChunkKind::group, 2);
            auto group = take_group_apart(*chunk);
            auto& entries = group->header.streams;
            const auto at = std::find_if(entries.begin(), entries.end(),
                                         [&](const auto& entry) { return entry.kind == kind; });
            group->streams.erase(group->streams.begin() + (at - entries.begin()));
            entries.erase(at);
            chunk->payload = put_group_together(*group);
          }));
    add(kCorrupt, "A group after step values.", with("steps_and_extras", [](FileParts& parts) {
          insert(parts, parts.chunks.size() - 1, *parts.find(ChunkKind::group));
          list_anew(parts);
        }));
  }

  /// Adds files with correct checksums in which one bitstream cannot be decoded. To create such a
  /// bitstream, changes to a valid bitstream are tried in a fixed sequence, one at a time, until
  /// the bitstream can no longer be decoded.
  void bitstreams() {
    broken_bitstreams({"keep",
                       "stream_turned",
                       "keep_delay",
                       "paper_codec",
                       "replay_keep",
                       "replay_stream",
                       "mixed_rows",
                       "mixed_cells",
                       "mixed_cells_stream",
                       "every_shape",
                       "every_shape_stream",
                       "second_order",
                       "second_order_stream",
                       "segments",
                       "segments_stream",
                       "shifts",
                       "shifts_stream",
                       "shifts_columns",
                       "shifts_arrays",
                       "patterns",
                       "patterns_stream",
                       "patterns_shapes",
                       "patterns_arrays",
                       "arrays",
                       "tables_for_some",
                       "mixed_columns",
                       "holes",
                       "free"});
  }
  void broken_bitstreams(std::initializer_list<const char*> names) {
    for (const char* name : names) {
      FileParts whole = take_apart(file(name));
      std::size_t groups = 0;
      for (const Chunk& chunk : whole.chunks) groups += chunk.is(ChunkKind::group);
      const std::size_t nth = groups - 1;
      const auto first = take_group_apart(*whole.find(ChunkKind::group, nth));
      for (std::size_t s = 0; s < first->streams.size(); ++s) {
        PlainRandom random(s + 1);
        for (int tries = 0; tries < 300; ++tries) {
          GroupParts group = *first;
          Bytes& stream = group.streams[s];
          if (stream.empty()) break;
          for (int n = 0; n < 3; ++n)
            stream[random.below(stream.size())] ^= static_cast<std::byte>(random.bits());
          FileParts parts = whole;
          parts.find(ChunkKind::group, nth)->payload = put_group_together(std::move(group));
          Bytes bytes = put_together(std::move(parts));
          const auto text = text_of_file(bytes);
          if (text || text.error().code != kCorrupt) continue;
          add(kCorrupt,
              "Last group of \"" + std::string(name) + "\": stream " +
                  container::stream_name(first->header.streams[s].kind) + " of codec " +
                  std::to_string(static_cast<int>(first->header.streams[s].codec)) +
                  " decodes to invalid data.",
              std::move(bytes));
          break;
        }
      }
    }
  }

  void steps() {
    using Header = container::StepHeader;
    const auto of = [&](const std::string& sentence, const std::function<void(Header&)>& lie) {
      add(kCorrupt, "Step values: " + sentence, with("steps_and_extras", [&](FileParts& parts) {
            change_step_header(*parts.find(ChunkKind::step_values), lie);
          }));
    };
    of("of an array that does not exist.", [](Header& h) { h.array = 1000; });
    of("of array 2^32 - 1.", [](Header& h) { h.array = ~0u; });
    of("of no elements.", [](Header& h) { h.count = 0; });
    of("of one element more than the group has.", [](Header& h) { h.count += 1; });
    of("of 2^64 - 1 elements.", [](Header& h) { h.count = ~std::uint64_t{0}; });
    of("of the second group, before the first.", [](Header& h) { h.group = 1; });
    of("of a group that does not exist.", [](Header& h) { h.group = ~0u; });
    of("of step 2^40.", [](Header& h) { h.step = h.reference_step = std::uint64_t{1} << 40; });
    of("they refer to the next step.", [](Header& h) {
      h.reference = StepReference::before;
      h.reference_step = h.step + 1;
    });
    add(kCorrupt, "Step values: the first chunk is missing.",
        with("shifts_steps", [](FileParts& parts) {
          const auto at = std::find_if(parts.chunks.begin(), parts.chunks.end(),
                                       [](auto& it) { return it.is(ChunkKind::step_values); });
          parts.chunks.erase(at);
          list_anew(parts);
        }));
    const auto times = [&](const std::string& sentence, std::size_t bytes, int count) {
      ByteWriter out;
      put_packed(out, Bytes(bytes));
      add(kCorrupt, "Step times: " + sentence, with("keep", [&](FileParts& parts) {
            for (int n = 0; n < count; ++n)
              insert(parts, 1, chunk_of(ChunkKind::step_times, out.bytes));
            list_anew(parts);
          }));
    };
    times("their bytes are not a multiple of 8.", 15, 1);
    times("they come twice.", 16, 2);
  }

  static Bytes extra_blob(int type, int refers, const std::vector<std::uint64_t>& shape,
                          std::size_t data) {
    ByteWriter out;
    out.put_text("key");
    out.put_u8(static_cast<std::uint8_t>(type));
    out.put_u8(static_cast<std::uint8_t>(refers));
    out.put_varint(shape.size());
    for (const std::uint64_t side : shape) out.put_varint(side);
    out.put_bytes(Bytes(data));
    return std::move(out.bytes);
  }

  void extras() {
    const auto of = [&](const std::string& sentence, const Bytes& blob) {
      ByteWriter payload;
      put_packed(payload, blob);
      add(kCorrupt, "Extra: " + sentence, with("keep", [&](FileParts& parts) {
            insert(parts, 1, chunk_of(ChunkKind::extra, payload.bytes));
            list_anew(parts);
          }));
    };
    of("it is empty.", {});
    of("of type 0.", extra_blob(0, 0, {4}, 4));
    of("of type 255.", extra_blob(255, 0, {4}, 4));
    of("it refers to 255.", extra_blob(7, 255, {4}, 32));
    of("bytes that refer to vertices.", extra_blob(2, 1, {4}, 4));
    of("more data than its shape.", extra_blob(2, 0, {4}, 5));
    of("less data than its shape.", extra_blob(2, 0, {5}, 4));
    constexpr std::uint64_t kHuge = std::uint64_t{1} << 32;
    of("the product of its shape is 2^64.", extra_blob(2, 0, {kHuge, kHuge}, 0));
    of("the product of its shape is 2^61.", extra_blob(8, 0, {std::uint64_t{1} << 61}, 0));
    Bytes long_shape = extra_blob(2, 0, {}, 0);
    long_shape.back() = std::byte{0x7f};
    of("a shape of 127 sides, none there.", long_shape);
  }

  void indices() {
    using container::Index;
    const auto of = [&](const std::string& sentence, const std::function<void(Index&)>& lie) {
      add(kCorrupt, "Index: " + sentence, with_index(file("steps_and_extras"), lie));
    };
    const auto of_old = [&](const std::string& sentence, const std::function<void(Index&)>& lie) {
      add(kCorrupt, "Index: " + sentence, with_old_index(file("steps_and_extras"), lie));
    };
    of("one vertex too many.", [](Index& i) { ++i.vertices; });
    of("one cell too many.", [](Index& i) { ++i.cells; });
    of("one hexahedron too many.", [](Index& i) { ++i.hexahedra; });
    of("max_active_vertices is one too large.", [](Index& i) { ++i.max_active_vertices; });
    of("one step too many.", [](Index& i) { ++i.steps; });
    of("one segment too many.", [](Index& i) { ++i.segments; });
    of("one imported vertex too many.", [](Index& i) { ++i.imported_vertices; });
    of("one block too many.", [](Index& i) { i.block_cells.push_back(0); });
    of("no blocks.", [](Index& i) { i.block_cells.clear(); });
    of("a cell too many in a block.", [](Index& i) { ++i.block_cells[0]; });
    of_old("a byte too many of a stream.", [](Index& i) { ++i.streams[0].bytes; });
    of_old("a stream of another name.", [](Index& i) { i.streams[0].name += 'x'; });
    of_old("a stream is missing.", [](Index& i) { i.streams.pop_back(); });
    of_old("a stream too many.", [](Index& i) { i.streams.push_back({"zzz", 1}); });
    of_old("streams out of order.", [](Index& i) { std::swap(i.streams[0], i.streams[1]); });
    of("a line is missing.", [](Index& i) { i.entries.pop_back(); });
    of("a line too many.", [](Index& i) { i.entries.push_back(i.entries.back()); });
    add(kCorrupt, "Index: a byte is left over.", with("keep", [](FileParts& parts) {
          parts.chunks.back().payload.push_back(std::byte{0});
        }));
    add(kCorrupt, "Index: its last byte is missing.",
        with("keep", [](FileParts& parts) { parts.chunks.back().payload.pop_back(); }));
    add(kTruncated, "There is no index.",
        with("keep", [](FileParts& parts) { parts.chunks.pop_back(); }));
  }

  void ends() {
    const Bytes& whole = file("keep");
    add(kTruncated, "The trailer is missing.",
        first_bytes("keep", whole.size() - container::kTrailerBytes));
    add(kTruncated, "The last byte is missing.", first_bytes("keep", whole.size() - 1));
    const auto with_trailer = [&](const char* sentence, std::size_t at) {
      Bytes bytes = whole;
      bytes[bytes.size() - container::kTrailerBytes + at] ^= std::byte{1};
      add(kCorrupt, sentence, std::move(bytes));
    };
    with_trailer("Trailer: another offset, which its checksum detects.", 0);
    with_trailer("Trailer: another checksum.", 8);
    with_trailer("Trailer: another mark.", 12);
    Bytes bytes = whole;
    ByteWriter trailer;
    container::put_trailer(trailer, 16);
    std::copy(trailer.bytes.begin(), trailer.bytes.end(),
              bytes.end() - static_cast<std::ptrdiff_t>(container::kTrailerBytes));
    add(kCorrupt, "Trailer: it points to another chunk than the index.", std::move(bytes));
  }

  void archives() {
    const auto of = [&](const std::string& sentence,
                        const std::function<void(container::MemberList&)>& lie) {
      const Bytes whole = archive_file().bytes;
      MemoryRandomSource source(whole);
      const auto place = container::last_chunk(source, ChunkKind::members);
      const Bytes payload = *container::read_chunk(source, *place, whole.size());
      ByteReader in(payload);
      container::MemberList list;
      container::get(in, list);
      lie(list);
      ByteWriter members, out;
      container::put(members, list);
      container::ChunkHeader header;
      header.kind = static_cast<std::uint8_t>(ChunkKind::members);
      header.payload_bytes = members.bytes.size();
      header.payload_checksum = checksum(members.bytes);
      out.put_bytes(std::span(whole).first(place->offset));
      container::put(out, header);
      out.put_bytes(members.bytes);
      container::put_trailer(out, place->offset);
      add(kCorrupt, "Archive: " + sentence, std::move(out.bytes));
    };
    using container::MemberList;
    of("a member of the folder above.", [](MemberList& l) { l.members[0].name = "../a.e"; });
    of("a member of the root folder.", [](MemberList& l) { l.members[0].name = "/a.e"; });
    of("a member without a name.", [](MemberList& l) { l.members[0].name.clear(); });
    of("two members of one name.", [](MemberList& l) { l.members[0].name = l.members[1].name; });
    of("a member of more bytes than there are.",
       [](MemberList& l) { l.members[0].bytes = ~std::uint64_t{0}; });
    of("a byte of no member.", [](MemberList& l) { l.members.back().bytes -= 1; });
    of("another version than that of the file start.", [](MemberList& l) { ++l.start.minor; });
  }

  /// Extra chunks of version 1.
  void many_extras() {
    const auto of = [&](const std::string& sentence, const Bytes& payload,
                        ErrorCode code = kCorrupt) {
      add(code, "Extras: " + sentence, with("keep", [&](FileParts& parts) {
            Chunk chunk = chunk_of(ChunkKind::extra, payload);
            chunk.header.version = 1;
            insert(parts, 1, std::move(chunk));
            list_anew(parts);
          }));
    };
    const auto packed = [](const Bytes& blob, Packing packing = Packing::plain) {
      ByteWriter out;
      put_packed(out, blob, packing);
      return std::move(out.bytes);
    };
    // Returns the unpacked bytes of a list with a single extra. `type` is the type of the extra's
    // values. `distance` states how far back in the list the value is to which each value is
    // relative. The extra declares `values` values, but contains `bytes` bytes for them.
    const auto one = [&](int type, std::uint64_t distance, std::uint64_t values,
                         std::size_t bytes) {
      ByteWriter out;
      out.put_varint(1);
      out.put_text("key");
      out.put_u8(static_cast<std::uint8_t>(type));
      out.put_u8(0);
      out.put_varint(distance);
      out.put_varint(1);
      out.put_varint(values);
      out.put_bytes(Bytes(bytes));
      return packed(out.bytes);
    };
    of("it is empty.", packed({}));
    of("of type 0.", one(0, 0, 4, 4));
    of("bytes as differences.", one(2, 1, 4, 4));
    of("floating-point numbers as differences.", one(10, 1, 4, 32));
    of("differences from 65536 values back.", one(5, 65536, 4, 4));
    of("a difference too many.", one(5, 1, 4, 5));
    of("a difference too few.", one(5, 1, 4, 3));
    of("a byte too many.", one(2, 0, 4, 5));
    of("2^60 values.", one(2, 0, std::uint64_t{1} << 60, 4));
    ByteWriter many, sides;
    many.put_varint(65537);
    for (int i = 0; i < 65537; ++i) many.put_bytes(extras_head());
    of("65537 of them.", packed(many.bytes));
    sides.put_varint(1);
    sides.put_text("key");
    for (const std::uint8_t byte : std::initializer_list<std::uint8_t>{2, 0, 0}) sides.put_u8(byte);
    sides.put_varint(256);
    for (int i = 0; i < 256; ++i) sides.put_u8(1);
    sides.put_u8(0);
    of("a shape of 256 sides.", packed(sides.bytes));
    ByteWriter large;
    large.put_u8(3);
    const Bytes frame = zstd_compress(Bytes((1u << 20) + 1), 3);
    large.put_bytes(std::span(frame).subspan(4));  // the frame without its magic number
    of("more than 2^20 bytes that are packed with the dictionary.", large.bytes);
    ByteWriter unknown;
    unknown.put_u8(4);
    unknown.put_varint(4);
    unknown.put_bytes(Bytes(4));
    of("a packed blob of method 4.", unknown.bytes);
  }
  /// Returns the beginning of a chunk of extras, before the values.
  static Bytes extras_head() {
    ByteWriter out;
    for (const std::uint8_t byte : std::initializer_list<std::uint8_t>{0, 2, 0, 0, 1, 0})
      out.put_u8(byte);
    return std::move(out.bytes);
  }

  /// Adds files with an index in which one field of one entry is wrong.
  void entries_of_indices() {
    using container::IndexEntry;
    using container::StepEntry;
    const auto of = [&](ChunkKind kind, const std::string& sentence, auto lie) {
      add(kCorrupt, "Index: " + sentence,
          with_index(file("steps_and_extras"),
                     [&](container::Index& index) { lie(entry_of(index, kind, 0)); }));
    };
    const auto of_old = [&](ChunkKind kind, const std::string& sentence, auto lie) {
      add(kCorrupt, "Old index: " + sentence,
          with_old_index(file("steps_and_extras"),
                         [&](container::Index& index) { lie(entry_of(index, kind, 0)); }));
    };
    const auto group = ChunkKind::group, steps = ChunkKind::step_values;
    of(group, "another kind.", [](IndexEntry& it) { it.kind = 7; });
    of(group, "a byte too many of a group.", [](IndexEntry& it) { ++it.bytes; });
    of(group, "another segment.", [](IndexEntry& it) { ++it.segment; });
    of(group, "a cell too many of a group.", [](IndexEntry& it) { ++it.cells; });
    of(group, "a vertex too many of a group.", [](IndexEntry& it) { ++it.vertices; });
    of(group, "another length of a group header.", [](IndexEntry& it) { ++it.header_bytes; });
    of(group, "another box of a group.", [](IndexEntry& it) { it.box[3] += 1; });
    of_old(group, "another offset.", [](IndexEntry& it) { ++it.offset; });
    of_old(group, "another first cell.", [](IndexEntry& it) { ++it.first_cell; });
    of_old(group, "another first vertex.", [](IndexEntry& it) { ++it.first_vertex; });
    of_old(group, "another box of a group.", [](IndexEntry& it) { it.box[0] -= 1; });
    of(steps, "another array of step values.", [](IndexEntry& it) { ++it.parts[0].array; });
    of(steps, "another step.", [](IndexEntry& it) { ++it.parts[0].step; });
    of(steps, "another group of step values.", [](IndexEntry& it) { ++it.parts[0].group; });
    of(steps, "another count of step values.", [](IndexEntry& it) { ++it.parts[0].count; });
    of(steps, "another reference.", [](IndexEntry& it) {
      it.parts[0].reference = it.parts[0].reference == StepReference::nothing
                                  ? StepReference::before
                                  : StepReference::nothing;
    });
    of(steps, "another codec of step values.", [](IndexEntry& it) {
      it.parts[0].codec =
          it.parts[0].codec == Codec::columns ? Codec::shuffled_zstd : Codec::columns;
    });
    of_old(steps, "another first element of step values.",
           [](IndexEntry& it) { ++it.parts[0].first; });
    Bytes bytes = with("keep", [](FileParts& parts) {
      Chunk& chunk = *parts.find(ChunkKind::group);
      auto apart = take_group_apart(chunk);
      std::swap(apart->header.box[0], apart->header.box[3]);
      chunk.payload = put_group_together(std::move(*apart));
    });
    add(kCorrupt, "Group and index: a box that is not that of the vertices.",
        with_index(bytes, [](container::Index& index) {
          auto& box = entry_of(index, ChunkKind::group, 0).box;
          std::swap(box[0], box[3]);
        }));
  }
  void packed_indices() {
    const auto of = [&](const std::string& sentence, const std::function<void(Bytes&)>& lie) {
      add(kCorrupt, "Packed index: " + sentence, with("steps_and_extras", [&](FileParts& parts) {
            Bytes& payload = parts.chunks.back().payload;
            ByteReader in(payload);
            Bytes blob = *get_packed(in, std::uint64_t{1} << 20);
            lie(blob);
            ByteWriter out;
            put_packed(out, blob);
            payload = std::move(out.bytes);
          }));
    };
    of("a byte too many.", [](Bytes& blob) { blob.push_back(std::byte{0}); });
    of("its last byte is missing.", [](Bytes& blob) { blob.pop_back(); });
    of("it is empty.", [](Bytes& blob) { blob.clear(); });
    add(kCorrupt, "Packed index: a number of nine bytes.", with("no_cells", [](FileParts& parts) {
          ByteWriter blob, out;
          // All totals of this index are zero. The index states a value range for one array with
          // one component. The length byte of the smallest value is nine, although a number has at
          // most eight bytes.
          blob.put_bytes(Bytes(8));
          for (const std::uint8_t byte : std::initializer_list<std::uint8_t>{1, 0, 1, 9})
            blob.put_u8(byte);
          blob.put_bytes(Bytes(64));
          put_packed(out, blob.bytes, Packing::none);
          parts.chunks.back().payload = std::move(out.bytes);
        }));
  }

  void parts_of_step_values() {
    const auto of = [&](const std::string& sentence, const std::function<void(StepPayload&)>& lie) {
      add(kCorrupt, "Parts of step values: " + sentence,
          with("steps_and_extras", [&](FileParts& parts) {
            Chunk& chunk = *parts.find(ChunkKind::step_values);
            auto steps = take_steps_apart(chunk);
            lie(*steps);
            chunk.payload = put_steps_together(std::move(*steps), 1);
          }));
    };
    of("there are none.", [](StepPayload& it) { it = {}; });
    of("the first one twice.", [](StepPayload& it) {
      it.heads.insert(it.heads.begin(), it.heads[0]);
      it.values.insert(it.values.begin(), it.values[0]);
    });
    of("there are 65.", [](StepPayload& it) {
      it.heads.resize(65, it.heads[0]);
      it.values.resize(65);
    });
    add(kCorrupt, "Parts of step values: a byte too many.",
        with("steps_and_extras", [](FileParts& parts) {
          parts.find(ChunkKind::step_values)->payload.push_back(std::byte{0});
        }));
  }

  /// Returns the file "bundles", in which `change` has changed its bundle. The index agrees with
  /// the changed bundle.
  Bytes with_bundle(const std::function<void(StepPayload&)>& change) const {
    return with("bundles", [&](FileParts& parts) {
      for (Chunk& chunk : parts.chunks) {
        if (!chunk.is(ChunkKind::step_values) || chunk.header.version != container::kBundleVersion)
          continue;
        auto steps = take_steps_apart(chunk);
        change(*steps);
        chunk.payload = put_steps_together(std::move(*steps), container::kBundleVersion);
      }
      list_anew(parts);
    });
  }

  void headers_of_bundles() {
    using Parts = std::vector<container::StepPart>;
    const auto of = [&](const std::string& sentence, const std::function<void(Parts&)>& lie,
                        ErrorCode code = kCorrupt) {
      add(code, "Bundle: " + sentence, with_bundle([&](StepPayload& it) { lie(it.heads); }));
    };
    of("of no steps.", [](Parts& it) { it[0].header.steps = 0; });
    of("of one step too many.", [](Parts& it) { it[0].header.steps += 1; });
    of("of one step too few.", [](Parts& it) { it[0].header.steps -= 1; });
    of("of 2^15 + 1 steps.", [](Parts& it) { it[0].header.steps = (1 << 15) + 1; });
    of("of 2^15 steps of many arrays.", [](Parts& it) { it[0].header.steps = 1 << 15; });
    of("steps that end after 2^32.", [](Parts& it) { it[0].header.step = 0xffffffffu; });
    of("of another group.", [](Parts& it) { it[0].header.group = 1; });
    of("a part of no arrays.", [](Parts& it) { it[0].header.arrays = 0; });
    of("of arrays that do not exist.", [](Parts& it) { it.back().header.arrays += 100; });
    of("of one array too few.", [](Parts& it) { it.pop_back(); });
    of("of one element too many.", [](Parts& it) { it[0].header.count += 1; });
    of("of one element too few.", [](Parts& it) { it[0].header.count -= 1; });
    of("a part of no elements.", [](Parts& it) { it[0].header.count = 0; });
  }

  /// Replaces all step values by bundles of the first array, which is zero at all steps. Each
  /// bundle has 2^15 steps.
  Bytes with_bundles_of_zeros(std::uint64_t bundles) const {
    FileParts parts = take_apart(file("bundles"));
    const auto is_step = [](const Chunk& it) { return it.is(ChunkKind::step_values); };
    const auto first = std::find_if(parts.chunks.begin(), parts.chunks.end(), is_step);
    Chunk chunk = *first;
    chunk.header.version = container::kBundleVersion;
    auto place = static_cast<std::size_t>(first - parts.chunks.begin());
    std::erase_if(parts.chunks, is_step);
    for (std::uint64_t n = 0; n < bundles; ++n) {
      container::StepPart part;
      part.header.step = part.header.reference_step = n << 15;
      part.header.steps = 1 << 15;
      part.header.count = 18;
      part.header.codec = container::kBundleCodec;
      // One byte of methods, which is zero and therefore a plane without bytes.
      chunk.payload =
          put_steps_together({{part}, {{std::byte{1}, std::byte{0}}}}, container::kBundleVersion);
      insert(parts, place++, chunk);
    }
    list_anew(parts);
    return with_index(put_together(std::move(parts)),
                      [&](container::Index& index) { index.steps = bundles << 15; });
  }
  void many_bundles() {
    EXPECT_TRUE(decode_in_pieces(with_bundles_of_zeros(8)));
    add(kCorrupt, "Bundle: the ninth bundle of 2^15 steps.", with_bundles_of_zeros(9));
    add(kCorrupt, "Bundle: in a chunk of version 0.", with("bundles", [](FileParts& parts) {
          Chunk& chunk = *parts.find(ChunkKind::step_values);
          auto steps = take_steps_apart(chunk);
          steps->heads.resize(1);
          steps->values.resize(1);
          steps->heads[0].header.codec = container::kBundleCodec;
          chunk.header.version = 0;
          chunk.payload = put_steps_together(std::move(*steps), 0);
          list_anew(parts);
        }));
  }

  /// The bytes of a bundle of the arrays "wave" and "equal" of the file "bundles". They have 18
  /// elements and one component.
  struct Columns {
    std::uint8_t first = 3 | 1 << 4, second = 0;   // coded, full, not predicted; zero
    Bytes details = {std::byte{0}, std::byte{1}};  // floats; residuals of one byte
    std::size_t residuals = 2 * 18;
    std::uint64_t steps = 2;
    std::size_t bytes_after = 0;
  };
  Bytes with_columns(const Columns& columns) const {
    return with_bundle([&](StepPayload& it) {
      container::StepHeader& header = it.heads[0].header;
      header.array = 2;
      header.arrays = 2;
      header.steps = columns.steps;
      header.count = 18;
      it.heads.resize(1);
      it.values.resize(1);
      ByteWriter head, out;
      head.put_u8(columns.first);
      head.put_u8(columns.second);
      head.put_bytes(columns.details);
      const auto put_stored = [&](const Bytes& bytes) {
        out.put_varint(bytes.size());
        out.put_bytes(bytes);
      };
      out.put_varint(head.bytes.size());
      put_stored(head.bytes);
      if (columns.residuals > 0) put_stored(Bytes(columns.residuals, std::byte{1}));
      out.put_bytes(Bytes(columns.bytes_after));
      it.values[0] = std::move(out.bytes);
    });
  }

  void columns_of_bundles() {
    const Bytes valid = with_columns({});
    EXPECT_TRUE(decode_in_pieces(valid));
    const auto of = [&](const std::string& sentence, const std::function<void(Columns&)>& lie) {
      Columns columns;
      lie(columns);
      add(kCorrupt, "Columns of a bundle: " + sentence, with_columns(columns));
    };
    of("shape 3.", [](Columns& it) { it.first |= 3 << 2; });
    of("predictor 6.", [](Columns& it) { it.first = 3 | 6 << 4; });
    of("a shape of a zero column.", [](Columns& it) { it.second = 1 << 2; });
    of("a predictor of a zero column.", [](Columns& it) { it.second = 1 << 4; });
    of("a copy of itself.", [](Columns& it) {
      it.second = 2;
      it.details.push_back(std::byte{0});
    });
    of("a copy of a column before the first.", [](Columns& it) {
      it.second = 2;
      it.details.push_back(std::byte{2});
    });
    of("a copy of a constant column.", [](Columns& it) {
      it.first = 1;
      it.second = 2;
      it.details = Bytes(9, std::byte{1});
      it.residuals = 0;
    });
    of("a domain that does not exist.", [](Columns& it) { it.details[0] = std::byte{7}; });
    of("the domain of integers.", [](Columns& it) { it.details[0] = std::byte{5}; });
    of("the domain of quantized values.", [](Columns& it) { it.details[0] = std::byte{6}; });
    of("residuals of nine bytes.", [](Columns& it) { it.details[1] = std::byte{9}; });
    of("a description that ends early.", [](Columns& it) { it.details.pop_back(); });
    of("a description that is too long.", [](Columns& it) { it.details.push_back(std::byte{0}); });
    of("residuals that are missing.", [](Columns& it) { it.residuals = 0; });
    of("residuals that end early.", [](Columns& it) { it.residuals -= 1; });
    of("bytes after the residuals.", [](Columns& it) { it.bytes_after = 1; });
    of("more than 2^15 values.", [](Columns& it) {
      it.steps = (1 << 15) / 18 + 1;
      it.residuals = it.steps * 18;
    });
  }

  /// Returns a feature file after change(header, values) was called for each part of step values.
  Bytes with_parts(const std::string& name,
                   const std::function<void(container::StepHeader&, Bytes&)>& change) const {
    return with(name, [&](FileParts& parts) {
      for (Chunk& chunk : parts.chunks) {
        if (!chunk.is(ChunkKind::step_values)) continue;
        auto steps = take_steps_apart(chunk);
        for (std::size_t i = 0; i < steps->heads.size(); ++i)
          change(steps->heads[i].header, steps->values[i]);
        chunk.payload = put_steps_together(std::move(*steps), chunk.header.version);
      }
      list_anew(parts);
    });
  }

  /// The fields of a part with the codec `weighted`: twelve zeros of the array "p", which has the
  /// type float32.
  struct WeightedPart {
    std::uint64_t count = 12;
    std::uint8_t head = 3 << 3;         // the domain `floats`, no matched values
    Bytes exceptions = {std::byte{0}};  // none
    Bytes weights = {std::byte{0}};     // the usual ones for all classes
    Bytes tables = {std::byte{1}, std::byte{0}, std::byte{0}};  // one table, only the length 0
    std::uint64_t words = 0, state = std::uint64_t{1} << 31;
    Bytes words_bytes, low_bits, after;
  };
  Bytes with_weighted(const WeightedPart& part) const {
    ByteWriter out;
    out.put_varint(part.count);
    out.put_u8(part.head);
    out.put_signed(0);
    for (const Bytes* bytes : {&part.exceptions, &part.weights, &part.tables})
      out.put_bytes(*bytes);
    out.put_varint(part.words);
    out.put_u64(part.state);
    out.put_bytes(part.words_bytes);
    out.put_varint(part.low_bits.size());
    out.put_bytes(part.low_bits);
    out.put_bytes(part.after);
    return with_parts("steps_and_extras", [&](container::StepHeader& header, Bytes& values) {
      if (header.array != 1 || header.step != 0) return;
      header.codec = container::Codec::weighted;
      values = out.bytes;
    });
  }

  void copied_components() {
    WeightedPart part;
    part.head = 7;
    add(kCorrupt, "Weighted values: a component that is a copy of itself.", with_weighted(part));
  }

  void histories() {
    WeightedPart part;
    part.head = 1 << 6 | 3 << 3;
    add(kCorrupt, "Weighted values: a bit of the head that has no meaning.", with_weighted(part));
    add(kCorrupt, "Weighted values: a weight above 64 in a history.",
        with_parts("weighted_history", [](container::StepHeader& header, Bytes& values) {
          if (header.codec != container::Codec::weighted) return;
          ByteReader in(values);
          ByteWriter out;
          out.put_varint(in.get_varint());
          const std::uint8_t head = in.get_u8();
          if (head >> 5 != 1) return;  // has no history
          out.put_u8(head);
          out.put_signed(in.get_signed());
          in.get_signed();
          out.put_signed((1 << 26) + 1);
          out.put_bytes(in.get_bytes(in.left()));
          values = std::move(out.bytes);
        }));
  }

  /// Returns the file `name`. In each stream of the kind `kind` that is coded as terms, `change`
  /// has changed the list of copied vertices, or added a list.
  Bytes with_copies(const std::string& name, container::StreamKind kind,
                    const std::function<void(std::vector<std::uint32_t>&)>& change) const {
    return with(name, [&](FileParts& parts) {
      for (Chunk& chunk : parts.chunks) {
        if (!chunk.is(ChunkKind::group)) continue;
        auto group = take_group_apart(chunk);
        for (std::size_t s = 0; s < group->streams.size(); ++s) {
          const container::StreamEntry& entry = group->header.streams[s];
          if (entry.kind != kind || entry.codec != container::Codec::terms) continue;
          ByteReader in(group->streams[s]);
          ByteWriter out;
          Bytes scratch;
          ZstdCompressor packing;
          ZstdDecompressor unpacking;
          const std::uint64_t count = in.get_varint();
          std::vector<std::uint32_t> back(to_size(count));
          if (group->streams[s][in.position()] == std::byte{kCopiedVertices}) {
            in.get_u8();
            EXPECT_TRUE(get_numbers(in, count, back, scratch, unpacking));
          }
          change(back);
          out.put_varint(count);
          out.put_u8(kCopiedVertices);
          put_numbers(out, back, scratch, packing);
          out.put_bytes(in.get_bytes(in.left()));
          group->streams[s] = std::move(out.bytes);
        }
        chunk.payload = put_group_together(std::move(*group));
      }
      list_anew(parts);
    });
  }

  void copies_of_vertices() {
    using enum container::StreamKind;
    EXPECT_TRUE(text_of_file(with_copies("copied_vertices", geometry, [](auto&) {})));
    add(kCorrupt, "Values by terms: the first vertex of a group is a copy.",
        with_copies("copied_vertices", geometry, [](auto& back) { back[0] = 1; }));
    add(kCorrupt, "Values by terms: a list of copied vertices in a column of cells.",
        with_copies("patterns_arrays", array, [](auto&) {}));
  }

  void weighted_parts() {
    EXPECT_TRUE(decode_in_pieces(with_weighted({})));
    const auto of = [&](const std::string& sentence,
                        const std::function<void(WeightedPart&)>& lie) {
      WeightedPart part;
      lie(part);
      add(kCorrupt, "Weighted values: " + sentence, with_weighted(part));
    };
    const auto bytes = [](std::initializer_list<int> numbers) {
      Bytes all;
      for (const int number : numbers) all.push_back(static_cast<std::byte>(number));
      return all;
    };
    of("of one element too many.", [](WeightedPart& it) { it.count = 13; });
    of("a domain that does not exist.", [](WeightedPart& it) { it.head = 7 | 3 << 3; });
    of("the domain of integers.", [](WeightedPart& it) { it.head = 5 | 3 << 3; });
    of("the domain of quantized values.", [](WeightedPart& it) { it.head = 6 | 3 << 3; });
    of("a history without references.", [](WeightedPart& it) { it.head = 4 << 3; });
    of("an exception after the last element.", [&](WeightedPart& it) {
      it.exceptions = bytes({1, 12, 0, 0, 0, 0});
    });
    of("more exceptions than bytes.", [&](WeightedPart& it) {
      it.exceptions = bytes({0xff, 0xff, 0x7f});
    });
    of("weights of a class that does not exist.", [&](WeightedPart& it) {
      it.weights = bytes({2, 200, 1});
    });
    of("a weight of 16.", [&](WeightedPart& it) {
      it.weights = bytes({2, 7, 0x80, 0x80, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
    });
    of("no table.", [&](WeightedPart& it) { it.tables = bytes({0}); });
    of("a table of no contexts.", [&](WeightedPart& it) { it.tables = bytes({2, 0, 0, 0, 0, 0}); });
    of("a table of too many contexts.", [&](WeightedPart& it) {
      it.tables = bytes({2, 132, 0, 0, 0, 0});
    });
    of("a length of 66.", [&](WeightedPart& it) { it.tables = bytes({1, 66, 66}); });
    of("lengths in descending order.", [&](WeightedPart& it) { it.tables = bytes({1, 1, 0}); });
    of("a frequency above 4096.", [&](WeightedPart& it) {
      it.tables = bytes({1, 0, 1, 0x81, 0x20});
    });
    of("a last frequency of 0.", [&](WeightedPart& it) {
      it.tables = bytes({1, 0, 1, 0x80, 0x20});
    });
    of("a state below 2^31.", [](WeightedPart& it) { it.state -= 1; });
    of("a state of 2^63.", [](WeightedPart& it) { it.state = std::uint64_t{1} << 63; });
    of("a last state above 2^31.", [](WeightedPart& it) { it.state += 1; });
    of("more words than bytes.", [](WeightedPart& it) { it.words = 1000; });
    of("a word that is not read.", [](WeightedPart& it) {
      it.words = 1;
      it.words_bytes = Bytes(4);
    });
    of("too few words.", [&](WeightedPart& it) { it.tables = bytes({1, 0, 1, 1}); });
    of("a matched value without an axis.", [&](WeightedPart& it) {
      it.tables = bytes({1, 65, 65});
    });
    of("too few low bits.", [&](WeightedPart& it) { it.tables = bytes({1, 3, 3}); });
    of("low bits that are not read.", [](WeightedPart& it) { it.low_bits = Bytes(1); });
    of("bytes after the last component.", [](WeightedPart& it) { it.after = Bytes(1); });
    add(kCorrupt, "Weighted values: in a group of patterns.",
        with("patterns_steps", [&](FileParts& parts) {
          Chunk& chunk = *parts.find(ChunkKind::step_values);
          auto steps = take_steps_apart(chunk);
          steps->heads[0].header.codec = container::Codec::weighted;
          chunk.payload = put_steps_together(std::move(*steps), chunk.header.version);
          list_anew(parts);
        }));
  }

  void scaled_copies() {
    const auto with_factor = [&](const std::function<void(Columns&)>& lie) {
      Columns columns;
      columns.second = 2 | 1 << 2;
      ByteWriter details;
      details.put_u8(1);
      details.put_f64(-1.5);
      columns.details.insert(columns.details.end(), details.bytes.begin(), details.bytes.end());
      lie(columns);
      return with_columns(columns);
    };
    EXPECT_TRUE(decode_in_pieces(with_factor([](Columns&) {})));
    const auto of = [&](const std::string& sentence, const std::function<void(Columns&)>& lie) {
      add(kCorrupt, "Scaled copy: " + sentence, with_factor(lie));
    };
    of("shape 2.", [](Columns& it) { it.second = 2 | 2 << 2; });
    of("a predictor.", [](Columns& it) { it.second |= 1 << 4; });
    of("a factor that ends early.", [](Columns& it) { it.details.pop_back(); });
    of("an infinite factor.", [](Columns& it) {
      it.details[it.details.size() - 1] = std::byte{0x7f};
      it.details[it.details.size() - 2] = std::byte{0xf0};
    });
  }

  /// The coded special values of a stream or a part.
  struct Special {
    Bytes values = Bytes(8, std::byte{0xff});
    std::uint8_t different = 1;
    std::uint64_t runs = 2;
    Bytes gaps = {std::byte{3}, std::byte{1}}, lengths = {std::byte{2}, std::byte{1}}, indices{};
    bool are_those_of_reference = false;
    std::uint64_t gap_bytes_more = 0;
    std::size_t bytes_after = 0;

    Bytes packed() const {
      ByteWriter blob, head, out;
      blob.put_u8(are_those_of_reference ? 0 : different);
      if (!are_those_of_reference) {
        blob.put_bytes(values);
        blob.put_varint(runs);
        blob.put_varint(gaps.size() + gap_bytes_more);
        blob.put_varint(lengths.size());
        for (const Bytes& bytes : {gaps, lengths, indices}) blob.put_bytes(bytes);
      }
      blob.put_bytes(Bytes(bytes_after));
      put_packed(head, blob.bytes, Packing::bounded);
      out.put_varint(head.bytes.size());
      out.put_bytes(head.bytes);
      return std::move(out.bytes);
    }
  };
  /// Adds special values to the last stream of values in the first group of the file.
  Bytes with_special(const std::string& name, const Special& special,
                     std::optional<std::size_t> stream = std::nullopt) const {
    return with(name, [&](FileParts& parts) {
      Chunk& chunk = *parts.find(ChunkKind::group);
      auto group = take_group_apart(chunk);
      const std::size_t s = stream.value_or(group->streams.size() - 1);
      Bytes bytes = special.packed();
      bytes.insert(bytes.end(), group->streams[s].begin(), group->streams[s].end());
      group->streams[s] = std::move(bytes);
      container::StreamEntry& entry = group->header.streams[s];
      entry.codec = static_cast<Codec>(static_cast<std::uint8_t>(entry.codec) | 128);
      chunk.payload = put_group_together(std::move(*group));
      list_anew(parts);
    });
  }

  void special_values_in_groups() {
    const std::string name = "rows_of_doubles";
    files_.push_back({name, rows_of_cells(ConnectivityCodec::rows, Level::standard)});
    EXPECT_TRUE(decode_in_pieces(with_special(name, {})));
    const auto of = [&](const std::string& sentence, const std::function<void(Special&)>& lie) {
      Special special;
      lie(special);
      add(kCorrupt, "Special values: " + sentence, with_special(name, special));
    };
    of("none.", [](Special& it) {
      it.runs = 0;
      it.gaps = it.lengths = {};
    });
    of("no values.", [](Special& it) {
      it.different = 0;
      it.values = {};
    });
    of("those of a reference, without a reference.",
       [](Special& it) { it.are_those_of_reference = true; });
    of("a run of no scalars.", [](Special& it) { it.lengths[1] = std::byte{0}; });
    of("a run after the last element.", [](Special& it) { it.gaps[1] = std::byte{127}; });
    of("a run that ends after the last element.",
       [](Special& it) { it.lengths[1] = std::byte{127}; });
    of("too few gaps.", [](Special& it) { it.gaps.pop_back(); });
    of("a gap too many.", [](Special& it) { it.gaps.push_back(std::byte{1}); });
    of("a length too many.", [](Special& it) { it.lengths.push_back(std::byte{1}); });
    of("gaps beyond the end.", [](Special& it) { it.gap_bytes_more = 100; });
    of("a value without indices.", [](Special& it) {
      it.different = 2;
      it.values.resize(16);
    });
    of("an index of no value.", [](Special& it) {
      it.different = 2;
      it.values.resize(16);
      it.indices = {std::byte{1}, std::byte{2}};
    });
    of("bytes after the end.", [](Special& it) { it.bytes_after = 1; });
    add(kCorrupt, "Special values: of integers.", with_special(name, {}, stream_of_integers(name)));
    add(ErrorCode::unsupported, "Special values: of coordinates.",
        with_special(name, {}, stream_of_integers(name) - 1));
  }
  /// Returns the position of the stream of the first static array in the first group of the file.
  std::size_t stream_of_integers(const std::string& name) const {
    FileParts parts = take_apart(file(name));
    const auto group = take_group_apart(*parts.find(ChunkKind::group));
    const auto& streams = group->header.streams;
    const auto is_array = [](const auto& entry) {
      return entry.kind == container::StreamKind::array;
    };
    return static_cast<std::size_t>(std::find_if(streams.begin(), streams.end(), is_array) -
                                    streams.begin());
  }

  void special_values_in_parts() {
    // The last chunk of step values contains one part, which refers to an earlier step.
    const auto with_part = [&](const Special& special) {
      return with("patterns_steps_that_rise", [&](FileParts& parts) {
        const auto chunk =
            std::find_if(parts.chunks.rbegin(), parts.chunks.rend(),
                         [](const Chunk& it) { return it.is(ChunkKind::step_values); });
        auto steps = take_steps_apart(*chunk);
        container::StepHeader& header = steps->heads.back().header;
        EXPECT_NE(header.reference_step, header.step);
        header.codec = static_cast<Codec>(static_cast<std::uint8_t>(header.codec) | 128);
        Bytes bytes = special.packed();
        bytes.insert(bytes.end(), steps->values.back().begin(), steps->values.back().end());
        steps->values.back() = std::move(bytes);
        chunk->payload = put_steps_together(std::move(*steps), chunk->header.version);
        list_anew(parts);
      });
    };
    EXPECT_TRUE(decode_in_pieces(with_part({})));
    Special of_reference, beyond;
    of_reference.are_those_of_reference = true;
    beyond.gaps[1] = std::byte{127};
    beyond.lengths[0] = std::byte{127};
    add(kCorrupt, "Special values of a part: those of a reference without any.",
        with_part(of_reference));
    add(kCorrupt, "Special values of a part: after the last element.", with_part(beyond));
  }

  void fill_values() {
    const auto of = [&](const std::string& sentence, const std::function<void(Schema&)>& lie) {
      Schema schema = hexahedra_schema();
      schema.arrays.push_back(array_of("a", Location::cell, ScalarType::float32));
      schema.arrays[0].fills = {-9999};
      lie(schema);
      FileParts parts;
      parts.chunks.push_back(chunk_of(ChunkKind::schema, schema_payload(schema)));
      add(kCorrupt, "Fill value: " + sentence, put_together(std::move(parts)));
    };
    of("not a number.", [](Schema& it) { it.arrays[0].fills[0] = std::nan(""); });
    of("not a number of the type.", [](Schema& it) { it.arrays[0].fills[0] = .1; });
    of("of integers.", [](Schema& it) { it.arrays[0].type = ScalarType::int64; });
    of("one too many.", [](Schema& it) { it.arrays[0].fills.assign(17, 1.5); });
  }

  /// Adds files with a blob of zeros that unpacks to more bytes than its packed size permits.
  void large_blobs() {
    constexpr std::uint64_t kZeros = (std::uint64_t{1} << 24) + (std::uint64_t{1} << 19);
    const auto of = [&](const std::string& sentence, ChunkKind kind, std::uint8_t version) {
      add(kCorrupt, sentence + " of 2^24 + 2^19 bytes, packed into 600.",
          with("keep", [&](FileParts& parts) {
            Chunk chunk = chunk_of(kind, packed_zeros({}, kZeros));
            chunk.header.version = version;
            insert(parts, 1, std::move(chunk));
            list_anew(parts);
          }));
    };
    of("Step times:", ChunkKind::step_times, 0);
    of("Extras: a blob", ChunkKind::extra, 1);
    add(kCorrupt, "Schema: a blob of 2^24 + 2^19 bytes, packed into 600.",
        with("keep", [&](FileParts& parts) {
          ByteWriter payload;
          container::put_version(payload, parts.start);
          payload.put_bytes(packed_zeros({}, kZeros));
          parts.chunks[0].payload = std::move(payload.bytes);
          list_anew(parts);
        }));
  }

  void arrays_beside_mesh() {
    const auto of = [&](const std::string& sentence, const std::function<void(ArrayInfo&)>& lie,
                        ErrorCode code = kCorrupt) {
      Schema schema = hexahedra_schema();
      schema.arrays.push_back(array_of("a", Location::node_set, ScalarType::float32));
      schema.arrays[0].per_step = true;
      schema.arrays[0].elements = 4;
      lie(schema.arrays[0]);
      FileParts parts;
      parts.chunks.push_back(chunk_of(ChunkKind::schema, schema_payload(schema)));
      add(code, "Array beside the mesh: " + sentence, put_together(std::move(parts)));
    };
    of("location 6.", [](ArrayInfo& it) { it.location = static_cast<Location>(6); });
    of("without time steps.", [](ArrayInfo& it) { it.per_step = false; });
    of("a global array on sets.", [](ArrayInfo& it) {
      it.location = Location::global;
      it.blocks = {0};
    });
    of("the same set twice.", [](ArrayInfo& it) { it.blocks = {3, 3}; });
    of(
        "of 2^28 + 1 elements.", [](ArrayInfo& it) { it.elements = (1u << 28) + 1; },
        ErrorCode::over_limit);
    of(
        "of 2^64 - 1 elements.", [](ArrayInfo& it) { it.elements = ~std::uint64_t{0}; },
        ErrorCode::over_limit);
    using Header = container::StepHeader;
    const auto of_part = [&](const std::string& sentence, const std::function<void(Header&)>& lie) {
      add(kCorrupt, "Step values of sets: " + sentence,
          with_parts("steps_beside_mesh", [&](container::StepHeader& header, Bytes&) {
            if (header.array == 3 && header.step == 0) lie(header);
          }));
    };
    of_part("of the second group.", [](Header& it) { it.group = 1; });
    of_part("of one element too few.", [](Header& it) { it.count -= 1; });
    of_part("weighted.", [](Header& it) { it.codec = container::Codec::weighted; });
    of_part("in columns.", [](Header& it) { it.codec = container::Codec::columns; });
  }

  void relative_bounds_of_schema() {
    const auto of = [&](const std::string& sentence, const std::function<void(Schema&)>& lie) {
      Schema schema = hexahedra_schema();
      schema.arrays.push_back(array_of("a", Location::cell, ScalarType::float32));
      schema.arrays[0].quantization = Quantization::relative(.001, ScalarType::float32);
      lie(schema);
      FileParts parts;
      parts.chunks.push_back(chunk_of(ChunkKind::schema, schema_payload(schema)));
      add(kCorrupt, "Relative bound: " + sentence, put_together(std::move(parts)));
    };
    of("0.", [](Schema& it) { it.arrays[0].quantization.max_rel = 0; });
    of("not a number.", [](Schema& it) { it.arrays[0].quantization.max_rel = std::nan(""); });
    of("above 0.5.", [](Schema& it) { it.arrays[0].quantization.max_rel = .75; });
    of("a distance of 1.", [](Schema& it) { it.arrays[0].quantization.spacing = 1; });
    of("a distance above 2^23.", [](Schema& it) { it.arrays[0].quantization.spacing = 8388609; });
    of("of integers.", [](Schema& it) { it.arrays[0].type = ScalarType::int32; });
    of("of coordinates.", [](Schema& it) {
      it.coordinate_quantization = Quantization::relative(.001, ScalarType::float32);
    });
    of("quantization of 66 bits.", [](Schema& it) { it.arrays[0].quantization.bits = 66; });
  }

  void digests() {
    // Changes the first chunk of a kind that has, or has not, a bundle.
    const auto of = [&](ErrorCode code, const std::string& sentence, ChunkKind kind, bool is_bundle,
                        const std::function<void(Chunk&)>& change) {
      add(code, "Digest: " + sentence, with("digests", [&](FileParts& parts) {
            for (Chunk& chunk : parts.chunks)
              if (chunk.is(kind) && is_bundle == (container::without_digest(chunk.header.version) ==
                                                  container::kBundleVersion))
                return change(chunk);
          }));
    };
    const auto flip = [](Chunk& chunk) { chunk.payload[3] ^= std::byte{1}; };
    const auto flip_of_group = [](Chunk& chunk) {
      auto group = take_group_apart(chunk);
      group->header.digest ^= 1;
      chunk.payload = put_group_together(std::move(*group));
    };
    of(kCorrupt, "not that of the content of a group.", ChunkKind::group, false, flip_of_group);
    of(kCorrupt, "not that of step values.", ChunkKind::step_values, false, flip);
    of(kCorrupt, "not that of the step values of a bundle.", ChunkKind::step_values, true, flip);
    of(kCorrupt, "not that of step times.", ChunkKind::step_times, false, flip);
    of(kCorrupt, "not the sum of those of all chunks.", ChunkKind::index, false, flip);
    of(kCorrupt, "longer than the payload.", ChunkKind::step_times, false,
       [](Chunk& chunk) { chunk.payload.resize(7); });
    of(kUnsupported, "of a group of version 0.", ChunkKind::group, false,
       [](Chunk& chunk) { chunk.header.version = container::kWithDigest; });
    add(kUnsupported, "Digest: of an extra.", with("steps_and_extras", [](FileParts& parts) {
          parts.find(ChunkKind::extra)->header.version += container::kWithDigest;
        }));
    of(kUnsupported, "of a group of version 9.", ChunkKind::group, false, [](Chunk& chunk) {
      chunk.header.version += container::kWithDigest;
      chunk.header.is_long = true;
    });
  }

  void commits() {
    // Changes the index of the last commit.
    const auto of = [&](const std::string& sentence,
                        const std::function<void(container::Index&)>& change) {
      add(kCorrupt, "Commit: " + sentence, with("live", [&](FileParts& parts) {
            Chunk& chunk = parts.chunks.back();
            ByteReader in(chunk.payload);
            container::Index index;
            container::get(in, index, chunk.header.version, 1 << 20);
            change(index);
            ByteWriter out;
            container::put(out, index);
            chunk.payload = std::move(out.bytes);
          }));
    };
    of("previous_index where no chunk begins.", [](container::Index& i) { ++i.previous_index; });
    of("previous_index where a chunk of another kind begins.",
       [](container::Index& i) { i.previous_index = container::kFileStartBytes; });
    of("previous_index 0, but not all chunks are listed.",
       [](container::Index& i) { i.previous_index = 0; });
    of("one chunk fewer than there are.", [](container::Index& i) { i.entries.pop_back(); });
    of("fewer steps than there are.", [](container::Index& i) { --i.steps; });
    const auto times = [](FileParts& parts) {
      return parts.find(ChunkKind::step_times, 3);  // of the fourth commit
    };
    add(kCorrupt, "Commit: step times that skip a step.",
        with("live", [&](FileParts& parts) { times(parts)->payload[0] = std::byte{4}; }));
    add(kCorrupt, "Commit: a group after the first index.", with("live", [](FileParts& parts) {
          const auto group = *parts.find(ChunkKind::group);
          const auto index = std::find_if(parts.chunks.begin(), parts.chunks.end(),
                                          [](auto& it) { return it.is(ChunkKind::index); });
          parts.chunks.insert(index + 1, group);
        }));
    const Bytes& live = file("live");
    add(kTruncated, "Commit: the file ends within the last index.",
        first_bytes("live", live.size() - 1));
    add(kTruncated,
        "Commit: a chunk after the last index is not complete, and an extra holds an index.",
        torn_with_forged_index());
  }

  /// Returns a live file whose last chunk is cut. An extra before it holds a whole file, with its
  /// trailer.
  Bytes torn_with_forged_index() {
    const Bytes forged = file("one_hexahedron");
    MemorySink sink;
    EXPECT_TRUE(write_mesh(bent_grid(1, 1, 1), sink, {}, [&](Writer& writer) -> Result<void> {
      if (auto status = writer.commit(); !status) return status;
      if (auto status = writer.add_extra(
              {"forged", ScalarType::uint8, Reference::nothing, {forged.size()}, forged});
          !status)
        return status;
      return writer.add_extra({"last", ScalarType::uint8, Reference::nothing, {1}, Bytes(1)});
    }));
    sink.bytes.resize(sink.bytes.size() - 1);
    return std::move(sink.bytes);
  }

  void references_to_bases() {
    // Changes the first part of the array "fixed" at a step.
    const auto of = [&](const std::string& sentence, std::uint64_t step, StepReference kind,
                        std::uint64_t reference_step) {
      add(kCorrupt, "Base: " + sentence,
          with_parts("steps_on_bases", [&](container::StepHeader& header, Bytes&) {
            if (header.array != 0 || header.step != step || header.group != 0) return;
            header.reference = kind;
            header.reference_step = reference_step;
          }));
    };
    of("a key step refers to the step before as its base.", 3, StepReference::base, 2);
    of("the second group refers to the base, the first to the step before.", 3,
       StepReference::before, 2);
    of("the second group refers to the base, the first to no step.", 3, StepReference::nothing, 3);
    of("a trend after a key step.", 4, StepReference::trend, 3);
    of("a base after the step.", 3, StepReference::base, 4);
  }

  std::vector<FeatureFile> files_;
  std::vector<FaultyFile> faulty_;
};

/// Returns the faulty files in the order of their numbers, which start at 1.
inline std::vector<FaultyFile> faulty_files() { return FaultyFiles().take(); }

}  // namespace shm
