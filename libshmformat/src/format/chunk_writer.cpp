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

Result<void> ChunkWriter::write(ChunkKind kind, std::span<const std::byte> payload,
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
  if (auto status = put(out.bytes); !status) return status;
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

Result<void> ChunkWriter::finish(Index index) {
  index.entries = std::exchange(entries_, {});
  const std::uint64_t index_offset = offset_;
  ByteWriter payload;
  container::put(payload, index);
  if (auto status = write(ChunkKind::index, payload.bytes, {}, index.version); !status)
    return status;
  ByteWriter trailer;
  put_trailer(trailer, index_offset);
  if (auto status = put(trailer.bytes); !status) return status;
  return sink_->commit();
}

}  // namespace shm::container
