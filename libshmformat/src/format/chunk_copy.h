// ChunkCopy: copies selected chunks of one file to the beginning of another file. The chunks are
// copied byte for byte, except for their sequence numbers. The offsets of the chunks in the new
// file differ from those in the old file.
// spec: "Container", "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "format/chunk_writer.h"
#include "shm/io.h"

namespace shm::container {

class ChunkCopy {
 public:
  /// Prepares to copy the chunks for which `keep` returns true. `entries` are all chunks of
  /// `source`, as listed by its index at `index_offset`. Reads only the headers of the chunks, not
  /// the payloads. Fails with ErrorCode::corrupt if the index does not match the chunks.
  static Result<ChunkCopy> of(RandomSource& source, std::span<const IndexEntry> entries,
                              std::uint64_t index_offset,
                              const std::function<bool(const IndexEntry&)>& keep);

  Result<void> write(RandomSource& source, ByteSink& sink) const;
  /// Returns the state for a ChunkWriter that appends chunks after the copied chunks.
  const ChunkWriter::State& state() const { return state_; }
  /// Returns the payload size in bytes of each copied chunk, in the order of state().entries.
  const std::vector<std::uint64_t>& payload_bytes() const { return payload_bytes_; }
  /// Returns a ByteSource from which the bytes of the copy can be read, followed by `tail`.
  /// `source` is borrowed.
  std::unique_ptr<ByteSource> read(RandomSource& source, std::vector<std::byte> tail) const;

 private:
  /// Section of the new file: `head` (a new header, or empty) followed by a range of bytes of the
  /// source.
  struct Piece {
    std::vector<std::byte> head;
    std::uint64_t offset = 0, bytes = 0;
  };
  class Source;
  void add(ChunkHeader header, const IndexEntry& entry);

  std::vector<Piece> pieces_;
  ChunkWriter::State state_;
  std::vector<std::uint64_t> payload_bytes_;
};

}  // namespace shm::container
