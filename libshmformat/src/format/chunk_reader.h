// ChunkReader: checks a file from front to back: the file start, then the header and the payload of
// each chunk, and the trailer. It also decodes the schema, which is the first chunk. ChunkWriter
// writes chunks.
// spec: "Container", "Schema"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "format/format.h"
#include "shm/limits.h"
#include "shm/schema.h"

namespace shm::container {

class ChunkReader {
 public:
  explicit ChunkReader(const ReadLimits& limits)
      : limits_(within_sizes(limits)), budget_(limits_.max_unpacked_bytes) {}

  /// after_index: the next part is the header of another chunk, or the file has ended.
  enum class State : std::uint8_t { start, header, payload, after_index, trailer, behind_end };
  /// Returns which part of the file has to be read next.
  State state() const { return state_; }
  /// Returns the length in bytes of the next part. `beginning` contains the bytes of this part that
  /// are available so far.
  std::size_t wanted(std::span<const std::byte> beginning) const;
  /// Checks the next part of the file, and advances to the following part. Precondition: `bytes`
  /// has exactly wanted(bytes) bytes.
  Result<void> read(std::span<const std::byte> bytes);
  /// Declares that the payload of an index has been read. The file may end here: the next part is
  /// the trailer in version 0, else the header of another chunk if one follows.
  void end_index();
  /// Declares that no chunk follows the index. Precondition: state() is after_index.
  void end_file() { state_ = State::behind_end; }
  /// Returns true if `bytes` begin with the header of the chunk that follows the index.
  /// Precondition: state() is after_index, and `bytes` has at least wanted(bytes) bytes.
  bool is_next_header(std::span<const std::byte> bytes) const;
  /// Decodes the payload of a schema chunk.
  Result<Schema> read_schema(std::span<const std::byte> payload);
  /// Reads from the beginning of `bytes` until the schema is complete. On return, `bytes` contains
  /// only the bytes that have not been read. Returns nullopt if more bytes are needed. In the next
  /// call, pass the remaining bytes again, followed by more bytes.
  Result<std::optional<Schema>> find_schema(std::span<const std::byte>& bytes);
  /// Unpacks a blob. The blob is not counted against the budget, since the caller frees it soon.
  /// Fails if the blob is larger than `limit` or than the remaining budget.
  Result<std::vector<std::byte>> unpack(ByteReader& in, std::uint64_t limit) const;

  /// Return the header of the most recently read chunk, and the offset of this chunk in the file.
  const ChunkHeader& header() const { return header_; }
  std::uint64_t chunk_offset() const { return chunk_offset_; }
  /// Returns the number of bytes read so far.
  std::uint64_t offset() const { return offset_; }
  /// Returns the number of chunk headers read so far.
  std::uint32_t count() const { return next_sequence_; }
  /// Returns the name of the current part of the file, for use in errors.
  const std::string& section() const { return section_; }
  /// Returns how many bytes of ReadLimits::max_unpacked_bytes are left.
  std::uint64_t budget() const { return budget_.left(offset_); }
  void take_from_budget(std::uint64_t bytes) { budget_.take(bytes); }
  /// Returns an error at the position of the most recently read chunk.
  Error wrong(std::string detail, ErrorCode code = ErrorCode::corrupt) const;

 private:
  Result<void> read_start(ByteReader in);
  Result<void> read_header(ByteReader in);
  Result<void> read_payload(std::span<const std::byte> payload);
  Result<void> read_trailer(ByteReader in);

  ReadLimits limits_;
  UnpackBudget budget_;
  State state_ = State::start;
  FileStart start_;
  ChunkHeader header_;
  std::uint64_t offset_ = 0, chunk_offset_ = 0;
  std::string section_ = "signature";
  std::uint32_t next_sequence_ = 0;
  bool has_schema_ = false;
};

/// ChunkList: records the chunks that a reader has read, to check the index at the end of the file.
/// The reader adds the headers of chunks, groups and step values, in file order. difference() then
/// describes the first index entry that differs from these headers. The list needs a few bytes per
/// chunk, plus 48 bytes per group for its bounding box.
class ChunkList {
 public:
  /// Adds a chunk that contains neither a group nor step values. If the kind or the version of the
  /// chunk is unknown to the reader, difference() compares only the kind, offset and length in its
  /// index entry.
  void add(const ChunkHeader& header);
  /// Adds an index chunk that more chunks follow.
  void add_index(const ChunkHeader& header, std::uint64_t previous_index);
  /// Adds a group. `header_bytes` is the length of the group header, including its checksum.
  void add_group(const ChunkHeader& header, const GroupHeader& group, std::uint64_t header_bytes);
  void add_step_values(const ChunkHeader& header, std::span<const StepPart> parts);

  /// Compares an index with the chunks added, from the index at `index.previous_index` on. Returns
  /// nullopt if both are equal. Otherwise returns a description of the first entry that differs,
  /// e.g. "entry 3, of the group at byte 812, has a different box".
  std::optional<std::string> difference(const Index& index) const;

 private:
  /// Position at which the record of an index chunk begins.
  struct IndexPosition {
    std::uint64_t offset = 0;  ///< of the chunk in the file
    std::uint64_t count = 0;   ///< number of chunks before it
    std::size_t line = 0;      ///< of its record in lines_
    std::size_t followed = 0;  ///< number of indexes that a reader follows from this one, with it
  };

  void put_chunk(const ChunkHeader& header, bool is_known);
  /// Returns the index that begins at this offset, or null if none does.
  const IndexPosition* index_at(std::uint64_t offset) const;

  // Fields of the index entries. The fields offset, first_cell, first_vertex and first are not
  // stored, since they can be computed as running sums.
  ByteWriter lines_;
  std::uint64_t count_ = 0;
  std::uint64_t end_ = kFileStartBytes;  // end of the last chunk
  std::vector<IndexPosition> indexes_;
};

}  // namespace shm::container
