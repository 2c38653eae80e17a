// Byte layout of a file: signature, chunk header, group header, step values, index, trailer. Each
// of these is a plain struct with a function put() and a function get(), whose bodies match line by
// line. The fields are in the order of the bytes. This layer describes chunks and bitstreams, and
// is independent of cell shapes.
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

#include "base/binary.h"
#include "shm/schema.h"

namespace shm {

enum class Codec : std::uint8_t;  // the codec ids are in codecs/shared/codec_id.h

}  // namespace shm

namespace shm::container {

/// Signature of a file, similar to that of PNG: a byte whose high bit is set, the name, CR LF, the
/// end-of-file character of DOS, LF.
inline constexpr std::array<std::uint8_t, 8> kSignature = {0x89, 'S',  'H',  'M',
                                                           '\r', '\n', 0x1a, '\n'};
inline constexpr std::uint16_t kMajor = 0, kMinor = 10;
/// Feature bits that a reader of a single mesh supports. No such bits are defined so far.
inline constexpr std::uint32_t kKnownFeatures = 0;
/// Feature bit of an archive. An archive contains a sequence of complete files and a list of these
/// files, instead of a mesh.
inline constexpr std::uint32_t kArchiveFeature = 1u << 2;

/// First 16 bytes of a file. The schema chunk contains a copy of the 8 bytes after the signature;
/// the checksum of that chunk covers the copy.
struct FileStart {
  std::uint16_t major = kMajor, minor = kMinor;
  std::uint32_t needed_features = 0;
  bool operator==(const FileStart&) const = default;
};
/// Returns true if this reader supports the version. The supported versions are 0.1, 0.9 and 0.10.
/// The byte layouts of 0.1 and 0.9 are identical. No other version exists.
inline bool is_known_version(const FileStart& start) {
  return start.major == kMajor && (start.minor == 1 || start.minor == 9 || start.minor == kMinor);
}
/// Returns true if a file of this version may contain recalled values: values that are coded by the
/// rank of an earlier value, plus a residual.
inline bool has_earlier_values(const FileStart& start) { return start.minor >= 10; }
/// Returns true if each blob in a file of this version unpacks to at most most_unpacked() bytes
/// (base/packing.h).
inline bool has_bounded_blobs(const FileStart& start) { return start.minor >= 10; }
inline constexpr std::size_t kFileStartBytes = 16;
void put(ByteWriter& out, const FileStart& start);
/// Write and read the 8 bytes after the signature.
void put_version(ByteWriter& out, const FileStart& start);
void get_version(ByteReader& in, FileStart& start);
/// Reads the file start. Returns false if the signature is wrong.
bool get(ByteReader& in, FileStart& start);

enum class ChunkKind : std::uint8_t {
  schema = 1,
  group = 2,
  step_values = 3,
  step_times = 4,
  extra = 5,
  index = 6,
  members = 9,  ///< list of the members of an archive; this is the only chunk of the archive itself
};
std::string chunk_name(std::uint8_t kind);

// Sync marks: the first bytes of a chunk header, which state whether the header is short or long.
inline constexpr std::uint32_t kShortMark = 0x634d4853;  // "SHMc"
inline constexpr std::uint32_t kLongMark = 0x434d4853;   // "SHMC"
inline constexpr std::size_t kShortHeaderBytes = 22, kLongHeaderBytes = 32;
/// Flag of a chunk that a reader may skip if it does not know the kind or version of the chunk.
inline constexpr std::uint8_t kChunkOptional = 1;

struct ChunkHeader {
  std::uint8_t kind = 0;
  std::uint8_t version = 0;
  std::uint8_t flags = 0;
  bool is_long = false;        ///< true if the file stores the header in its long form
  std::uint32_t sequence = 0;  ///< number of the chunk in the file, counted from 0
  /// For a group: number of its segment, counted from 0; for other kinds of chunks: 0.
  std::uint32_t segment = 0;
  std::uint64_t payload_bytes = 0;
  std::uint32_t payload_checksum = 0;

  std::size_t bytes() const { return is_long ? kLongHeaderBytes : kShortHeaderBytes; }
  /// Returns the total length in bytes of header and payload.
  std::uint64_t chunk_bytes() const { return bytes() + payload_bytes; }
};
/// Returns true if a file of this version stores the header in its long form. Files before version
/// 0.10 always do so. Later files do so only if a field other than the sequence number does not fit
/// into the short form.
bool has_long_header(const ChunkHeader& header, const FileStart& start);
void put(ByteWriter& out, const ChunkHeader& header);
enum class HeaderState { good, bad_mark, bad_checksum };
/// Reads a header from `in`. If the header is bad, `in` advances by an unspecified number of bytes.
/// Precondition: at least kShortHeaderBytes bytes are left. If a long header is cut off, the result
/// is bad_checksum.
HeaderState get(ByteReader& in, ChunkHeader& header);
/// Returns the length in bytes of the header that starts with `beginning`. If these bytes do not
/// start a header, returns kShortHeaderBytes.
std::size_t header_bytes(std::span<const std::byte> beginning);
/// Returns the chunk version that chunks of this kind have in a file with this file version.
inline std::uint8_t version_of_chunk(ChunkKind kind, const FileStart& start) {
  const bool has_version_1 = kind == ChunkKind::group || kind == ChunkKind::step_values ||
                             kind == ChunkKind::step_times || kind == ChunkKind::extra ||
                             kind == ChunkKind::index;
  return start.minor >= 10 && has_version_1 ? 1 : 0;
}
/// Added to the version of a chunk whose payload begins with a digest of its decoded content. Only
/// groups, step values, step times and the index have one. spec: "Digests"
inline constexpr std::uint8_t kWithDigest = 4;
constexpr bool has_digest(std::uint8_t version) { return version >= kWithDigest; }
constexpr std::uint8_t without_digest(std::uint8_t version) {
  return has_digest(version) ? version - kWithDigest : version;
}
/// Returns the version of a chunk that is like a chunk of `version`, and has a digest if `digest`
/// is set. Precondition: `version` is one without a digest.
constexpr std::uint8_t with_digest(std::uint8_t version, bool digest) {
  return digest ? version + kWithDigest : version;
}
/// Returns true if this reader can decode chunks of this kind and version.
bool is_known_version(ChunkKind kind, std::uint8_t version);
/// Returns true if this reader can decode a chunk with this header in a file that contains a mesh.
bool is_known(const ChunkHeader& header);

/// Kind of data that a bitstream of a group contains.
enum class StreamKind : std::uint8_t {
  connectivity = 1,
  corner_order = 2,
  cell_numbers = 3,
  vertex_numbers = 4,
  geometry = 5,
  array = 6,    ///< values of the array with number StreamEntry::array
  imports = 7,  ///< flags that state which vertices of the group are owned by an earlier segment
};
std::string stream_name(StreamKind kind);

using shm::Codec;

struct StreamEntry {
  StreamKind kind = StreamKind::connectivity;
  std::uint32_t array = 0;  ///< number of the array; only used for StreamKind::array
  Codec codec{};
  /// Streams that are needed to decode this stream: bit k is set for the stream of kind k. Stored
  /// in version 0 only.
  std::uint32_t needs = 0;
  std::uint64_t bytes = 0;
  std::uint32_t checksum = 0;
};

/// First part of the payload of a group chunk. The bitstreams come after it, in order. The group
/// header has a separate checksum, so that a reader can read a single stream.
struct GroupHeader {
  std::uint8_t version = version_of_chunk(ChunkKind::group, {});
  std::uint64_t digest = 0;  ///< of the contents of the group; 0 unless has_digest(version)
  std::uint64_t first_cell = 0, first_vertex = 0;
  std::uint32_t cells = 0;  ///< number of cells, 0..2^20
  /// Number of vertices introduced in this group and owned by its segment.
  std::uint64_t vertices = 0;
  /// Number of vertices introduced in this group but owned by an earlier segment.
  std::uint64_t imported_vertices = 0;
  /// Number of vertices that no cell uses. These are the last of the `vertices` vertices.
  std::uint64_t unused_vertices = 0;
  std::uint64_t max_active_vertices = 0;
  std::uint64_t decoded_bytes = 0;  ///< size in bytes of the decoded values and corners
  /// Min x y z and max x y z of the finite coordinates; +inf and -inf if no coordinate is finite.
  std::array<double, 6> box{};
  std::vector<StreamEntry> streams;
};
inline constexpr std::uint32_t kMaxGroupCells = 1u << 20;
/// Returns the codec of the connectivity stream, which is always the first stream. Returns nullopt
/// if the group has no cells.
inline std::optional<Codec> connectivity_of(const GroupHeader& header) {
  if (header.streams.empty() || header.streams[0].kind != StreamKind::connectivity)
    return std::nullopt;
  return header.streams[0].codec;
}
void put(ByteWriter& out, const GroupHeader& header);
bool get(ByteReader& in, GroupHeader& header, std::uint8_t version);

/// Chunk of a group, with the offset of the chunk and the number of the group in the file.
struct GroupChunk {
  std::vector<std::byte> payload;
  std::uint8_t version = 0;
  std::uint64_t offset = 0, number = 0;
};

/// Description of the values of one array at one step in one group. In a bundle, it describes the
/// values of `arrays` arrays, beginning with `array`, at `steps` steps, beginning with `step`.
struct StepHeader {
  std::uint32_t array = 0;
  std::uint64_t step = 0;
  std::uint32_t arrays = 1;
  std::uint64_t steps = 1;
  /// The step from which the values are predicted. A trend is computed from this step and the step
  /// before it. Equal to `step` if the values are not predicted from another step.
  std::uint64_t reference_step = 0;
  StepReference reference = StepReference::nothing;
  /// Number of the group to whose elements the values belong. Groups are numbered across the whole
  /// file, from 0.
  std::uint32_t group = 0;
  std::uint64_t count = 0;  ///< number of elements, at least 1
  Codec codec{};
};
/// Returns true if a step with this reference is a key step: a reader can begin there. It needs no
/// earlier step other than the base.
constexpr bool is_key(StepReference reference) {
  return reference == StepReference::nothing || reference == StepReference::base;
}
/// One part of a step_values payload: the header of the part, the size in bytes of its coded
/// values, and the digest of the values. In the parts that get() returns, the first one has the
/// digest of all parts.
struct StepPart {
  StepHeader header;
  std::uint64_t bytes = 0;
  std::uint64_t digest = 0;
};
/// Limits for step_values chunks. A chunk has at most kMostStepParts parts. A Writer stores several
/// parts in one chunk only if their coded values have at most kPartBytesTogether bytes in total.
inline constexpr std::size_t kMostStepParts = 64, kPartBytesTogether = 4096;
/// Version of step_values chunks that contain a bundle, without a digest. The headers of all its
/// parts have the same group, step and number of steps. The first part has all bytes.
inline constexpr std::uint8_t kBundleVersion = 2;
/// Codec::bundle, whose definition is in a higher module.
inline constexpr Codec kBundleCodec{15};
/// Limit for the number of pairs of an array and a step in a bundle. Frozen: part of the format.
inline constexpr std::uint64_t kMostBundlePairs = std::uint64_t{1} << 15;
/// Returns the limit for the number of these pairs in a bundle and in all bundles before it.
/// `bytes` is the total size of all chunks of step values before the chunk of the bundle. The limit
/// bounds the memory of readers, which list the steps of each array. Frozen: part of the format.
constexpr std::uint64_t most_bundle_pairs(std::uint64_t bytes) {
  return (std::uint64_t{1} << 18) + bytes;
}
/// Detail of the error for a file that exceeds this limit.
inline constexpr const char* kTooManyBundlePairs =
    "the bundles have more arrays and steps than a file may have";
/// Writes the headers of all parts. The coded values of the parts come after the headers in the
/// same payload. Version 0 has one part, which extends to the end of the payload.
void put(ByteWriter& out, std::span<const StepPart> parts, std::uint8_t version);
/// Reads the headers of all parts. `payload_bytes` is the size of the whole payload. `in` must
/// contain at least all headers.
bool get(ByteReader& in, std::vector<StepPart>& parts, std::uint8_t version,
         std::uint64_t payload_bytes);
/// Returns an upper bound on the total size in bytes of the headers of `parts` parts.
constexpr std::uint64_t most_step_head_bytes(std::uint64_t parts) { return 24 + 64 * parts; }
inline constexpr std::uint64_t kMostStepHeadBytes = most_step_head_bytes(kMostStepParts);

/// Entry of the index for one part of a step_values chunk.
struct StepEntry {
  std::uint32_t array = 0;
  std::uint64_t step = 0, first = 0, count = 0;
  std::uint32_t arrays = 1;  ///< as in StepHeader
  std::uint64_t steps = 1;
  std::uint32_t group = 0;
  StepReference reference = StepReference::nothing;
  Codec codec{};
};
/// Returns the index entry of a part. The field `first` of the entry is not set.
StepEntry entry_of(const StepHeader& header);

/// Returns true if a step_times chunk of this version states the number of times in the chunks
/// before it.
constexpr bool has_first_time(std::uint8_t version) { return without_digest(version) > 0; }
/// Writes step times, in the form that is packed as the payload of a chunk.
/// spec: "Step times"
void put_times(ByteWriter& out, std::span<const double> times, std::uint8_t version);
/// Reads the step times from all bytes of an unpacked payload. Returns false if a time is
/// incomplete.
bool get_times(std::span<const std::byte> bytes, std::vector<double>& times, std::uint8_t version);

/// Entry of the index for one chunk.
struct IndexEntry {
  bool is(ChunkKind of) const { return kind == static_cast<std::uint8_t>(of); }

  std::uint8_t kind = 0;
  /// Position of the chunk in the file, and size in bytes of the chunk including its header.
  std::uint64_t offset = 0, bytes = 0;
  /// Number of the segment to which a group belongs; 0 for other chunks.
  std::uint32_t segment = 0;
  /// Number of the first cell, number of cells, number of the first vertex, and number of vertices
  /// of a group; 0 for other chunks.
  std::uint64_t first_cell = 0, cells = 0, first_vertex = 0, vertices = 0;
  std::array<double, 6> box{};  ///< bounding box of a group; unused for other chunks
  /// Length in bytes of the group header, after which the streams begin; 0 for other chunks.
  std::uint64_t header_bytes = 0;
  std::vector<StepEntry> parts;  ///< parts of a step_values chunk; empty for other chunks
};
struct NamedBytes {
  std::string name;
  std::uint64_t bytes = 0;
  bool operator==(const NamedBytes&) const = default;
};
/// Smallest and largest finite value of each component of a static array, converted to double.
struct ArrayRange {
  std::uint32_t array = 0;
  std::vector<double> minimum, maximum;
};
struct Index {
  std::uint8_t version = version_of_chunk(ChunkKind::index, {});
  std::uint64_t digest = 0;  ///< of the mesh; 0 unless has_digest(version)
  /// Offset of the index chunk that lists the chunks before `entries`, or 0 if `entries` lists all
  /// chunks. That index chunk is the first of `entries`.
  std::uint64_t previous_index = 0;
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0, max_active_vertices = 0, steps = 0;
  std::uint64_t segments = 0, imported_vertices = 0;
  std::vector<std::uint64_t> block_cells;
  /// Total coded size in bytes of each kind of stream; stored in version 0 only.
  std::vector<NamedBytes> streams;
  std::vector<ArrayRange> ranges;  ///< value ranges of the static arrays; stored in version 0 only
  std::vector<IndexEntry> entries;
};
void put(ByteWriter& out, std::span<const NamedBytes> streams);
bool get(ByteReader& in, std::vector<NamedBytes>& streams);
/// Writes an index, without the trailer.
void put(ByteWriter& out, const Index& index);
/// Reads an index, without the trailer, from all remaining bytes of `in`. `max_entries` is the
/// largest possible number of chunks; an index with more entries is damaged.
bool get(ByteReader& in, Index& index, std::uint8_t version, std::uint64_t max_entries);
/// Returns true if the payload of an index chunk of this version ends with the trailer. The trailer
/// of version 0 comes after the chunk.
constexpr bool has_trailer_inside(std::uint8_t version) { return without_digest(version) > 0; }
/// Returns the payload of an index chunk that begins at `offset`.
std::vector<std::byte> index_payload(const Index& index, std::uint64_t offset);
/// Returns the offset of the chunk that the trailer at the end of an index payload states, or
/// nullopt if the payload does not end with a trailer.
std::optional<std::uint64_t> offset_in_index(std::span<const std::byte> payload);
/// Reads the payload of an index chunk that begins at `offset`. Returns false if the index or the
/// trailer inside it is invalid.
bool get_index_payload(std::span<const std::byte> payload, Index& index, std::uint8_t version,
                       std::uint64_t offset, std::uint64_t max_entries);
/// The largest number of index chunks that a reader follows from the last one, through
/// Index::previous_index. Writers need fewer: see ChunkWriter::commit(). Frozen: part of the
/// format.
inline constexpr std::size_t kMostIndexes = 64;
/// Limit for the size in bytes of all indexes in the first `bytes` bytes of a file, as decoded by
/// the library.
constexpr std::uint64_t most_index_bytes(std::uint64_t bytes) {
  return (std::uint64_t{1} << 26) + 1024 * bytes;
}

/// Entry of the member list of an archive.
struct Member {
  std::string name;
  std::uint64_t bytes = 0;
};
struct MemberList {
  FileStart start;  ///< copy of the file start, covered by a checksum
  std::vector<Member> members;
};
void put(ByteWriter& out, const MemberList& list);
bool get(ByteReader& in, MemberList& list);

/// Length in bytes of the trailer, the last part of a file. It is the end of an index chunk, and
/// contains the offset of that chunk, a checksum, and "SHME". In version 0 and in archives the
/// trailer comes after the index or members chunk.
inline constexpr std::size_t kTrailerBytes = 16;
inline constexpr std::uint32_t kTrailerMark = 0x454d4853;  // "SHME"
/// Mark of the packets of parity, which may follow the trailer. spec: "Parity"
inline constexpr std::uint32_t kPacketMark = 0x504d4853;  // "SHMP"
void put_trailer(ByteWriter& out, std::uint64_t index_offset);
bool get_trailer(ByteReader& in, std::uint64_t& index_offset);

}  // namespace shm::container
