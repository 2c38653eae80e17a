#include "segment_decoder.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bytes/checksum.h"

namespace shm {
namespace {

/// Leaves out the elements of `stride` bytes that are marked.
void leave_out(std::vector<std::byte>& values, const std::vector<char>& marked,
               std::size_t stride) {
  std::size_t to = 0;
  for (std::size_t i = 0; i < marked.size(); ++i) {
    if (marked[i] != 0) continue;
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * stride), stride,
                values.begin() + static_cast<std::ptrdiff_t>(to));
    to += stride;
  }
  values.resize(to);
}

}  // namespace

SegmentDecoder::SegmentDecoder(const Schema& schema, const ReadLimits& limits,
                               std::uint32_t segment, Imports imports)
    : schema_(&schema), limits_(limits), imports_(imports) {
  start_.segment = segment;
}

Error SegmentDecoder::damaged(std::string detail, ErrorCode code) const {
  return Error{
      code, std::move(detail), "group " + std::to_string(group_number_), group_offset_, {}};
}

Result<void> SegmentDecoder::begin_group(std::vector<std::byte> payload, std::uint64_t offset,
                                         std::uint64_t group) {
  payload_ = std::move(payload);
  group_offset_ = offset;
  group_number_ = group;
  ByteReader in(payload_);
  if (!container::get(in, group_)) return damaged("the group header makes no sense");
  header_bytes_ = in.position();
  if (!streams_) {
    start_.first_cell = next_cell_ = group_.first_cell;
    start_.first_vertex = next_vertex_ = group_.first_vertex;
    streams_ = std::make_unique<MeshStreams<RangeDecoder>>(*schema_, start_);
    vertex_bytes_ = 3 * scalar_bytes(schema_->coordinate_type) + point_data_bytes(*schema_);
    cell_bytes_ = cell_data_bytes(*schema_);
  }
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
  if (auto good = assign_streams(); !good) return good;
  cells_done_ = 0;
  own_done_ = imported_done_ = loose_done_ = bytes_done_ = active_seen_ = 0;
  in_group_ = true;
  return {};
}

Result<void> SegmentDecoder::assign_streams() {
  using container::StreamKind;
  const auto known = MeshStreams<RangeDecoder>::list(*schema_);
  for (RangeDecoder& coder : streams_->coders()) coder = RangeDecoder(std::span<const std::byte>());
  streams_->values().begin_group();
  std::vector<char> listed(known.size());
  stream_bytes_.clear();
  ByteReader in(std::span<const std::byte>(payload_).subspan(header_bytes_));
  std::size_t next = 0;
  for (const container::StreamEntry& entry : group_.streams) {
    const auto bytes = in.get_bytes(entry.bytes);
    const std::string name = container::stream_name(entry.kind);
    if (!in.ok()) return damaged(name + ": ends beyond the group");
    if (checksum(bytes) != entry.checksum) return damaged(name + ": checksum does not match");
    while (next < known.size() &&
           (known[next].kind != entry.kind ||
            (entry.kind == StreamKind::array && known[next].array != entry.array)))
      ++next;
    if (next == known.size() || (start_.segment == 0 && entry.kind == StreamKind::imports))
      return damaged(name + ": unknown or out of order");
    const bool topology = entry.kind < StreamKind::vertex_numbers;
    const bool values = streams_->holds_values(next);
    const std::optional<ColumnCodec> column = column_codec(entry.codec);
    const bool is_known =
        values     ? column && streams_->values().takes(streams_->column_of(next), *column)
        : topology ? entry.codec == codec_.value_or(entry.codec)
                   : entry.codec == container::Codec::predictive;
    if (entry.kind == StreamKind::connectivity) {
      if (auto good = take_codec(entry.codec); !good) return good;
    } else if (topology && &entry == &group_.streams[0]) {
      return damaged(name + ": stands where connectivity should");
    } else if (!is_known) {
      return damaged(
          name + ": codec " + std::to_string(static_cast<int>(entry.codec)) + " is unknown here",
          ErrorCode::unsupported);
    }
    if (!values) {
      streams_->coders()[next] = RangeDecoder(bytes);
    } else if (!streams_->values().begin_column(streams_->column_of(next), *column, bytes,
                                                group_.decoded_bytes)) {
      return damaged(name + ": cannot be unpacked");
    }
    listed[next] = 1;
    ++next;
    const std::string key =
        entry.kind == StreamKind::array ? array_stream_name(*schema_, entry.array) : name;
    stream_bytes_[key] += bytes.size();
  }
  if (in.left() != 0) return damaged("bytes are left over behind the last stream");
  for (std::size_t s = 0; s < known.size(); ++s)
    if (listed[s] == 0 && streams_->holds_values(s) &&
        !streams_->values().begin_column(streams_->column_of(s), ColumnCodec::predicted, {},
                                         group_.decoded_bytes))
      return damaged("a stream that is not there makes no sense");
  if (group_.cells > 0 &&
      (group_.streams.empty() || group_.streams[0].kind != StreamKind::connectivity))
    return damaged("connectivity: missing");
  return {};
}

Result<void> SegmentDecoder::take_codec(container::Codec codec) {
  if (codec_ && *codec_ != codec)
    return damaged("connectivity: another codec than before in this segment");
  const std::optional<ConnectivityCodec> said = connectivity_codec(codec);
  if (!said)
    return damaged("connectivity: codec " + std::to_string(static_cast<int>(codec)) + " is unknown",
                   ErrorCode::unsupported);
  if (!codec_) streams_->connectivity().set_codec(*said);
  connectivity_ = *said;
  codec_ = codec;
  return {};
}

Result<DecodedBlock> SegmentDecoder::next_block() {
  DecodedBlock decoded;
  MeshBlock& block = decoded.mesh;
  decoded.segment = start_;
  decoded.connectivity = connectivity_;
  decoded.offset = group_offset_;
  block.first_vertex = next_vertex_;
  block.first_cell = next_cell_;
  block.corner_begin.push_back(0);
  block.arrays.resize(schema_->arrays.size());
  const std::uint64_t bytes_before = bytes_done_;
  while (cells_done_ < group_.cells && block.cell_count() < kTileCells &&
         bytes_done_ - bytes_before < kTileBytes)
    if (auto good = decode_cell(decoded); !good) return good.error();
  while (cells_done_ == group_.cells && own_done_ < group_.vertices &&
         bytes_done_ - bytes_before < kTileBytes) {
    if (bytes_done_ + vertex_bytes_ > group_.decoded_bytes)
      return damaged("unpacks to more than stated");
    ++loose_done_;
    const std::uint32_t slot = streams_->connectivity().add_loose_vertex();
    active_seen_ = std::max(active_seen_, streams_->connectivity().surface().active_vertices());
    streams_->code_loose_number(slot, vertex_at(slot).number);
    streams_->values().add_loose_vertex(slot);
    if (auto good = decode_vertex(slot, block); !good) return good.error();
    streams_->connectivity().remove_loose_vertex(slot);
    vertices_[slot].owner = Owner::nobody;
  }
  if (auto good = decode_values(block); !good) return good.error();
  if (cells_done_ == group_.cells && own_done_ == group_.vertices)
    if (auto good = end_group(decoded); !good) return good.error();
  return decoded;
}

Result<void> SegmentDecoder::decode_cell(DecodedBlock& decoded) {
  CellTopology& cell = topology_;
  MeshBlock& block = decoded.mesh;
  if (!streams_->code_cell(cell))
    return damaged("connectivity: cell " + std::to_string(next_cell_) + " makes no sense");
  active_seen_ = std::max(active_seen_, streams_->connectivity().surface().active_vertices());
  if (active_seen_ > group_.max_active_vertices) return damaged("more active vertices than stated");
  bytes_done_ += 8 * cell.slots.size() + cell_bytes_[cell.block];
  if (bytes_done_ + cell.new_positions.size() * vertex_bytes_ > group_.decoded_bytes)
    return damaged("unpacks to more than stated");
  streams_->values().begin_cell(cell, streams_->connectivity().surface().active_vertices());
  if (auto good = decode_new_vertices(decoded); !good) return good;
  streams_->values().end_cell(cell);

  block.vertices_before_cell.push_back(block.vertex_count());
  block.cell_numbers.push_back(streams_->code_cell_number(0));
  block.cell_blocks.push_back(cell.block);
  const std::size_t begin = block.corners.size();
  block.corners.resize(begin + cell.slots.size());
  std::uint64_t last_use = 0;
  for (std::uint32_t i = 0; i < cell.slots.size(); ++i) {
    const std::uint32_t stored = cell.stored_position(i);
    Vertex& vertex = vertices_[cell.slots[i]];
    block.corners[begin + stored] = vertex.number;
    if (cell.last_use[i] == 0) continue;
    last_use |= std::uint64_t{1} << stored;
    if (vertex.owner == Owner::earlier) decoded.finalized_imports.push_back(vertex.number);
    vertex.owner = Owner::nobody;
  }
  block.last_use.push_back(last_use);
  block.corner_begin.push_back(block.corners.size());

  streams_->finish_cell(cell);
  ++cells_done_;
  ++next_cell_;
  return {};
}

Result<void> SegmentDecoder::decode_new_vertices(DecodedBlock& decoded) {
  const bool may_import = start_.segment > 0;
  if (may_import) streams_->begin_new_vertices(topology_);
  streams_->code_vertex_numbers(topology_, [&](std::uint32_t position) -> std::uint64_t& {
    return vertex_at(topology_.slots[position]).number;
  });
  for (std::uint32_t position : topology_.new_positions) {
    const std::uint32_t slot = topology_.slots[position];
    streams_->values().add_vertex(topology_, position);
    const auto good = may_import && streams_->code_import(topology_, position, false)
                          ? decode_import(position, slot, decoded)
                          : decode_vertex(slot, decoded.mesh);
    if (!good) return good;
  }
  return {};
}

Result<void> SegmentDecoder::decode_vertex(std::uint32_t slot, MeshBlock& block) {
  if (own_done_ == group_.vertices) return damaged("more vertices than stated");
  Vertex& vertex = vertex_at(slot);
  if (schema_->order != Order::keep) vertex.number = next_vertex_;
  vertex.owner = Owner::own;
  block.vertex_numbers.push_back(vertex.number);
  if (imports_ == Imports::yielded)
    block.imported.push_back(0);
  else
    left_out_.push_back(0);
  bytes_done_ += vertex_bytes_;
  ++own_done_;
  ++next_vertex_;
  return {};
}

Result<void> SegmentDecoder::decode_import(std::uint32_t position, std::uint32_t slot,
                                           DecodedBlock& decoded) {
  if (imported_done_ == group_.imported_vertices) return damaged("more imports than stated");
  Vertex& vertex = vertex_at(slot);
  vertex.owner = Owner::earlier;
  if (schema_->order != Order::keep) {
    streams_->code_import_number(streams_->import_stencil(topology_, position), slot,
                                 vertex.number);
    if (vertex.number >= start_.first_vertex)
      return damaged("imports a vertex that no earlier segment has");
  }
  if (imports_ == Imports::yielded) {
    decoded.mesh.vertex_numbers.push_back(vertex.number);
    decoded.mesh.imported.push_back(1);
  } else {
    left_out_.push_back(1);
  }
  decoded.imported.push_back(vertex.number);
  bytes_done_ += vertex_bytes_;
  ++imported_done_;
  return {};
}

/// The values of the cells and vertices of the block: a tile.
Result<void> SegmentDecoder::decode_values(MeshBlock& block) {
  ValueStreams<SplitDecoder>& values = streams_->values();
  const bool leaves_out = std::find(left_out_.begin(), left_out_.end(), 1) != left_out_.end();
  for (std::size_t c = 0; c < values.columns(); ++c) {
    const bool geometry = c == 0;
    const std::uint32_t a = geometry ? 0 : values.array_of(c);
    std::vector<std::byte>& out = geometry ? block.xyz : block.arrays[a];
    if (!values.decode_tile(c, out))
      return damaged((geometry ? "geometry" : array_stream_name(*schema_, a)) +
                     ": its values make no sense");
    if (!leaves_out || (!geometry && schema_->arrays[a].location == Location::cell)) continue;
    leave_out(out, left_out_,
              geometry ? 3 * scalar_bytes(schema_->coordinate_type)
                       : scalar_bytes(schema_->arrays[a].type) * schema_->arrays[a].components);
  }
  values.clear();
  left_out_.clear();
  return {};
}

SegmentDecoder::Vertex& SegmentDecoder::vertex_at(std::uint32_t slot) {
  if (slot >= vertices_.size())
    vertices_.resize(std::max<std::size_t>(std::size_t{slot} + 1, vertices_.size() * 2));
  return vertices_[slot];
}

std::vector<std::uint64_t> SegmentDecoder::alive() const {
  std::vector<std::uint64_t> numbers;
  for (const Vertex& vertex : vertices_)
    if (vertex.owner == Owner::own) numbers.push_back(vertex.number);
  return numbers;
}

Result<void> SegmentDecoder::end_group(DecodedBlock& block) {
  if (bytes_done_ != group_.decoded_bytes || active_seen_ != group_.max_active_vertices ||
      loose_done_ != group_.loose_vertices || imported_done_ != group_.imported_vertices)
    return damaged("does not hold what its header states");
  block.group_end = DecodedBlock::GroupEnd{imported_done_, active_seen_, std::move(stream_bytes_)};
  in_group_ = false;
  return {};
}

}  // namespace shm
