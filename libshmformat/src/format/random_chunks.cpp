#include "format/random_chunks.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "base/binary.h"
#include "base/errors.h"

namespace shm::container {
namespace {

/// Returns true if the payload of this chunk ends with the trailer.
bool has_trailer_inside(ChunkKind kind, const ChunkHeader& header) {
  return kind == ChunkKind::index && header.kind == static_cast<std::uint8_t>(kind) &&
         container::has_trailer_inside(header.version);
}

}  // namespace

Result<std::vector<std::byte>> read_bytes(RandomSource& source, std::uint64_t offset,
                                          std::uint64_t bytes, const std::string& section) {
  if (offset > source.size() || bytes > source.size() - offset)
    return corrupt("the index points beyond the file", section, offset);
  std::vector<std::byte> out(static_cast<std::size_t>(bytes));
  if (auto status = source.read_at(offset, out); !status) return status.error();
  return out;
}

Result<std::optional<ChunkHeader>> header_at(RandomSource& source, std::uint64_t offset,
                                             std::uint64_t end, const std::string& section) {
  std::optional<ChunkHeader> found;
  if (offset > end || end - offset < kShortHeaderBytes) return found;
  const auto bytes =
      read_bytes(source, offset, std::min<std::uint64_t>(kLongHeaderBytes, end - offset), section);
  if (!bytes) return bytes.error();
  ByteReader in(*bytes);
  ChunkHeader header;
  if (get(in, header) == HeaderState::good) found = header;
  return found;
}

Result<IndexEntry> last_chunk(RandomSource& source, ChunkKind kind) {
  constexpr std::uint64_t kLeast = kFileStartBytes + kShortHeaderBytes + kTrailerBytes;
  const std::uint64_t size = source.size();
  if (size < kLeast)
    return truncated("the file is too short to have an end record", "end record", size);
  const std::uint64_t end = size - kTrailerBytes;
  std::vector<std::byte> tail(kTrailerBytes);
  if (auto status = source.read_at(end, tail); !status) return status.error();
  ByteReader in(tail);
  IndexEntry last;
  last.kind = static_cast<std::uint8_t>(kind);
  if (!get_trailer(in, last.offset))
    return truncated("the file does not end with an end record", "end record", end);
  if (last.offset > end) return corrupt("the trailer points beyond the file", "end record", end);
  last.bytes = end - last.offset;
  // Usually the last chunk extends up to the end of the file, or, in version 0, up to the trailer.
  // If parity data has been appended, the file has two equal trailers, one before and one after the
  // parity data. The length of the last chunk is then taken from its header. The chunk itself is
  // checked when it is read.
  const auto header = header_at(source, last.offset, size, chunk_name(last.kind));
  if (!header) return header.error();
  if (!*header || (*header)->payload_bytes >= size || (*header)->chunk_bytes() > size - last.offset)
    return last;
  if (has_trailer_inside(kind, **header)) {
    if ((*header)->payload_bytes < kTrailerBytes) return last;
    last.bytes = (*header)->chunk_bytes();
    const auto inside =
        read_bytes(source, last.offset + last.bytes - kTrailerBytes, kTrailerBytes, "end record");
    if (!inside) return inside.error();
    if (*inside != tail) last.bytes = size - last.offset;
    return last;
  }
  if ((*header)->chunk_bytes() >= last.bytes) return last;
  const auto after =
      read_bytes(source, last.offset + (*header)->chunk_bytes(), kTrailerBytes, "end record");
  if (!after) return after.error();
  if (*after == tail) last.bytes = (*header)->chunk_bytes();
  return last;
}

Result<std::optional<Index>> whole_index(const IndexReader& read, std::uint64_t offset,
                                         std::vector<std::size_t>& sizes) {
  std::optional<Index> whole;
  std::vector<IndexEntry> later;  // entries of the indexes read so far
  for (std::size_t n = 0; n < kMostIndexes; ++n) {
    auto index = read(offset);
    if (!index || !*index) return index;
    offset = (*index)->previous_index;
    std::vector<IndexEntry>& entries = (*index)->entries;
    sizes.insert(sizes.begin(), entries.size());
    std::move(later.begin(), later.end(), std::back_inserter(entries));
    later = std::move(entries);
    if (!whole) whole = std::move(*index);
    if (offset > 0) continue;
    whole->entries = std::move(later);
    whole->previous_index = 0;
    return whole;
  }
  return std::optional<Index>();
}

Result<ChunkHeader> checked_header(std::span<const std::byte> chunk, const IndexEntry& entry) {
  ByteReader in(chunk);
  ChunkHeader header;
  if (get(in, header) != HeaderState::good || header.kind != entry.kind ||
      !is_known_version(static_cast<ChunkKind>(header.kind), header.version) ||
      header.segment != entry.segment || header.payload_bytes > entry.bytes ||
      header.chunk_bytes() != entry.bytes)
    return corrupt("the chunk at this position differs from its entry in the index",
                   chunk_name(entry.kind), entry.offset);
  return header;
}

Result<std::vector<std::byte>> read_chunk(RandomSource& source, const IndexEntry& entry,
                                          std::uint64_t max_bytes, std::uint8_t* version) {
  const std::string section = chunk_name(entry.kind);
  if (entry.bytes < kShortHeaderBytes)
    return corrupt("the index lists a chunk that is too short", section, entry.offset);
  const Error too_large = over_limit("the chunk has " + std::to_string(entry.bytes) +
                                         " bytes, but the limit is " + std::to_string(max_bytes),
                                     section, entry.offset);
  if (entry.bytes > kLongHeaderBytes && entry.bytes - kLongHeaderBytes > max_bytes)
    return too_large;
  auto chunk = read_bytes(source, entry.offset, entry.bytes, section);
  if (!chunk) return chunk.error();
  const auto header = checked_header(*chunk, entry);
  if (!header) return header.error();
  if (header->payload_bytes > max_bytes) return too_large;
  if (version != nullptr) *version = header->version;
  chunk->erase(chunk->begin(), chunk->begin() + static_cast<std::ptrdiff_t>(header->bytes()));
  if (checksum(*chunk) != header->payload_checksum)
    return corrupt("checksum of the chunk does not match", section, entry.offset);
  return std::move(*chunk);
}

Result<void> for_each_chunk(RandomSource& source, std::span<const IndexEntry> entries,
                            std::uint64_t index_offset, const ChunkVisitor& visit) {
  const Error wrong_index = corrupt("the index does not list every chunk", "index", index_offset);
  std::uint64_t end = kFileStartBytes;
  std::uint32_t sequence = 0;
  for (const IndexEntry& entry : entries) {
    if (entry.offset != end || end > index_offset || entry.bytes < kShortHeaderBytes ||
        entry.bytes > index_offset - end)
      return wrong_index;
    const std::string section = chunk_name(entry.kind);
    const auto header = header_at(source, entry.offset, entry.offset + entry.bytes, section);
    if (!header) return header.error();
    if (!*header || (*header)->kind != entry.kind || (*header)->sequence != sequence++ ||
        (*header)->payload_bytes > entry.bytes || (*header)->chunk_bytes() != entry.bytes)
      return corrupt("the chunk at this position differs from its entry in the index", section,
                     entry.offset);
    if (auto status = visit(**header, entry); !status) return status;
    end += entry.bytes;
  }
  return end == index_offset ? Result<void>() : Result<void>(wrong_index);
}

namespace {

/// Reads the chunk headers of `source` in order. Returns the last whole index chunk whose trailer
/// is valid.
Result<IndexEntry> walk_to_last_index(RandomSource& source) {
  const std::uint64_t size = source.size();
  IndexEntry last;
  Error error;
  std::uint64_t position = kFileStartBytes, chunks = 0;
  const auto cut = [&](const std::string& section) {
    return truncated(
        "the file has been cut, and has no index: it ends within the chunk that begins "
        "at byte " +
            std::to_string(position),
        section, size);
  };
  for (;; ++chunks) {
    if (position >= size || size - position < kShortHeaderBytes) {
      error = truncated("the file has been cut, and has no index: it ends after " +
                            std::to_string(chunks) + " whole chunks",
                        "chunk header", size);
      break;
    }
    const auto read = header_at(source, position, size, "chunk header");
    if (!read) return read.error();
    if (!*read || (*read)->sequence != chunks) {
      error =
          corrupt("no chunk begins at this position, and the file does not end with an end record",
                  "chunk header", position);
      break;
    }
    const ChunkHeader& header = **read;
    error = cut(chunk_name(header.kind));
    if (header.payload_bytes > size - position - header.bytes()) break;
    const std::uint64_t end = position + header.chunk_bytes();
    if (header.kind == static_cast<std::uint8_t>(ChunkKind::index) && is_known(header)) {
      const bool inside = has_trailer_inside(ChunkKind::index, header);
      const std::uint64_t trailer = inside ? end - kTrailerBytes : end;
      if (inside ? header.payload_bytes < kTrailerBytes : size - end < kTrailerBytes) break;
      const auto bytes = read_bytes(source, trailer, kTrailerBytes, "end record");
      if (!bytes) return bytes.error();
      ByteReader in(*bytes);
      std::uint64_t offset = 0;
      if (!get_trailer(in, offset) || offset != position) break;
      const auto payload =
          read_bytes(source, position + header.bytes(), header.payload_bytes, "index");
      if (!payload) return payload.error();
      if (checksum(*payload) != header.payload_checksum) break;
      last.kind = header.kind;
      last.offset = position;
      last.bytes = header.chunk_bytes();
      if (!inside) return last;  // nothing follows an index of version 0
    }
    position = end;
  }
  return last.bytes > 0 ? Result<IndexEntry>(last) : Result<IndexEntry>(error);
}

}  // namespace

Result<IndexEntry> last_index(RandomSource& source) {
  auto last = last_chunk(source, ChunkKind::index);
  return last || last.error().code != ErrorCode::truncated ? last : walk_to_last_index(source);
}

Result<std::uint64_t> bytes_of_file(RandomSource& source) {
  const auto last = last_index(source);
  if (!last) return last.error();
  const auto header =
      header_at(source, last->offset, last->offset + last->bytes, chunk_name(last->kind));
  if (!header) return header.error();
  const bool inside = *header && has_trailer_inside(ChunkKind::index, **header);
  return last->offset + last->bytes + (inside ? 0 : kTrailerBytes);
}

}  // namespace shm::container
