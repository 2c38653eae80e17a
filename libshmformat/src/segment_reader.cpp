// SegmentReader: finds the groups of a segment by the index and decodes them alone.
#include "shm/segment_reader.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "bytes/checksum.h"
#include "container/format.h"
#include "segment_decoder.h"

namespace shm {

using container::ChunkKind;
using container::IndexEntry;

class SegmentReader::Impl {
 public:
  Impl(RandomSource& source, const ReadLimits& limits) : source_(&source), limits_(limits) {}

  Result<void> open() {
    if (auto good = read_index(); !good) return good;
    return read_schema();
  }
  const Schema& schema() const { return *decoder_.schema(); }
  const std::vector<SegmentInfo>& segments() const { return segments_; }
  Result<std::vector<MeshBlock>> read(std::size_t index);

 private:
  static Error wrong(std::string detail, std::string section, std::uint64_t offset,
                     ErrorCode code = ErrorCode::corrupt) {
    return Error{code, std::move(detail), std::move(section), offset, {}};
  }
  Result<void> read_index();
  Result<void> read_schema();
  Result<void> list_groups(const container::Index& index);
  Result<std::vector<std::byte>> read_chunk(ChunkKind kind, std::uint32_t segment,
                                            std::uint64_t offset, std::uint64_t bytes);

  RandomSource* source_;
  ReadLimits limits_;
  Decoder decoder_;  // of the schema
  std::uint64_t index_offset_ = 0;
  std::vector<SegmentInfo> segments_;
  std::vector<IndexEntry> groups_;
  std::vector<std::size_t> first_group_;  // of each segment
};

/// The payload of the chunk of `bytes` bytes at `offset`.
Result<std::vector<std::byte>> SegmentReader::Impl::read_chunk(ChunkKind kind,
                                                               std::uint32_t segment,
                                                               std::uint64_t offset,
                                                               std::uint64_t bytes) {
  const std::string section = container::chunk_name(static_cast<std::uint8_t>(kind));
  if (bytes < container::kChunkHeaderBytes || offset > source_->size() ||
      bytes > source_->size() - offset)
    return wrong("the index points beyond the file", section, offset);
  if (bytes - container::kChunkHeaderBytes > limits_.max_chunk_bytes)
    return wrong("a chunk of " + std::to_string(bytes) + " bytes, the limit is " +
                     std::to_string(limits_.max_chunk_bytes),
                 section, offset, ErrorCode::over_limit);
  std::vector<std::byte> chunk(static_cast<std::size_t>(bytes));
  if (auto good = source_->read_at(offset, chunk); !good) return good.error();
  ByteReader in(chunk);
  container::ChunkHeader header;
  if (container::get(in, header) != container::HeaderState::good ||
      header.kind != static_cast<std::uint8_t>(kind) || header.version != 0 ||
      header.segment != segment || header.payload_bytes != bytes - container::kChunkHeaderBytes)
    return wrong("the chunk that should stand here does not", section, offset);
  chunk.erase(chunk.begin(), chunk.begin() + container::kChunkHeaderBytes);
  if (checksum(chunk) != header.payload_checksum)
    return wrong("checksum of the chunk does not match", section, offset);
  return chunk;
}

Result<void> SegmentReader::Impl::read_index() {
  const std::uint64_t size = source_->size();
  constexpr std::uint64_t kLeast =
      container::kFileStartBytes + container::kChunkHeaderBytes + container::kTrailerBytes;
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
  const auto payload = read_chunk(ChunkKind::index, 0, index_offset_, end - index_offset_);
  if (!payload) return payload.error();
  ByteReader fields(*payload);
  container::Index index;
  if (!container::get(fields, index, payload->size()))
    return wrong("makes no sense", "index", index_offset_);
  return list_groups(index);
}

Result<void> SegmentReader::Impl::list_groups(const container::Index& index) {
  for (const IndexEntry& entry : index.entries) {
    if (entry.kind != static_cast<std::uint8_t>(ChunkKind::group)) continue;
    if (segments_.empty() || entry.segment + 1 != segments_.size()) {
      if (entry.segment != segments_.size() || entry.segment >= limits_.max_segments)
        return wrong("its segments are not in order, or too many", "index", index_offset_);
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

/// From the start of the file, through a Decoder, which checks it.
Result<void> SegmentReader::Impl::read_schema() {
  decoder_ = Decoder(limits_);
  std::vector<std::byte> piece;
  for (std::uint64_t at = 0; decoder_.schema() == nullptr; at += piece.size()) {
    constexpr std::uint64_t kPiece = 4096;
    piece.resize(static_cast<std::size_t>(std::min(kPiece, index_offset_ - at)));
    if (auto good = source_->read_at(at, piece); !good) return good;
    if (auto good = decoder_.feed(piece); !good) return good;
    if (piece.empty()) decoder_.end_of_input();
    if (auto progress = decoder_.advance(); !progress && decoder_.schema() == nullptr)
      return progress.error();
  }
  return {};
}

Result<std::vector<MeshBlock>> SegmentReader::Impl::read(std::size_t index) {
  if (index >= segments_.size())
    return wrong("there is no segment " + std::to_string(index), "segments", kNoOffset,
                 ErrorCode::misuse);
  const auto segment = static_cast<std::uint32_t>(index);
  SegmentDecoder decoder(schema(), limits_, segment, SegmentDecoder::Imports::yielded);
  std::vector<MeshBlock> blocks;
  for (std::size_t g = first_group_[index]; g < first_group_[index + 1]; ++g) {
    const IndexEntry& entry = groups_[g];
    auto payload = read_chunk(ChunkKind::group, segment, entry.offset, entry.bytes);
    if (!payload) return payload.error();
    if (auto good = decoder.begin_group(std::move(*payload), entry.offset, g); !good)
      return good.error();
    if (decoder.start().first_cell != segments_[index].first_cell ||
        decoder.start().first_vertex != segments_[index].first_vertex)
      return wrong("the index does not tell where the segment begins", "index", index_offset_);
    while (decoder.in_group()) {
      auto block = decoder.next_block();
      if (!block) return block.error();
      blocks.push_back(std::move(block->mesh));
    }
  }
  return blocks;
}

SegmentReader::SegmentReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SegmentReader::SegmentReader(SegmentReader&&) noexcept = default;
SegmentReader& SegmentReader::operator=(SegmentReader&&) noexcept = default;
SegmentReader::~SegmentReader() = default;

Result<SegmentReader> SegmentReader::open(RandomSource& source, const ReadLimits& limits) {
  auto impl = std::make_unique<Impl>(source, limits);
  if (auto good = impl->open(); !good) return good.error();
  return SegmentReader(std::move(impl));
}
const Schema& SegmentReader::schema() const { return impl_->schema(); }
const std::vector<SegmentInfo>& SegmentReader::segments() const { return impl_->segments(); }
Result<std::vector<MeshBlock>> SegmentReader::read(std::size_t index) { return impl_->read(index); }

}  // namespace shm
