// Chunks of a file that can be read anywhere: found by offset, judged by their checksums.
// spec: "Container", "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "container/format.h"
#include "shm/io.h"

namespace shm::container {

/// Where a chunk should stand, header included. Nobody has checked it.
struct ChunkPlace {
  std::uint64_t offset = 0, bytes = 0;
};

/// The last chunk of a file, to which its trailer points. ErrorCode::truncated where there is no
/// trailer at the very end.
Result<ChunkPlace> last_chunk(RandomSource& source);

/// The payload of the chunk at `place`, which must be of this kind and segment. At most
/// `max_bytes`.
Result<std::vector<std::byte>> read_chunk(RandomSource& source, ChunkKind kind,
                                          std::uint32_t segment, ChunkPlace place,
                                          std::uint64_t max_bytes);

}  // namespace shm::container
