// ChunkReader: checks a file from front to back: the file start, then header and payload of each
// chunk, and the trailer. Decodes the schema, which is the first chunk. The counterpart of
// chunk_writer.h.
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

  enum class State : std::uint8_t { start, header, payload, trailer, behind_end };
  /// The part of the file that is next.
  State state() const { return state_; }
  /// Returns the length of that part. `beginning`: its first bytes, as far as they are known.
  std::size_t wanted(std::span<const std::byte> beginning) const;
  /// Checks that part. Must hold: `bytes` are wanted(bytes) bytes.
  Result<void> read(std::span<const std::byte> bytes);
  /// Declares that the last payload was the index: the trailer is next.
  void expect_trailer();
  /// Decodes the payload of a schema chunk.
  Result<Schema> read_schema(std::span<const std::byte> payload);
  /// Reads `bytes` as far as the schema, and removes the bytes that it has read. Returns nullopt if
  /// more bytes are needed: the next call continues with the remaining bytes and these.
  Result<std::optional<Schema>> find_schema(std::span<const std::byte>& bytes);
  /// Unpacks a blob that is not kept. Fails if it is larger than `limit` or the remaining budget.
  Result<std::vector<std::byte>> unpack(ByteReader& in, std::uint64_t limit) const;

  /// Header of the last chunk, and its offset in the file.
  const ChunkHeader& header() const { return header_; }
  std::uint64_t chunk_offset() const { return chunk_offset_; }
  /// Bytes read so far.
  std::uint64_t offset() const { return offset_; }
  /// Number of chunks so far.
  std::uint32_t count() const { return next_sequence_; }
  /// The part of the file that errors name.
  const std::string& section() const { return section_; }
  /// The rest of ReadLimits::max_unpacked_bytes.
  std::uint64_t budget() const { return budget_.left(offset_); }
  void take_from_budget(std::uint64_t bytes) { budget_.take(bytes); }
  /// Returns an error about the last chunk.
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

}  // namespace shm::container
