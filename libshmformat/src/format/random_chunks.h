// Functions that read chunks at any position of a file. An offset from the index or the trailer
// locates a chunk, and the chunk's checksums verify it.
// spec: "Container", "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "format/format.h"
#include "shm/io.h"

namespace shm::container {

/// Reads `bytes` bytes at `offset`, as listed in an index or another list. `section` is the part of
/// the file that the error names if reading fails.
Result<std::vector<std::byte>> read_bytes(RandomSource& source, std::uint64_t offset,
                                          std::uint64_t bytes, const std::string& section);

/// Returns the header of the chunk at `offset`. Returns nullopt if no valid header exists, or if
/// the chunk extends beyond `end`.
Result<std::optional<ChunkHeader>> header_at(RandomSource& source, std::uint64_t offset,
                                             std::uint64_t end, const std::string& section);

/// Returns the position of the last chunk, as stated by the trailer at the end of the file. Assumes
/// that the chunk is of kind `kind`; the chunk itself is not checked. Fails with
/// ErrorCode::truncated if the file does not end with a trailer.
Result<IndexEntry> last_chunk(RandomSource& source, ChunkKind kind);

/// Returns the position of the last index chunk, as last_chunk() does. If the file does not end
/// with a trailer, reads the chunk headers in order, and returns the last index chunk found. Fails
/// with ErrorCode::truncated if the file has no index.
Result<IndexEntry> last_index(RandomSource& source);

/// Returns the index that was written at an offset, or nullopt if it is damaged.
using IndexReader = std::function<Result<std::optional<Index>>(std::uint64_t offset)>;
/// Reads the index at `offset` and the indexes to which it refers. Returns it with the entries of
/// all of them; nullopt if one of them is damaged, or if there are too many. `sizes` receives the
/// number of entries of each, in file order.
Result<std::optional<Index>> whole_index(const IndexReader& read, std::uint64_t offset,
                                         std::vector<std::size_t>& sizes);

/// Checks the header at the beginning of `chunk` against `entry` and returns it. Precondition:
/// entry.bytes and the size of `chunk` are at least kShortHeaderBytes.
Result<ChunkHeader> checked_header(std::span<const std::byte> chunk, const IndexEntry& entry);

/// Reads a whole chunk, and returns its payload of at most `max_bytes` bytes. If `version` is not
/// null, stores the version of the chunk there.
Result<std::vector<std::byte>> read_chunk(RandomSource& source, const IndexEntry& entry,
                                          std::uint64_t max_bytes, std::uint8_t* version = nullptr);

/// Calls visit(header, entry) for each chunk of `entries`. Fails unless `entries` list all chunks
/// between the file start and the index, in file order. The position of this error is
/// `index_offset`, the position of the index.
using ChunkVisitor = std::function<Result<void>(const ChunkHeader&, const IndexEntry&)>;
Result<void> for_each_chunk(RandomSource& source, std::span<const IndexEntry> entries,
                            std::uint64_t index_offset, const ChunkVisitor& visit);

/// Returns how many bytes of `source` belong to the .shm file: the bytes up to the end of the
/// trailer of the last index. See last_index().
Result<std::uint64_t> bytes_of_file(RandomSource& source);

}  // namespace shm::container
