// Format: signature, chunk header, schema, group directory, index: plain structs with a put and a
// get each, one under the other. Fields stand in the order of the bytes.
// The container knows chunks and bitstreams; it does not know what a hexahedron is.
// spec: "Container"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bytes/binary.h"
#include "bytes/codec.h"
#include "shm/schema.h"

namespace shm {

/// The codecs of cells, how callers name them, and the word for it.
struct NamedCodec {
  ConnectivityCodec name;
  Codec codec;
  std::string_view word;
};
inline constexpr NamedCodec kConnectivityCodecs[] = {
    {ConnectivityCodec::paper, Codec::paper, "paper"},
    {ConnectivityCodec::rows, Codec::rows, "rows"},
    {ConnectivityCodec::replay, Codec::replay, "replay"},
    {ConnectivityCodec::mixed, Codec::mixed, "mixed"},
    {ConnectivityCodec::shifts, Codec::shifts, "shifts"},
    {ConnectivityCodec::patterns, Codec::patterns, "patterns"},
};
/// Must hold: not automatic.
constexpr Codec stream_codec(ConnectivityCodec name) {
  for (const NamedCodec& it : kConnectivityCodecs)
    if (it.name == name) return it.codec;
  return Codec::rows;
}
/// Nothing for a codec of other streams, or an unknown one.
constexpr std::optional<ConnectivityCodec> connectivity_codec(Codec codec) {
  for (const NamedCodec& it : kConnectivityCodecs)
    if (it.codec == codec) return it.name;
  return std::nullopt;
}

}  // namespace shm

namespace shm::container {

/// Like PNG's: a byte with the high bit set, the name, CR LF, end-of-file of old systems, LF.
inline constexpr std::array<std::uint8_t, 8> kSignature = {0x89, 'S',  'H',  'M',
                                                           '\r', '\n', 0x1a, '\n'};
inline constexpr std::uint16_t kMajor = 0, kMinor = 10;
/// Features that a reader of one mesh must know. None so far.
inline constexpr std::uint32_t kKnownFeatures = 0;
/// What follows is no mesh, but whole files one after the other, and a list of them.
inline constexpr std::uint32_t kArchiveFeature = 1u << 2;

/// The first 16 bytes of a file; the 8 after the signature stand again in the schema chunk, where
/// a checksum covers them.
struct FileStart {
  std::uint16_t major = kMajor, minor = kMinor;
  std::uint32_t needed_features = 0;
  bool operator==(const FileStart&) const = default;
};
/// Whether this reader reads that version: 0.1 and 0.9, which have the same bytes, and 0.10. There
/// was none between them.
inline bool is_known_version(const FileStart& start) {
  return start.major == kMajor && (start.minor == 1 || start.minor == 9 || start.minor == kMinor);
}
/// Whether values in a file of that version may be coded by earlier ones.
inline bool has_earlier_values(const FileStart& start) { return start.minor >= 10; }
/// Whether blobs unpack to no more than most_unpacked() (bytes/packing.h).
inline bool has_bounded_blobs(const FileStart& start) { return start.minor >= 10; }
inline constexpr std::size_t kFileStartBytes = 16;
void put(ByteWriter& out, const FileStart& start);
/// The bytes after the signature.
void put_version(ByteWriter& out, const FileStart& start);
void get_version(ByteReader& in, FileStart& start);
/// False when the signature is wrong.
bool get(ByteReader& in, FileStart& start);

enum class ChunkKind : std::uint8_t {
  schema = 1,
  group = 2,
  step_values = 3,
  step_times = 4,
  extra = 5,
  index = 6,
  members = 9,  ///< of archives, which have no other
};
std::string chunk_name(std::uint8_t kind);

// Headers of chunks are short or long, and their mark tells which.
inline constexpr std::uint32_t kShortMark = 0x634d4853;  // "SHMc"
inline constexpr std::uint32_t kLongMark = 0x434d4853;   // "SHMC"
inline constexpr std::size_t kShortHeaderBytes = 22, kLongHeaderBytes = 32;
inline constexpr std::uint8_t kChunkOptional =
    1;  ///< flag: a reader may skip what it does not know

struct ChunkHeader {
  std::uint8_t kind = 0;
  std::uint8_t version = 0;
  std::uint8_t flags = 0;
  bool is_long = false;        ///< as the file has it, or shall have it
  std::uint32_t sequence = 0;  ///< 0, 1, 2, ... through the file
  std::uint32_t segment = 0;   ///< groups: 0, 0, ..., 1, 1, ...; all other kinds: 0
  std::uint64_t payload_bytes = 0;
  std::uint32_t payload_checksum = 0;

  std::size_t bytes() const { return is_long ? kLongHeaderBytes : kShortHeaderBytes; }
  /// With its payload.
  std::uint64_t chunk_bytes() const { return bytes() + payload_bytes; }
};
/// Whether a file of that version has the header in its long form, but for its number: all before
/// 0.10 have, and chunks that are large.
bool has_long_header(const ChunkHeader& header, const FileStart& start);
void put(ByteWriter& out, const ChunkHeader& header);
enum class HeaderState { good, bad_mark, bad_checksum };
/// Takes its bytes from `in`, where it is good, else some. Must hold: kShortHeaderBytes are left; a
/// long one that is cut has a bad checksum.
HeaderState get(ByteReader& in, ChunkHeader& header);
/// How many bytes tell the header that begins so; of what begins none, kShortHeaderBytes.
std::size_t header_bytes(std::span<const std::byte> beginning);
/// Which version a chunk has in a file of that version.
inline std::uint8_t version_of_chunk(ChunkKind kind, const FileStart& start) {
  const bool has_version_1 = kind == ChunkKind::group || kind == ChunkKind::step_values ||
                             kind == ChunkKind::extra || kind == ChunkKind::index;
  return start.minor >= 10 && has_version_1 ? 1 : 0;
}
/// Whether this reader knows how to read such a chunk of a mesh.
bool is_known(const ChunkHeader& header);

/// What a bitstream of a group holds.
enum class StreamKind : std::uint8_t {
  connectivity = 1,
  corner_order = 2,
  cell_numbers = 3,
  vertex_numbers = 4,
  geometry = 5,
  array = 6,    ///< `array` is its number
  imports = 7,  ///< which vertices an earlier segment owns
};
std::string stream_name(StreamKind kind);

using shm::Codec;

struct StreamEntry {
  StreamKind kind = StreamKind::connectivity;
  std::uint32_t array = 0;  ///< only for StreamKind::array
  Codec codec = Codec::rows;
  std::uint32_t needs = 0;  ///< version 0: bit per StreamKind that must be decoded with it
  std::uint64_t bytes = 0;
  std::uint32_t checksum = 0;
};

/// The head of a group chunk's payload; the bitstreams follow it in order. It has a checksum of its
/// own, so that a stream can be read alone.
struct GroupHeader {
  std::uint8_t version = version_of_chunk(ChunkKind::group, {});
  std::uint64_t first_cell = 0, first_vertex = 0;
  std::uint32_t cells = 0;              ///< 0..2^20
  std::uint64_t vertices = 0;           ///< all that are introduced in it and that its segment owns
  std::uint64_t imported_vertices = 0;  ///< introduced in it again: an earlier segment owns them
  std::uint64_t unused_vertices = 0;    ///< the last of them, which no cell uses
  std::uint64_t max_active_vertices = 0;
  std::uint64_t decoded_bytes = 0;  ///< values and corners, unpacked
  std::array<double, 6> box{};  ///< min x y z, max x y z of finite coordinates; +inf -inf if none
  std::vector<StreamEntry> streams;
};
inline constexpr std::uint32_t kMaxGroupCells = 1u << 20;
/// The codec of its connectivity, which stands first; nothing where there are no cells.
inline std::optional<Codec> connectivity_of(const GroupHeader& header) {
  if (header.streams.empty() || header.streams[0].kind != StreamKind::connectivity)
    return std::nullopt;
  return header.streams[0].codec;
}
void put(ByteWriter& out, const GroupHeader& header);
bool get(ByteReader& in, GroupHeader& header, std::uint8_t version);

/// The chunk of a group: where it stands, and which group of the file it is.
struct GroupChunk {
  std::vector<std::byte> payload;
  std::uint8_t version = 0;
  std::uint64_t offset = 0, number = 0;
};

/// What the values of one array at one step in one group are.
struct StepHeader {
  std::uint32_t array = 0;
  std::uint64_t step = 0;
  std::uint64_t reference_step = 0;  ///< == step: no other step is needed
  bool trend = false;                ///< the reference goes on from the step before it
  std::uint32_t group = 0;           ///< the elements are those of this group; from 0 in the file
  std::uint64_t count = 0;           ///< elements, at least 1
  Codec codec = Codec::columns;
};
/// What the values refer to.
inline StepReference refers_to(const StepHeader& header) {
  return header.reference_step == header.step ? StepReference::nothing
         : header.trend                       ? StepReference::trend
                                              : StepReference::before;
}
/// A part of a step_values payload: what the values are, and how many bytes they are coded in.
struct StepPart {
  StepHeader header;
  std::uint64_t bytes = 0;
};
/// So many parts may stand together, and so many bytes of them do as a rule.
inline constexpr std::size_t kMostStepParts = 64, kPartBytesTogether = 4096;
/// The heads of all parts; their coded bytes follow. Version 0 has one part, of all bytes left.
void put(ByteWriter& out, std::span<const StepPart> parts, std::uint8_t version);
/// `payload_bytes`: of the whole payload, of which `in` has at least the heads.
bool get(ByteReader& in, std::vector<StepPart>& parts, std::uint8_t version,
         std::uint64_t payload_bytes);
/// The heads of so many parts take at most so many bytes.
constexpr std::uint64_t most_step_head_bytes(std::uint64_t parts) { return 16 + 64 * parts; }
inline constexpr std::uint64_t kMostStepHeadBytes = most_step_head_bytes(kMostStepParts);

/// What the index tells of a part of a step_values chunk.
struct StepEntry {
  std::uint32_t array = 0;
  std::uint64_t step = 0, first = 0, count = 0;
  std::uint32_t group = 0;
  StepReference reference = StepReference::nothing;
  Codec codec = Codec::columns;
};
/// All but `first`.
StepEntry entry_of(const StepHeader& header);

/// One line of the index.
struct IndexEntry {
  bool is(ChunkKind of) const { return kind == static_cast<std::uint8_t>(of); }

  std::uint8_t kind = 0;
  std::uint64_t offset = 0, bytes = 0;  ///< of the whole chunk, header included
  std::uint32_t segment = 0;            ///< groups
  std::uint64_t first_cell = 0, cells = 0, first_vertex = 0, vertices = 0;  ///< groups
  std::array<double, 6> box{};                                              ///< groups
  std::uint64_t header_bytes = 0;  ///< groups: where their streams begin
  std::vector<StepEntry> parts;    ///< step values
};
struct NamedBytes {
  std::string name;
  std::uint64_t bytes = 0;
  bool operator==(const NamedBytes&) const = default;
};
/// Smallest and largest finite value of each component of a static array, as doubles.
struct ArrayRange {
  std::uint32_t array = 0;
  std::vector<double> minimum, maximum;
};
struct Index {
  std::uint8_t version = version_of_chunk(ChunkKind::index, {});
  std::uint64_t previous_index = 0;  ///< offset of the index chunk before, 0 = none
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0, max_active_vertices = 0, steps = 0;
  std::uint64_t segments = 0, imported_vertices = 0;
  std::vector<std::uint64_t> block_cells;
  std::vector<NamedBytes> streams;  ///< version 0: all but the container's
  std::vector<ArrayRange> ranges;   ///< version 0: of the static arrays
  std::vector<IndexEntry> entries;
};
void put(ByteWriter& out, std::span<const NamedBytes> streams);
bool get(ByteReader& in, std::vector<NamedBytes>& streams);
void put(ByteWriter& out, const Index& index);
/// All that is left of `in`. `max_entries`: chunks there can be; more lines than that are damage.
bool get(ByteReader& in, Index& index, std::uint8_t version, std::uint64_t max_entries);

/// One line of an archive's list of members.
struct Member {
  std::string name;
  std::uint64_t bytes = 0;
};
struct MemberList {
  FileStart start;  ///< again, under a checksum
  std::vector<Member> members;
};
void put(ByteWriter& out, const MemberList& list);
bool get(ByteReader& in, MemberList& list);

/// The last 16 bytes behind an index or members chunk: where it begins, a checksum, "SHME".
inline constexpr std::size_t kTrailerBytes = 16;
inline constexpr std::uint32_t kTrailerMark = 0x454d4853;  // "SHME"
void put_trailer(ByteWriter& out, std::uint64_t index_offset);
bool get_trailer(ByteReader& in, std::uint64_t& index_offset);

}  // namespace shm::container
