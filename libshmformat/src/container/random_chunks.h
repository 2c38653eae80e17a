// Chunks of a file that can be read anywhere: found by offset, judged by their checksums.
// spec: "Container", "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/format.h"
#include "shm/io.h"

namespace shm::container {

/// `bytes` bytes from `offset` on, where a list has something; `section` is for messages.
Result<std::vector<std::byte>> read_bytes(RandomSource& source, std::uint64_t offset,
                                          std::uint64_t bytes, const std::string& section);

/// The header of a chunk at `at`, all of it before `end`; nothing where there is none.
Result<std::optional<ChunkHeader>> header_at(RandomSource& source, std::uint64_t at,
                                             std::uint64_t end, const std::string& section);

/// The place of the last chunk, of kind `kind`, to which the trailer points. Nobody has checked it.
/// ErrorCode::truncated where there is no trailer at the very end.
Result<IndexEntry> last_chunk(RandomSource& source, ChunkKind kind);

/// The header of the chunk that `entry` lists and that begins with `chunk`. Must hold:
/// entry.bytes and chunk are at least kShortHeaderBytes.
Result<ChunkHeader> checked_header(std::span<const std::byte> chunk, const IndexEntry& entry);

/// The payload of a whole chunk, at most `max_bytes`; `version`, where it is asked for, is that of
/// the chunk.
Result<std::vector<std::byte>> read_chunk(RandomSource& source, const IndexEntry& entry,
                                          std::uint64_t max_bytes, std::uint8_t* version = nullptr);

/// Calls visit(header, entry) for each chunk of `entries`; an error names the index at
/// `index_offset` unless they are all that stand between start and index, in their order.
using ChunkVisitor = std::function<Result<void>(const ChunkHeader&, const IndexEntry&)>;
Result<void> for_each_chunk(RandomSource& source, std::span<const IndexEntry> entries,
                            std::uint64_t index_offset, const ChunkVisitor& visit);

/// How many bytes of `source` are a .shm file: all, where a trailer is the very end; else what ends
/// with the trailer behind the first index, which is found by the headers of all chunks before it.
/// ErrorCode::truncated where there is none.
Result<std::uint64_t> bytes_of_file(RandomSource& source);

}  // namespace shm::container
