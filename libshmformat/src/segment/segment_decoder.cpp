#include "segment/segment_decoder.h"

#include <algorithm>
#include <utility>

#include "bytes/binary.h"
#include "segment/shift_group_decoder.h"
#include "segment/surface_group_decoder.h"

namespace shm {

Result<std::unique_ptr<GroupDecoder>> make_group_decoder(const Schema& schema,
                                                         const SegmentStart& start,
                                                         const DecodedParts& parts,
                                                         CellBytes cell_bytes,
                                                         const container::GroupHeader& header) {
  if (container::connectivity_of(header) != container::Codec::shifts)
    return std::unique_ptr<GroupDecoder>(
        std::make_unique<SurfaceGroupDecoder>(schema, start, parts, std::move(cell_bytes)));
  if (!takes_shifts(schema))
    return Error{ErrorCode::unsupported,
                 "connectivity: codec shifts needs cells of 1 to 64 nodes, no delay and stepped "
                 "arrays of at most 32 components",
                 {},
                 kNoOffset,
                 {}};
  return std::unique_ptr<GroupDecoder>(
      std::make_unique<ShiftGroupDecoder>(schema, start, parts, std::move(cell_bytes)));
}

SegmentDecoder::SegmentDecoder(const Schema& schema, const ReadLimits& limits,
                               std::uint32_t segment, DecodedParts parts)
    : schema_(&schema), limits_(limits), parts_(std::move(parts)) {
  start_.segment = segment;
}

Error SegmentDecoder::damaged(std::string detail, ErrorCode code) const {
  return Error{
      code, std::move(detail), "group " + std::to_string(group_number_), group_offset_, {}};
}

Result<void> SegmentDecoder::begin_group(container::GroupChunk chunk) {
  payload_ = std::move(chunk.payload);
  group_offset_ = chunk.offset;
  group_number_ = chunk.number;
  ByteReader in(payload_);
  if (!container::get(in, group_, chunk.version)) return damaged("the group header makes no sense");
  header_bytes_ = in.position();
  if (!decoder_) {
    start_.first_cell = next_cell_ = group_.first_cell;
    start_.first_vertex = next_vertex_ = group_.first_vertex;
  }
  if (auto good = check_header(); !good) return good;
  if (!decoder_) {
    auto cell_bytes = std::make_shared<const std::vector<std::size_t>>(cell_data_bytes(*schema_));
    auto made = make_group_decoder(*schema_, start_, parts_, std::move(cell_bytes), group_);
    if (!made) return placed(made.error());
    decoder_ = std::move(*made);
  }
  if (auto good = decoder_->begin_group(group_); !good) return placed(good.error());
  if (auto good = begin_streams(); !good) return good;
  next_cell_ += group_.cells;
  next_vertex_ += group_.vertices;
  in_group_ = true;
  return {};
}

Result<void> SegmentDecoder::check_header() {
  if (group_.first_cell != next_cell_ || group_.first_vertex != next_vertex_)
    return damaged("the group does not follow the one before it");
  if (start_.segment == 0 && group_.imported_vertices > 0)
    return damaged("the first segment cannot import vertices");
  if (group_.max_active_vertices > limits_.max_active_vertices)
    return damaged("needs " + std::to_string(group_.max_active_vertices) +
                       " active vertices, the limit is " +
                       std::to_string(limits_.max_active_vertices),
                   ErrorCode::over_limit);
  if (group_.decoded_bytes > limits_.max_group_bytes)
    return damaged("unpacks to " + std::to_string(group_.decoded_bytes) + " bytes, the limit is " +
                       std::to_string(limits_.max_group_bytes),
                   ErrorCode::over_limit);
  return {};
}

Result<void> SegmentDecoder::begin_streams() {
  stream_bytes_.clear();
  ByteReader in(std::span<const std::byte>(payload_).subspan(header_bytes_));
  for (const container::StreamEntry& entry : group_.streams) {
    // Streams of parts that are left out need not be there.
    const bool is_included = parts_.includes(entry);
    const auto bytes =
        in.get_bytes(is_included ? entry.bytes : std::min<std::uint64_t>(entry.bytes, in.left()));
    const std::string name = container::stream_name(entry.kind);
    if (!in.ok()) return damaged(name + ": ends beyond the group");
    if (!is_included) continue;
    if (checksum(bytes) != entry.checksum) return damaged(name + ": checksum does not match");
    if (auto good = decoder_->begin_stream(entry, bytes); !good) return placed(good.error());
    const bool array = entry.kind == container::StreamKind::array;
    stream_bytes_[array ? array_stream_name(*schema_, entry.array) : name] += bytes.size();
  }
  if (in.left() != 0) return damaged("bytes are left over behind the last stream");
  if (auto good = decoder_->end_streams(); !good) return placed(good.error());
  return {};
}

Result<DecodedBlock> SegmentDecoder::next_block() {
  DecodedBlock decoded;
  decoded.offset = group_offset_;
  if (auto good = decoder_->next_block(decoded); !good) return placed(good.error());
  if (!decoder_->is_complete()) return decoded;
  auto end = decoder_->end_group();
  if (!end) return placed(end.error());
  end->stream_bytes = std::move(stream_bytes_);
  decoded.group_end = std::move(*end);
  in_group_ = false;
  return decoded;
}

std::vector<std::uint64_t> SegmentDecoder::alive() const {
  return decoder_ ? decoder_->alive() : std::vector<std::uint64_t>();
}

}  // namespace shm
