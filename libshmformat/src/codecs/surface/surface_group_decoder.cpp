#include "codecs/surface/surface_group_decoder.h"

#include <algorithm>
#include <string>
#include <utility>

#include "base/errors.h"

namespace shm {

using container::StreamKind;

SurfaceGroupDecoder::SurfaceGroupDecoder(const Schema& schema, const SegmentStart& start,
                                         const DecodedParts& parts, CellBytes cell_bytes)
    : GroupDecoder(schema, start, parts, std::move(cell_bytes)),
      streams_(schema, start, parts),
      listed_(Streams::list(schema)) {
  auto& values = streams_.values();
  for (std::size_t c = 0; c < values.columns(); ++c)
    if (values.has_column(c)) values.column(c).use_memory(memory_);
}

// --- streams

Result<void> SurfaceGroupDecoder::begin_streams(std::optional<ConnectivityCodec> codec) {
  // If the first groups have no cells, the codec is set when the first group with cells begins.
  if (codec && !codec_) {
    if (*codec == ConnectivityCodec::shifts)
      return corrupt(
          "connectivity: the segment switches to the codec shifts after its first group");
    streams_.connectivity().set_codec(*codec);
  }
  for (RangeDecoder& coder : streams_.coders()) coder = RangeDecoder(std::span<const std::byte>());
  streams_.values().begin_group();
  next_stream_ = 0;
  has_stream_.assign(columns(), false);
  return {};
}

Result<void> SurfaceGroupDecoder::begin_plain_stream(const container::StreamEntry& entry,
                                                     Codec codec,
                                                     std::span<const std::byte> bytes) {
  const auto is_listed = [&](const auto& stream) {
    return stream.kind == entry.kind &&
           (entry.kind != StreamKind::array || stream.array == entry.array);
  };
  const auto from = listed_.begin() + static_cast<std::ptrdiff_t>(next_stream_);
  const auto found = std::find_if(from, listed_.end(), is_listed);
  const bool of_cells = entry.kind < StreamKind::vertex_numbers;
  if (found == listed_.end() || (entry.kind == StreamKind::imports && !may_import()) ||
      (of_cells && !container::connectivity_of(*header_)))
    return wrong_stream(entry);
  const auto stream = static_cast<std::size_t>(found - listed_.begin());
  next_stream_ = stream + 1;
  if (streams_.holds_values(stream))
    return begin_column(entry, codec, streams_.column_of(stream), bytes);
  if (codec != (of_cells ? *codec_ : Codec::predictive)) return unknown_codec(entry);
  streams_.coders()[stream] = RangeDecoder(bytes);
  return {};
}

Result<void> SurfaceGroupDecoder::begin_column(const container::StreamEntry& entry, Codec codec,
                                               std::size_t column,
                                               std::span<const std::byte> bytes) {
  if (!streams_.values().column(column).takes(codec)) return unknown_codec(entry);
  if (!begin_values(column, codec, bytes))
    return corrupt(container::stream_name(entry.kind) + ": cannot be unpacked");
  has_stream_[column] = true;
  return {};
}

/// Begins the group in one column. Returns false if the data is damaged.
bool SurfaceGroupDecoder::begin_values(std::size_t column, Codec codec,
                                       std::span<const std::byte> bytes) {
  ColumnDecoder& own = streams_.values().column(column);
  if (!own.begin_group(codec, bytes, header_->decoded_bytes)) return false;
  streams_.values().need_reach(column, own.reach());
  return true;
}

/// Treats a missing stream as a stream of zeros. Connectivity is an exception: a group without a
/// connectivity stream has no cells.
Result<void> SurfaceGroupDecoder::end_streams() {
  for (std::size_t c = 0; c < columns(); ++c)
    if (is_wanted(c) && !has_stream_[c] && !begin_values(c, Codec::columns, {}))
      return corrupt("a stream of values is missing and cannot be replaced by zeros");
  if (header_->cells > 0 && !container::connectivity_of(*header_))
    return corrupt("connectivity: missing");
  return {};
}

// --- cells and vertices

Result<void> SurfaceGroupDecoder::decode_elements(DecodedBlock& decoded) {
  streams_.values().clear();
  begin_cells(decoded.mesh);
  const std::uint64_t bytes_before = done_.bytes;
  const auto is_full = [&] { return done_.bytes - bytes_before >= kTileBytes; };
  while (done_.cells < header_->cells && decoded.mesh.cell_count() < kTileCells && !is_full())
    if (auto status = decode_cell(decoded); !status) return status;
  while (done_.cells == header_->cells && done_.own < header_->vertices && !is_full())
    if (auto status = decode_unused(decoded); !status) return status;
  if (parts_.vertex_neighbourhoods || parts_.cell_neighbourhoods)
    for (const auto& items : {items().vertices, items().cells})
      for (const Neighbourhood& item : items) slots_ = std::max(slots_, item.self + 1);
  return {};
}

Result<void> SurfaceGroupDecoder::decode_cell(DecodedBlock& decoded) {
  CellTopology& cell = topology_;
  if (!streams_.decode_cell(cell))
    return corrupt("connectivity: cell " + std::to_string(header_->first_cell + done_.cells) +
                   " is invalid");
  done_.active = std::max(done_.active, active());
  if (done_.active > header_->max_active_vertices)
    return corrupt("more active vertices than its header states");
  done_.bytes += 8 * cell.slots.size() + (*cell_bytes_)[cell.block];
  if (!has_room_for_bytes(cell.new_positions.size() * vertex_bytes_))
    return corrupt("unpacks to more bytes than its header states");
  streams_.values().begin_cell(cell, active());
  if (auto status = decode_new_vertices(decoded); !status) return status;
  streams_.values().end_cell(cell);
  add_corners(decoded);
  streams_.finish_cell(cell);
  ++done_.cells;
  return {};
}

/// Appends the current cell to the block: its corners, element block, number and last uses.
void SurfaceGroupDecoder::add_corners(DecodedBlock& decoded) {
  const CellTopology& cell = topology_;
  MeshBlock& block = decoded.mesh;
  block.vertices_before_cell.push_back(block.vertex_count());
  block.cell_numbers.push_back(streams_.code_cell_number(0));
  block.cell_blocks.push_back(cell.block);
  const std::size_t begin = block.corners.size();
  block.corners.resize(begin + cell.slots.size());
  std::uint64_t last_use = 0;
  for (std::uint32_t i = 0; i < cell.slots.size(); ++i) {
    const std::uint32_t stored = cell.stored_position(i);
    Vertex& vertex = vertices_[cell.slots[i]];
    block.corners[begin + stored] = vertex.number;
    if (cell.last_use[i] == 0) continue;
    if (stored < kMaxLastUse)
      last_use |= std::uint64_t{1} << stored;
    else
      block.other_last_uses.push_back({block.last_use.size(), vertex.number});
    if (vertex.owner == Owner::earlier) decoded.finalized_imports.push_back(vertex.number);
    vertex.owner = Owner::nobody;
  }
  block.last_use.push_back(last_use);
  block.corner_begin.push_back(block.corners.size());
}

Result<void> SurfaceGroupDecoder::decode_new_vertices(DecodedBlock& decoded) {
  if (may_import()) streams_.begin_new_vertices(topology_);
  if (parts_.vertex_numbers || streams_.connectivity().codes_numbers())
    streams_.code_vertex_numbers(topology_, [&](std::uint32_t position) -> std::uint64_t& {
      return vertex_at(topology_.slots[position]).number;
    });
  for (std::uint32_t position : topology_.new_positions) {
    const std::uint32_t slot = topology_.slots[position];
    streams_.values().add_vertex(topology_, position);
    const auto status = may_import() && streams_.code_import(topology_, position, false)
                            ? decode_import(position, slot, decoded)
                            : decode_vertex(slot, decoded);
    if (!status) return status;
  }
  return {};
}

Result<void> SurfaceGroupDecoder::decode_vertex(std::uint32_t slot, DecodedBlock& decoded) {
  if (!has_room_for_vertex(false)) return corrupt("more vertices than its header states");
  Vertex& vertex = vertex_at(slot);
  if (numbered_by_order()) vertex.number = header_->first_vertex + done_.own;
  vertex.owner = Owner::own;
  add_vertex(vertex.number, false, decoded);
  return {};
}

Result<void> SurfaceGroupDecoder::decode_import(std::uint32_t position, std::uint32_t slot,
                                                DecodedBlock& decoded) {
  if (!has_room_for_vertex(true)) return corrupt("more imports than its header states");
  Vertex& vertex = vertex_at(slot);
  vertex.owner = Owner::earlier;
  if (numbered_by_order() && parts_.vertex_numbers) {
    streams_.code_import_number(streams_.import_stencil(topology_, position), slot, vertex.number);
    if (vertex.number >= start_.first_vertex)
      return corrupt("imports a vertex that no earlier segment owns");
  }
  add_vertex(vertex.number, true, decoded);
  return {};
}

Result<void> SurfaceGroupDecoder::decode_unused(DecodedBlock& decoded) {
  if (!has_room_for_bytes(vertex_bytes_))
    return corrupt("unpacks to more bytes than its header states");
  ++done_.unused;
  const std::uint32_t slot = streams_.connectivity().add_unused_vertex();
  done_.active = std::max(done_.active, active());
  streams_.code_unused_number(slot, vertex_at(slot).number);
  streams_.values().add_unused_vertex(slot);
  if (auto status = decode_vertex(slot, decoded); !status) return status;
  streams_.connectivity().remove_unused_vertex(slot);
  vertices_[slot].owner = Owner::nobody;
  return {};
}

bool SurfaceGroupDecoder::decode_column(std::size_t column, const MeshBlock&,
                                        std::vector<std::byte>& out) {
  const TiledItems& elements = streams_.values().elements_of(column);
  return streams_.values().column(column).decode_tile({elements.items, elements.blocks}, out);
}

std::vector<std::uint64_t> SurfaceGroupDecoder::alive() const {
  std::vector<std::uint64_t> numbers;
  for (const Vertex& vertex : vertices_)
    if (vertex.owner == Owner::own) numbers.push_back(vertex.number);
  return numbers;
}

}  // namespace shm
