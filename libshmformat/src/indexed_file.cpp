#include "indexed_file.h"

#include <algorithm>
#include <utility>

#include "bytes/checksum.h"

namespace shm {

using container::ChunkHeader;
using container::ChunkKind;
using container::IndexEntry;
using container::kChunkHeaderBytes;

Result<void> IndexedFile::open() {
  if (auto good = read_index(); !good) return good;
  if (auto good = list_groups(); !good) return good;
  return read_schema();
}

Result<std::vector<std::byte>> IndexedFile::read(std::uint64_t offset, std::uint64_t bytes,
                                                 const std::string& section) {
  if (offset > source_->size() || bytes > source_->size() - offset)
    return wrong("the index points beyond the file", section, offset);
  std::vector<std::byte> out(static_cast<std::size_t>(bytes));
  if (auto good = source_->read_at(offset, out); !good) return good.error();
  return out;
}

/// The header of the chunk of `entry`, which begins with `chunk`.
Result<void> IndexedFile::check_header(std::span<const std::byte> chunk, const IndexEntry& entry,
                                       ChunkHeader& header) const {
  ByteReader in(chunk);
  if (container::get(in, header) != container::HeaderState::good || header.kind != entry.kind ||
      header.version != 0 || header.segment != entry.segment ||
      header.payload_bytes != entry.bytes - kChunkHeaderBytes)
    return wrong("the chunk that should stand here does not", container::chunk_name(entry.kind),
                 entry.offset);
  return {};
}

Result<std::vector<std::byte>> IndexedFile::read_chunk(const IndexEntry& entry) {
  const std::string section = container::chunk_name(entry.kind);
  if (entry.bytes < kChunkHeaderBytes)
    return wrong("the index tells of a chunk that is too short", section, entry.offset);
  if (entry.bytes - kChunkHeaderBytes > limits_.max_chunk_bytes)
    return wrong("a chunk of " + std::to_string(entry.bytes) + " bytes, the limit is " +
                     std::to_string(limits_.max_chunk_bytes),
                 section, entry.offset, ErrorCode::over_limit);
  auto chunk = read(entry.offset, entry.bytes, section);
  if (!chunk) return chunk.error();
  ChunkHeader header;
  if (auto good = check_header(*chunk, entry, header); !good) return good.error();
  chunk->erase(chunk->begin(), chunk->begin() + kChunkHeaderBytes);
  if (checksum(*chunk) != header.payload_checksum)
    return wrong("checksum of the chunk does not match", section, entry.offset);
  return std::move(*chunk);
}

Result<IndexedFile::GroupHead> IndexedFile::read_group_head(std::size_t group) {
  const IndexEntry& entry = groups_[group];
  const std::string section = "group " + std::to_string(group);
  if (entry.bytes < kChunkHeaderBytes || entry.header_bytes > entry.bytes - kChunkHeaderBytes ||
      entry.header_bytes > limits_.max_chunk_bytes)
    return wrong("the index does not tell how long its header is", section, entry.offset);
  const auto bytes = read(entry.offset, kChunkHeaderBytes + entry.header_bytes, section);
  if (!bytes) return bytes.error();
  ChunkHeader chunk;
  if (auto good = check_header(*bytes, entry, chunk); !good) return good.error();
  ByteReader in(std::span<const std::byte>(*bytes).subspan(kChunkHeaderBytes));
  GroupHead head;
  if (!container::get(in, head.header) || in.left() != 0)
    return wrong("the group header makes no sense", section, entry.offset);
  if (head.header.cells != entry.cells || head.header.vertices != entry.vertices ||
      head.header.first_cell != entry.first_cell || head.header.first_vertex != entry.first_vertex)
    return wrong("the index tells something else of it", section, entry.offset);
  std::uint64_t left = chunk.payload_bytes - entry.header_bytes;
  for (const container::StreamEntry& stream : head.header.streams) {
    head.stream_offset.push_back(entry.offset + entry.bytes - left);
    if (stream.bytes > left)
      return wrong(container::stream_name(stream.kind) + ": ends beyond the group", section,
                   entry.offset);
    left -= stream.bytes;
  }
  if (left != 0) return wrong("bytes are left over behind the last stream", section, entry.offset);
  return head;
}

Result<std::vector<std::byte>> IndexedFile::read_stream(std::size_t group, const GroupHead& head,
                                                        std::size_t stream) {
  const container::StreamEntry& entry = head.header.streams[stream];
  const std::string section = "group " + std::to_string(group);
  const std::string name = container::stream_name(entry.kind);
  if (entry.bytes > limits_.max_chunk_bytes)
    return wrong(name + ": " + std::to_string(entry.bytes) + " bytes, the limit is " +
                     std::to_string(limits_.max_chunk_bytes),
                 section, groups_[group].offset, ErrorCode::over_limit);
  auto bytes = read(head.stream_offset[stream], entry.bytes, section);
  if (bytes && checksum(*bytes) != entry.checksum)
    return wrong(name + ": checksum does not match", section, groups_[group].offset);
  return bytes;
}

// --- what is read first

Result<void> IndexedFile::read_index() {
  const std::uint64_t size = source_->size();
  constexpr std::uint64_t kLeast =
      container::kFileStartBytes + kChunkHeaderBytes + container::kTrailerBytes;
  if (size < kLeast)
    return wrong("the file is too short to have an end record", "end record", size,
                 ErrorCode::truncated);
  std::vector<std::byte> tail(container::kTrailerBytes);
  const std::uint64_t end = size - container::kTrailerBytes;
  if (auto good = source_->read_at(end, tail); !good) return good;
  ByteReader in(tail);
  if (!container::get_trailer(in, index_offset_))
    return wrong("the file does not end with an end record", "end record", end,
                 ErrorCode::truncated);
  if (index_offset_ > end) return wrong("points beyond the file", "end record", end);
  IndexEntry self;
  self.kind = static_cast<std::uint8_t>(ChunkKind::index);
  self.offset = index_offset_;
  self.bytes = end - index_offset_;
  const auto payload = read_chunk(self);
  if (!payload) return payload.error();
  ByteReader fields(*payload);
  if (!container::get(fields, index_, payload->size())) return wrong_index("makes no sense");
  return {};
}

Result<void> IndexedFile::list_groups() {
  for (const IndexEntry& entry : index_.entries) {
    if (entry.kind != static_cast<std::uint8_t>(ChunkKind::group)) continue;
    if (segments_.empty() || entry.segment + 1 != segments_.size()) {
      if (entry.segment != segments_.size() || entry.segment >= limits_.max_segments)
        return wrong_index("its segments are not in order, or too many");
      segments_.push_back({entry.first_cell, 0, entry.first_vertex, 0, 0, entry.box});
      first_group_.push_back(groups_.size());
    }
    SegmentInfo& segment = segments_.back();
    segment.cells += entry.cells;
    segment.vertices += entry.vertices;
    segment.bytes += entry.bytes;
    for (std::size_t c = 0; c < 3; ++c) {
      segment.box[c] = std::min(segment.box[c], entry.box[c]);
      segment.box[3 + c] = std::max(segment.box[3 + c], entry.box[3 + c]);
    }
    groups_.push_back(entry);
  }
  first_group_.push_back(groups_.size());
  return {};
}

/// The first chunk, and what stands before it, through a Decoder, which checks it.
Result<void> IndexedFile::read_schema() {
  if (index_.entries.empty() ||
      index_.entries[0].kind != static_cast<std::uint8_t>(ChunkKind::schema) ||
      index_.entries[0].offset != container::kFileStartBytes ||
      index_offset_ < container::kFileStartBytes ||
      index_.entries[0].bytes > index_offset_ - container::kFileStartBytes)
    return wrong_index("does not tell of the schema");
  constexpr std::uint64_t kPiece = std::uint64_t{1} << 16;
  const std::uint64_t end = container::kFileStartBytes + index_.entries[0].bytes;
  decoder_ = Decoder(limits_);
  std::vector<std::byte> piece;
  for (std::uint64_t at = 0; at < end; at += piece.size()) {
    piece.resize(static_cast<std::size_t>(std::min(kPiece, end - at)));
    if (auto good = source_->read_at(at, piece); !good) return good;
    if (auto good = decoder_.feed(piece); !good) return good;
    if (auto progress = decoder_.advance(); !progress) return progress.error();
  }
  if (decoder_.schema() == nullptr) return wrong_index("does not tell how long the schema is");
  return {};
}

}  // namespace shm
