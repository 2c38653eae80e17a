#include "format/chunk_writer.h"

#include <utility>

#include "base/binary.h"
#include "base/errors.h"

namespace shm::container {

Result<void> ChunkWriter::put(std::span<const std::byte> bytes) {
  offset_ += bytes.size();
  return sink_->write(bytes);
}

Result<void> ChunkWriter::start(const FileStart& start) {
  start_ = start;
  ByteWriter out;
  container::put(out, start);
  return put(out.bytes);
}

/// Writes the header of a chunk with this payload.
Result<void> ChunkWriter::begin(ChunkKind kind, std::span<const std::byte> payload,
                                IndexEntry entry, std::uint8_t version) {
  ChunkHeader header;
  header.version = version;
  header.kind = static_cast<std::uint8_t>(kind);
  header.sequence = sequence_++;
  header.segment = entry.segment;
  header.payload_bytes = payload.size();
  header.payload_checksum = checksum(payload);
  header.is_long = has_long_header(header, start_);
  entry.kind = header.kind;
  entry.offset = offset_;
  entry.bytes = header.chunk_bytes();
  entries_.push_back(entry);
  ByteWriter out;
  container::put(out, header);
  return put(out.bytes);
}

Result<void> ChunkWriter::write(ChunkKind kind, std::span<const std::byte> payload,
                                IndexEntry entry, std::uint8_t version) {
  if (auto status = begin(kind, payload, entry, version); !status) return status;
  return put(payload);
}

Result<void> ChunkWriter::adopt(std::span<const IndexEntry> entries, std::uint64_t bytes) {
  std::uint64_t end = 0;
  for (const IndexEntry& entry : entries) {
    if (entry.bytes < kShortHeaderBytes || entry.bytes > bytes - end)
      return corrupt("the chunks of a part are not contiguous", "index", offset_ + end);
    entries_.push_back(entry);
    entries_.back().offset = offset_ + end;
    end += entry.bytes;
  }
  if (end != bytes)
    return corrupt("the sizes of the chunks of a part do not add up to its total size", "index",
                   offset_ + end);
  offset_ += bytes;
  sequence_ += static_cast<std::uint32_t>(entries.size());
  return {};
}

std::vector<IndexEntry> ChunkWriter::take_entries() {
  offset_ = 0;
  sequence_ = 0;
  return std::exchange(entries_, {});
}

/// Writes an index that lists entries_[first_entry] and all later chunks. Flushes the sink before
/// the trailer, so that a trailer on the disk proves that all bytes before it are on the disk.
Result<void> ChunkWriter::write_index(Index index, std::size_t first_entry) {
  index.previous_index = first_entry == 0 ? 0 : entries_[first_entry].offset;
  index.entries.assign(entries_.begin() + static_cast<std::ptrdiff_t>(first_entry), entries_.end());
  const std::uint64_t offset = offset_;
  std::vector<std::byte> bytes = index_payload(index, offset);
  if (auto status = begin(ChunkKind::index, bytes, {}, index.version); !status) return status;
  if (!has_trailer_inside(index.version)) {
    ByteWriter trailer;
    put_trailer(trailer, offset);
    bytes.insert(bytes.end(), trailer.bytes.begin(), trailer.bytes.end());
  }
  const std::span<const std::byte> all = bytes;
  if (auto status = put(all.first(all.size() - kTrailerBytes)); !status) return status;
  if (auto status = sink_->flush(); !status) return status;
  return put(all.last(kTrailerBytes));
}

Result<void> ChunkWriter::finish(Index index) {
  if (auto status = write_index(std::move(index), 0); !status) return status;
  return sink_->commit();
}

Result<void> ChunkWriter::commit(Index index) {
  if (!indexes_.empty() && indexes_.back().end + 1 == entries_.size()) return {};
  std::size_t begin = indexes_.empty() ? 0 : indexes_.back().end;
  for (; !indexes_.empty(); indexes_.pop_back()) {
    const Listed& before = indexes_.back();
    if (before.end - before.begin >= 2 * (entries_.size() - begin)) break;
    begin = before.begin;
  }
  if (auto status = write_index(std::move(index), begin); !status) return status;
  indexes_.push_back({begin, entries_.size() - 1});
  return sink_->publish();
}

}  // namespace shm::container
