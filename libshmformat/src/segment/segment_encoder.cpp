#include "segment/segment_encoder.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bytes/binary.h"
#include "bytes/lists.h"
#include "segment/shift_segment_encoder.h"

namespace shm {

std::unique_ptr<SegmentEncoder> make_segment_encoder(const Schema& schema,
                                                     const SegmentOptions& options,
                                                     const SegmentStart& start) {
  if (options.codec == ConnectivityCodec::shifts)
    return std::make_unique<ShiftSegmentEncoder>(schema, options, start);
  return std::make_unique<SurfaceSegmentEncoder>(schema, options, start);
}

SurfaceSegmentEncoder::SurfaceSegmentEncoder(const Schema& schema, const SegmentOptions& options,
                                             const SegmentStart& start)
    : schema_(&schema),
      group_cells_(options.group_cells),
      codec_(options.codec),
      level_(options.level),
      has_values_(options.values),
      tells_order_(options.tells_order),
      start_(start),
      streams_(schema, start),
      values_(schema),
      next_cell_(start.first_cell),
      next_vertex_(start.first_vertex) {
  streams_.connectivity().set_codec(codec_);
  streams_.values().expect_level(level_);
  for (const ArrayInfo& info : schema.arrays) {
    if (!info.per_step) continue;
    std::uint64_t& most = info.location == Location::point ? vertex_step_bytes_ : cell_step_bytes_;
    most = std::max<std::uint64_t>(most, scalar_bytes(info.type) * info.components);
  }
  start_group();
}

void SurfaceSegmentEncoder::start_group() {
  group_.segment = start_.segment;
  group_.header.first_cell = next_cell_;
  group_.header.first_vertex = next_vertex_;
}

Result<void> SurfaceSegmentEncoder::take(const SegmentPiece& piece,
                                         std::vector<EncodedGroup>& done) {
  Place at;
  for (const SegmentPiece::Cell& cell : piece.cells) {
    const container::GroupHeader& group = group_.header;
    introduce(piece, at.vertex, cell.new_vertices);
    if (cell.block == SegmentPiece::kLoose) {
      code_loose(piece, at.vertex);
      if (group.vertices >= kFullGroupVertices || holds_full_bytes()) flush_group(done);
    } else {
      if (group.loose_vertices > 0) flush_group(done);  // they stand last in their group
      if (!code_cell(piece, cell, at))
        return Error{ErrorCode::misuse,
                     "cell " + std::to_string(cell.number) +
                         " cannot be coded: two vertices have the same number",
                     "mesh",
                     kNoOffset,
                     {}};
      at.data += values_.cell_bytes(cell.block);
      if (group.cells >= group_cells_ || holds_full_bytes()) flush_group(done);
    }
    at.vertex += cell.new_vertices;
    at.node += cell.nodes;
  }
  return {};
}

void SurfaceSegmentEncoder::end(std::vector<EncodedGroup>& done) {
  const container::GroupHeader& group = group_.header;
  if (group.cells + group.vertices + group.imported_vertices > 0) flush_group(done);
}

void SurfaceSegmentEncoder::introduce(const SegmentPiece& piece, std::size_t first,
                                      std::size_t count) {
  for (std::size_t i = first; i < first + count; ++i) {
    const SegmentPiece::Vertex& vertex = piece.vertices[i];
    at_slot(handles_, vertex.handle) = {vertex.number, kNone, static_cast<std::uint32_t>(i)};
  }
}

bool SurfaceSegmentEncoder::code_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                                      const Place& at) {
  const auto nodes = std::span(piece.nodes).subspan(at.node, cell.nodes);
  topology_.block = cell.block;
  topology_.slots.resize(cell.nodes);
  topology_.numbers.assign(nodes.begin(), nodes.end());
  topology_.last_use.resize(cell.nodes);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    topology_.slots[i] = handles_[nodes[i]].slot;
    if (i < 8) topology_.original[i] = handles_[nodes[i]].number;
    topology_.last_use[i] = i < kMaxLastUse && (cell.last_use >> i & 1) != 0 ? 1 : 0;
  }
  if (tile_ends_.before(true, group_.header.decoded_bytes)) streams_.values().begin_tile();
  if (!streams_.code_cell(topology_)) return false;
  if (has_values_)
    streams_.values().begin_cell(topology_, streams_.connectivity().surface().active_vertices());
  code_new_vertices(piece, at);
  streams_.code_cell_number(cell.number);
  if (tells_order_) group_.cell_numbers.push_back(cell.number);
  if (has_values_) {
    values_.add_cell(cell.block, piece.cell_data.data() + at.data);
    streams_.values().end_cell(topology_);
  }
  note_active();
  group_.header.decoded_bytes += values_.cell_bytes(cell.block) + 8 * nodes.size();
  ++group_.header.cells;
  group_.hexahedra += topology_.hexahedral ? 1 : 0;
  streams_.finish_cell(topology_);
  return true;
}

void SurfaceSegmentEncoder::code_new_vertices(const SegmentPiece& piece, const Place& at) {
  if (start_.segment > 0) streams_.begin_new_vertices(topology_);
  const auto handle_at = [&](std::uint32_t position) -> Handle& {
    return handles_[piece.nodes[at.node + topology_.stored_position(position)]];
  };
  std::uint64_t number = 0;
  streams_.code_vertex_numbers(topology_, [&](std::uint32_t position) -> std::uint64_t& {
    number = piece.vertices[handle_at(position).vertex].number;
    return number;
  });
  for (std::uint32_t position : topology_.new_positions) {
    const std::uint32_t slot = topology_.slots[position];
    Handle& handle = handle_at(position);
    const SegmentPiece::Vertex& vertex = piece.vertices[handle.vertex];
    if (start_.segment > 0) {
      streams_.code_import(topology_, position, vertex.imported);
      if (vertex.imported && schema_->order != Order::keep)
        group_.imports.push_back(
            {vertex.ticket, slot, streams_.import_stencil(topology_, position)});
    }
    if (has_values_) streams_.values().add_vertex(topology_, position);
    take_vertex(piece, handle.vertex);
    handle.slot = slot;
  }
}

void SurfaceSegmentEncoder::code_loose(const SegmentPiece& piece, std::size_t vertex) {
  if (tile_ends_.before(false, group_.header.decoded_bytes)) streams_.values().begin_tile();
  const std::uint32_t slot = streams_.connectivity().add_loose_vertex();
  std::uint64_t number = piece.vertices[vertex].number;
  streams_.code_loose_number(slot, number);
  if (has_values_) streams_.values().add_loose_vertex(slot);
  take_vertex(piece, vertex);
  ++group_.header.loose_vertices;
  note_active();
  streams_.connectivity().remove_loose_vertex(slot);
}

void SurfaceSegmentEncoder::take_vertex(const SegmentPiece& piece, std::size_t index) {
  const SegmentPiece::Vertex& vertex = piece.vertices[index];
  if (has_values_) values_.add_vertex(piece.vertex_values.data() + index * values_.vertex_bytes());
  container::GroupHeader& group = group_.header;
  group.decoded_bytes += values_.vertex_bytes();
  if (vertex.imported) {
    ++group.imported_vertices;
  } else {
    ++group.vertices;
    if (tells_order_) group_.born.push_back({vertex.number, vertex.ticket});
  }
}

bool SurfaceSegmentEncoder::holds_full_bytes() const {
  const container::GroupHeader& group = group_.header;
  return group.decoded_bytes >= kFullGroupBytes ||
         group.vertices * vertex_step_bytes_ >= kFullGroupBytes ||
         group.cells * cell_step_bytes_ >= kFullGroupBytes;
}

void SurfaceSegmentEncoder::note_active() {
  const std::uint64_t active = streams_.connectivity().surface().active_vertices();
  group_.header.max_active_vertices = std::max(group_.header.max_active_vertices, active);
}

void SurfaceSegmentEncoder::flush_group(std::vector<EncodedGroup>& done) {
  using container::StreamKind;
  const auto names = MeshStreams<RangeEncoder>::list(*schema_);
  for (std::size_t s = 0; s < names.size(); ++s) {
    const bool values = streams_.holds_values(s);
    if (values && !has_values_) continue;
    EncodedColumn column;
    if (values) {
      const std::size_t c = streams_.column_of(s);
      column = streams_.values().encode(c, values_.values(c), values_.stride(c), level_);
    }
    std::vector<std::byte> bytes = values ? std::move(column.bytes) : streams_.coders()[s].finish();
    container::StreamEntry entry;
    entry.kind = names[s].kind;
    entry.array = names[s].array;
    // An absent stream reads as zeros; it is there to tell its codec where that may be another one.
    const bool tells = values ? column.codec != ColumnCodec::predicted
                              : entry.kind == StreamKind::connectivity && group_.header.cells > 0;
    if (bytes.empty() && !tells) continue;
    entry.codec = values                                     ? stream_codec(column.codec)
                  : entry.kind >= StreamKind::vertex_numbers ? container::Codec::predictive
                                                             : stream_codec(codec_);
    const auto needs = [&](StreamKind kind) { entry.needs |= 1u << static_cast<unsigned>(kind); };
    if (entry.kind != StreamKind::connectivity) needs(StreamKind::connectivity);
    const bool by_corner =
        entry.kind == StreamKind::vertex_numbers && schema_->order == Order::keep;
    if (by_corner || values ||
        entry.kind == StreamKind::imports)  // in stored order, and along stored axes
      needs(StreamKind::corner_order);
    entry.bytes = bytes.size();
    entry.checksum = checksum(bytes);
    group_.header.streams.push_back(entry);
    group_.streams.push_back(std::move(bytes));
  }
  group_.header.box = values_.box();
  group_.ranges = values_.ranges();
  streams_.values().clear();
  values_.clear();
  tile_ends_ = {};
  next_cell_ += group_.header.cells;
  next_vertex_ += group_.header.vertices;
  done.push_back(std::exchange(group_, group_like(group_)));
  start_group();
}

}  // namespace shm
