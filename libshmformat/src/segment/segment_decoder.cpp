#include "segment/segment_decoder.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bytes/binary.h"
#include "bytes/lists.h"

namespace shm {
void leave_out(std::vector<std::byte>& values, const std::vector<std::uint8_t>& marked,
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
  if (!std::exchange(begun_, true)) {
    start_.first_cell = next_cell_ = group_.first_cell;
    start_.first_vertex = next_vertex_ = group_.first_vertex;
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
  if (!group_.streams.empty() && group_.streams[0].kind == container::StreamKind::connectivity)
    if (auto good = take_codec(group_.streams[0].codec); !good) return good;
  if (auto good = has_shifts() ? assign_shift_streams() : assign_streams(); !good) return good;
  done_ = {};
  in_group_ = true;
  return {};
}

/// Calls take(entry, bytes, name) for each stream of the group, whose checksum is right.
template <class Take>
Result<void> SegmentDecoder::for_each_stream(Take&& take) {
  using container::StreamKind;
  stream_bytes_.clear();
  ByteReader in(std::span<const std::byte>(payload_).subspan(header_bytes_));
  for (const container::StreamEntry& entry : group_.streams) {
    // Streams that nobody wants need not be there.
    const bool wanted = wanted_.include(entry);
    const auto bytes =
        in.get_bytes(wanted ? entry.bytes : std::min<std::uint64_t>(entry.bytes, in.left()));
    const std::string name = container::stream_name(entry.kind);
    if (!in.ok()) return damaged(name + ": ends beyond the group");
    if (!wanted) continue;
    if (checksum(bytes) != entry.checksum) return damaged(name + ": checksum does not match");
    if (auto good = take(entry, bytes, name); !good) return good;
    const bool array = entry.kind == StreamKind::array;
    stream_bytes_[array ? array_stream_name(*schema_, entry.array) : name] += bytes.size();
  }
  if (in.left() != 0) return damaged("bytes are left over behind the last stream");
  return {};
}

Result<void> SegmentDecoder::assign_shift_streams() {
  if (!shifts_) {
    if (!takes_shifts(*schema_))
      return damaged("connectivity: shifts are not for this schema", ErrorCode::unsupported);
    shifts_ = std::make_unique<ShiftSegmentDecoder>(*schema_, start_, wanted_);
  }
  if (group_.streams.empty() || group_.streams[0].kind != container::StreamKind::connectivity)
    return damaged("connectivity: missing");
  shifts_->begin_group(group_);
  return for_each_stream([&](const container::StreamEntry& entry, std::span<const std::byte> bytes,
                             const std::string& name) -> Result<void> {
    if (!shifts_->expects(entry)) return damaged(name + ": unknown or out of order");
    if (!shifts_->takes(entry))
      return damaged(
          name + ": codec " + std::to_string(static_cast<int>(entry.codec)) + " is unknown here",
          ErrorCode::unsupported);
    if (const auto complaint = shifts_->take(entry, bytes); !complaint.empty())
      return damaged(complaint);
    return {};
  });
}

Result<void> SegmentDecoder::assign_streams() {
  using container::StreamKind;
  if (!streams_) {
    streams_ = std::make_unique<MeshStreams<RangeDecoder>>(*schema_, start_);
    if (codec_) streams_->connectivity().set_codec(connectivity_);
  }
  const auto known = MeshStreams<RangeDecoder>::list(*schema_);
  for (RangeDecoder& coder : streams_->coders()) coder = RangeDecoder(std::span<const std::byte>());
  streams_->values().begin_group();
  std::vector<char> listed(known.size());
  std::size_t next = 0;
  const auto take = [&](const container::StreamEntry& entry, std::span<const std::byte> bytes,
                        const std::string& name) -> Result<void> {
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
    if (topology && entry.kind != StreamKind::connectivity && &entry == &group_.streams[0])
      return damaged(name + ": stands where connectivity should");
    if (!is_known)
      return damaged(
          name + ": codec " + std::to_string(static_cast<int>(entry.codec)) + " is unknown here",
          ErrorCode::unsupported);
    if (!values) {
      streams_->coders()[next] = RangeDecoder(bytes);
    } else if (!streams_->values().begin_column(streams_->column_of(next), *column, bytes,
                                                group_.decoded_bytes)) {
      return damaged(name + ": cannot be unpacked");
    }
    listed[next] = 1;
    ++next;
    return {};
  };
  if (auto good = for_each_stream(take); !good) return good;
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
  // Where a group of loose vertices came first, the surface is there.
  if (streams_ && !codec_) {
    if (*said == ConnectivityCodec::shifts)
      return damaged("connectivity: shifts begin behind the first group of their segment");
    streams_->connectivity().set_codec(*said);
  }
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
  if (auto good = next_cells(decoded); !good) return good.error();
  if (done_.cells == group_.cells && done_.own == group_.vertices)
    if (auto good = end_group(decoded); !good) return good.error();
  return decoded;
}

Result<void> SegmentDecoder::next_cells(DecodedBlock& decoded) {
  MeshBlock& block = decoded.mesh;
  if (has_shifts()) {
    const auto complaint = shifts_->next_block(decoded, done_, imports_ == Imports::yielded);
    next_cell_ += block.cell_count();
    next_vertex_ = group_.first_vertex + done_.own;
    return complaint.empty() ? Result<void>() : damaged(complaint);
  }
  const std::uint64_t bytes_before = done_.bytes;
  while (done_.cells < group_.cells && block.cell_count() < kTileCells &&
         done_.bytes - bytes_before < kTileBytes)
    if (auto good = decode_cell(decoded); !good) return good;
  while (done_.cells == group_.cells && done_.own < group_.vertices &&
         done_.bytes - bytes_before < kTileBytes) {
    if (done_.bytes + vertex_bytes_ > group_.decoded_bytes)
      return damaged("unpacks to more than stated");
    ++done_.loose;
    const std::uint32_t slot = streams_->connectivity().add_loose_vertex();
    done_.active = std::max(done_.active, streams_->connectivity().surface().active_vertices());
    streams_->code_loose_number(slot, vertex_at(slot).number);
    streams_->values().add_loose_vertex(slot);
    if (auto good = decode_vertex(slot, block); !good) return good;
    streams_->connectivity().remove_loose_vertex(slot);
    vertices_[slot].owner = Owner::nobody;
  }
  return decode_values(block);
}

Result<void> SegmentDecoder::decode_cell(DecodedBlock& decoded) {
  CellTopology& cell = topology_;
  MeshBlock& block = decoded.mesh;
  if (!streams_->code_cell(cell))
    return damaged("connectivity: cell " + std::to_string(next_cell_) + " makes no sense");
  done_.active = std::max(done_.active, streams_->connectivity().surface().active_vertices());
  if (done_.active > group_.max_active_vertices) return damaged("more active vertices than stated");
  done_.bytes += 8 * cell.slots.size() + cell_bytes_[cell.block];
  if (done_.bytes + cell.new_positions.size() * vertex_bytes_ > group_.decoded_bytes)
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
  ++done_.cells;
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
  if (done_.own == group_.vertices) return damaged("more vertices than stated");
  Vertex& vertex = vertex_at(slot);
  if (schema_->order != Order::keep) vertex.number = next_vertex_;
  vertex.owner = Owner::own;
  block.vertex_numbers.push_back(vertex.number);
  if (imports_ == Imports::yielded)
    block.imported.push_back(0);
  else
    left_out_.push_back(0);
  done_.bytes += vertex_bytes_;
  ++done_.own;
  ++next_vertex_;
  return {};
}

Result<void> SegmentDecoder::decode_import(std::uint32_t position, std::uint32_t slot,
                                           DecodedBlock& decoded) {
  if (done_.imported == group_.imported_vertices) return damaged("more imports than stated");
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
  done_.bytes += vertex_bytes_;
  ++done_.imported;
  return {};
}

/// The values of the cells and vertices of the block: a tile.
Result<void> SegmentDecoder::decode_values(MeshBlock& block) {
  ValueStreams<SplitDecoder>& values = streams_->values();
  const bool leaves_out = std::find(left_out_.begin(), left_out_.end(), 1) != left_out_.end();
  for (std::size_t c = 0; c < values.columns(); ++c) {
    const bool geometry = c == 0;
    const std::uint32_t a = geometry ? 0 : values.array_of(c);
    if (geometry ? !wanted_.geometry : !wanted_.includes_array(a)) continue;
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
  return at_slot(vertices_, slot);
}

std::vector<std::uint64_t> SegmentDecoder::alive() const {
  if (shifts_) return shifts_->alive();
  std::vector<std::uint64_t> numbers;
  for (const Vertex& vertex : vertices_)
    if (vertex.owner == Owner::own) numbers.push_back(vertex.number);
  return numbers;
}

Result<void> SegmentDecoder::end_group(DecodedBlock& block) {
  if (done_.bytes != group_.decoded_bytes || done_.active != group_.max_active_vertices ||
      done_.loose != group_.loose_vertices || done_.imported != group_.imported_vertices)
    return damaged("does not hold what its header states");
  if (shifts_ && !shifts_->at_end()) return damaged("its streams hold more than the group");
  block.group_end = DecodedBlock::GroupEnd{done_.imported, done_.active, std::move(stream_bytes_)};
  in_group_ = false;
  return {};
}

}  // namespace shm
