// ChunkScan: finds all undamaged chunks of a file that may be damaged anywhere. Chunks are found by
// their sync marks and verified by their two checksums.
// spec: "Container", "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "format/format.h"
#include "shm/io.h"

namespace shm::container {

/// A chunk with an undamaged header.
struct FoundChunk {
  std::uint64_t offset = 0;
  ChunkHeader header;
  bool whole = false;  ///< the payload matches its checksum

  /// Number of bytes from the start of this chunk to the next chunk found, or to the end of the
  /// file. Less than bytes() if the file has lost bytes of this chunk.
  std::uint64_t room = 0;

  std::uint64_t bytes() const { return header.chunk_bytes(); }
  bool is(ChunkKind kind) const { return header.kind == static_cast<std::uint8_t>(kind); }
};

struct ChunkScan {
  std::optional<FileStart> start;  ///< nullopt if the signature is missing
  std::vector<FoundChunk> chunks;  ///< in file order

  /// End of the trailer after the index if the index is undamaged; otherwise the end of the source.
  std::uint64_t end = 0;
  bool trailer = false;  ///< the 16 bytes before `end` are a trailer that points to the last chunk

  /// Offset of the index according to a trailer at the very end of the source. It has not been
  /// checked.
  std::optional<std::uint64_t> index_offset;
};

/// Finds the chunks of `source`. Reads each byte at most a few times, and treats payloads above
/// `max_chunk_bytes` as damaged. Needs memory for the largest chunk, and 64 bytes per chunk. Fails
/// only if `source` fails.
Result<ChunkScan> scan_chunks(RandomSource& source, std::uint64_t max_chunk_bytes);

}  // namespace shm::container
