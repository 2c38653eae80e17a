// ChunkScan: finds all undamaged chunks of a file that may be damaged anywhere. The scan finds
// chunks by their sync marks and verifies them by their two checksums.
// spec: "Container", "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "format/format.h"
#include "shm/io.h"

namespace shm::container {

/// Chunk with an undamaged header.
struct FoundChunk {
  std::uint64_t offset = 0;
  ChunkHeader header;
  bool whole = false;  ///< true: the payload matches its checksum

  /// Number of bytes from the start of this chunk to the next chunk found, or to the end of the
  /// file. It is smaller than bytes() if bytes of this chunk are missing in the file.
  std::uint64_t room = 0;

  std::uint64_t bytes() const { return header.chunk_bytes(); }
  bool is(ChunkKind kind) const { return header.kind == static_cast<std::uint8_t>(kind); }
};

struct ChunkScan {
  std::optional<FileStart> start;  ///< file start; nullopt if the signature is missing
  std::vector<FoundChunk> chunks;  ///< chunks found, in file order

  /// End of the trailer that follows the index, if the index is undamaged; otherwise the end of the
  /// source.
  std::uint64_t end = 0;
  /// True if the 16 bytes before `end` are a trailer that points to the last chunk.
  bool trailer = false;

  /// Offset of the index, as stated by a trailer at the very end of the source. The scan does not
  /// check this offset.
  std::optional<std::uint64_t> index_offset;
};

/// Finds the chunks of `source`. Reads each byte at most a few times, and treats payloads above
/// `max_chunk_bytes` as damaged. Needs memory for the largest chunk, and 64 bytes per chunk. Fails
/// only if `source` fails.
Result<ChunkScan> scan_chunks(RandomSource& source, std::uint64_t max_chunk_bytes);

}  // namespace shm::container
