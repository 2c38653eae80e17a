#include "container/random_chunks.h"

#include <string>
#include <utility>

#include "bytes/checksum.h"

namespace shm::container {
namespace {

Error wrong(std::string detail, std::string section, std::uint64_t offset,
            ErrorCode code = ErrorCode::corrupt) {
  return Error{code, std::move(detail), std::move(section), offset, {}};
}

}  // namespace

Result<ChunkPlace> last_chunk(RandomSource& source) {
  constexpr std::uint64_t kLeast = kFileStartBytes + kChunkHeaderBytes + kTrailerBytes;
  const std::uint64_t size = source.size();
  if (size < kLeast)
    return wrong("the file is too short to have an end record", "end record", size,
                 ErrorCode::truncated);
  const std::uint64_t end = size - kTrailerBytes;
  std::vector<std::byte> tail(kTrailerBytes);
  if (auto good = source.read_at(end, tail); !good) return good.error();
  ByteReader in(tail);
  std::uint64_t offset = 0;
  if (!get_trailer(in, offset))
    return wrong("the file does not end with an end record", "end record", end,
                 ErrorCode::truncated);
  if (offset > end) return wrong("points beyond the file", "end record", end);
  return ChunkPlace{offset, end - offset};
}

Result<std::vector<std::byte>> read_chunk(RandomSource& source, ChunkKind kind,
                                          std::uint32_t segment, ChunkPlace place,
                                          std::uint64_t max_bytes) {
  const std::string section = chunk_name(static_cast<std::uint8_t>(kind));
  if (place.bytes < kChunkHeaderBytes || place.offset > source.size() ||
      place.bytes > source.size() - place.offset)
    return wrong("the index points beyond the file", section, place.offset);
  if (place.bytes - kChunkHeaderBytes > max_bytes)
    return wrong("a chunk of " + std::to_string(place.bytes) + " bytes, the limit is " +
                     std::to_string(max_bytes),
                 section, place.offset, ErrorCode::over_limit);
  std::vector<std::byte> chunk(static_cast<std::size_t>(place.bytes));
  if (auto good = source.read_at(place.offset, chunk); !good) return good.error();
  ByteReader in(chunk);
  ChunkHeader header;
  if (get(in, header) != HeaderState::good || header.kind != static_cast<std::uint8_t>(kind) ||
      header.version != 0 || header.segment != segment ||
      header.payload_bytes != place.bytes - kChunkHeaderBytes)
    return wrong("the chunk that should stand here does not", section, place.offset);
  chunk.erase(chunk.begin(), chunk.begin() + kChunkHeaderBytes);
  if (checksum(chunk) != header.payload_checksum)
    return wrong("checksum of the chunk does not match", section, place.offset);
  return chunk;
}

}  // namespace shm::container
