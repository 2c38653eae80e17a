// ChunkScan: all chunks that can be found in a file of which nothing need be whole: by their marks,
// and judged by their own two checksums. spec: "Container", "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "container/format.h"
#include "shm/io.h"

namespace shm::container {

/// A chunk whose header is whole.
struct FoundChunk {
  std::uint64_t offset = 0;
  ChunkHeader header;
  bool whole = false;  ///< its payload has its checksum
  /// Bytes up to the next chunk that was found, or to the end; fewer than bytes() where this one is
  /// not as long as its header states.
  std::uint64_t room = 0;

  std::uint64_t bytes() const { return header.chunk_bytes(); }
  bool is(ChunkKind kind) const { return header.kind == static_cast<std::uint8_t>(kind); }
};

struct ChunkScan {
  std::optional<FileStart> start;  ///< nothing where the signature is not there
  std::vector<FoundChunk> chunks;  ///< in the order of the file
  /// Behind the trailer of the index, where that is whole; else the end of the source.
  std::uint64_t end = 0;
  bool trailer = false;  ///< the 16 bytes before `end` are one, and point to the last chunk
  /// Where the index begins according to a trailer at the very end; nobody has checked it.
  std::optional<std::uint64_t> index_offset;
};

/// Reads each byte of `source` a few times at most; payloads above `max_chunk_bytes` are taken for
/// damaged. Memory: the largest chunk, and 64 bytes for each one. Fails only where `source` does.
Result<ChunkScan> scan_chunks(RandomSource& source, std::uint64_t max_chunk_bytes);

}  // namespace shm::container
