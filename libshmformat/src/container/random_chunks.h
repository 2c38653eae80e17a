// Chunks of a file that can be read anywhere: found by offset, judged by their checksums.
// spec: "Container", "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "container/format.h"
#include "shm/io.h"

namespace shm::container {

/// `bytes` bytes from `offset` on, where a list said that something is; `section` is for messages.
Result<std::vector<std::byte>> read_bytes(RandomSource& source, std::uint64_t offset,
                                          std::uint64_t bytes, const std::string& section);

/// The place of the last chunk, of kind `kind`, to which the trailer points. Nobody has checked it.
/// ErrorCode::truncated where there is no trailer at the very end.
Result<IndexEntry> last_chunk(RandomSource& source, ChunkKind kind);

/// The header of the chunk that `entry` tells of and that begins with `chunk`. Must hold:
/// entry.bytes and chunk are at least kChunkHeaderBytes.
Result<ChunkHeader> checked_header(std::span<const std::byte> chunk, const IndexEntry& entry);

/// The payload of a whole chunk, at most `max_bytes`.
Result<std::vector<std::byte>> read_chunk(RandomSource& source, const IndexEntry& entry,
                                          std::uint64_t max_bytes);

}  // namespace shm::container
