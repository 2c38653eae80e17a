// SegmentReader: finds the groups of a segment by the index and decodes them alone.
#include "shm/segment_reader.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "container/format.h"
#include "container/random_chunks.h"
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

  RandomSource* source_;
  ReadLimits limits_;
  Decoder decoder_;  // of the schema
  std::uint64_t index_offset_ = 0;
  std::vector<SegmentInfo> segments_;
  std::vector<IndexEntry> groups_;
  std::vector<std::size_t> first_group_;  // of each segment
};

Result<void> SegmentReader::Impl::read_index() {
  const auto place = container::last_chunk(*source_);
  if (!place) return place.error();
  index_offset_ = place->offset;
  const auto payload =
      container::read_chunk(*source_, ChunkKind::index, 0, *place, limits_.max_chunk_bytes);
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
    auto payload = container::read_chunk(*source_, ChunkKind::group, segment,
                                         {entry.offset, entry.bytes}, limits_.max_chunk_bytes);
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
