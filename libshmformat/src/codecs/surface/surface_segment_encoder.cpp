#include "codecs/surface/surface_segment_encoder.h"

#include <span>
#include <utility>

#include "base/lists.h"

namespace shm {

SurfaceSegmentEncoder::SurfaceSegmentEncoder(const Schema& schema, const SegmentOptions& options,
                                             const SegmentStart& start)
    : SegmentEncoder(schema, options, start),
      streams_(schema, start),
      listed_(Streams::list(schema)) {
  streams_.connectivity().set_codec(options.codec);
  streams_.values().set_reach(farthest_reach(options.level));
}

void SurfaceSegmentEncoder::introduce(const SegmentPiece& piece, std::size_t first,
                                      std::size_t count) {
  for (std::size_t i = first; i < first + count; ++i) {
    const SegmentPiece::Vertex& vertex = piece.vertices[i];
    at_slot(handles_, vertex.handle) = {vertex.number, kNone, static_cast<std::uint32_t>(i)};
  }
}

void SurfaceSegmentEncoder::begin_element(bool is_cell) {
  if (tile_ends_.before(is_cell, group_.header.decoded_bytes)) streams_.values().begin_tile();
}

bool SurfaceSegmentEncoder::encode_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                                        const Place& place) {
  introduce(piece, place.vertex, cell.new_vertices);
  const auto nodes = piece.nodes_of(cell, place.node);
  stored_.block = cell.block;
  stored_.slots.resize(cell.nodes);
  stored_.numbers.assign(nodes.begin(), nodes.end());
  stored_.last_use.resize(cell.nodes);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    stored_.slots[i] = handles_[nodes[i]].slot;
    if (i < 8) stored_.original[i] = handles_[nodes[i]].number;
    stored_.last_use[i] = i < kMaxLastUse && (cell.last_use >> i & 1) != 0 ? 1 : 0;
  }
  for (std::uint32_t f = 0; f < cell.other_last_uses; ++f)
    stored_.last_use[piece.other_last_uses[place.other_last_use + f]] = 1;
  begin_element(true);
  if (!streams_.encode_cell(stored_, topology_)) return false;
  if (options_.values) streams_.values().begin_cell(topology_, active());
  encode_new_vertices(piece, place);
  streams_.code_cell_number(cell.number);
  if (options_.values) streams_.values().end_cell(topology_);
  note_active(active());
  streams_.finish_cell(topology_);
  return true;
}

void SurfaceSegmentEncoder::encode_new_vertices(const SegmentPiece& piece, const Place& place) {
  if (start_.segment > 0) streams_.begin_new_vertices(topology_);
  const auto handle_at = [&](std::uint32_t position) -> Handle& {
    return handles_[piece.nodes[place.node + topology_.stored_position(position)]];
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
    if (options_.values) streams_.values().add_vertex(topology_, position);
    take_vertex(piece, handle.vertex);
    handle.slot = slot;
  }
}

void SurfaceSegmentEncoder::encode_unused(const SegmentPiece& piece, std::size_t vertex) {
  begin_element(false);
  const std::uint32_t slot = streams_.connectivity().add_unused_vertex();
  std::uint64_t number = piece.vertices[vertex].number;
  streams_.code_unused_number(slot, number);
  if (options_.values) streams_.values().add_unused_vertex(slot);
  take_vertex(piece, vertex);
  note_active(active());
  streams_.connectivity().remove_unused_vertex(slot);
}

void SurfaceSegmentEncoder::encode_streams() {
  for (std::size_t s = 0; s < listed_.size(); ++s) {
    if (!streams_.holds_values(s))
      add_symbols(s);
    else if (options_.values)
      add_column(s);
  }
  streams_.values().clear();
}

void SurfaceSegmentEncoder::add_size_at_hand(SegmentSize& size) {
  for (std::size_t s = 0; s < listed_.size(); ++s)
    if (const std::uint64_t bytes = streams_.coders()[s].size(); bytes > 0)
      size.add(listed_[s].kind, bytes);
}

std::uint64_t SurfaceSegmentEncoder::values_at_hand(RatedDomains* rated) {
  std::uint64_t bytes = 0;
  for (std::size_t c = 0; c < values_.columns(); ++c) {
    ColumnPlanner& column = streams_.values().column(c);
    const TiledItems& elements = streams_.values().elements_of(c);
    const ColumnValues own = values_of(c);
    bytes += rated ? column.about_bytes(elements, own.values, own.stride, (*rated)[c])
                   : column.bytes_if_coded(elements, own.values, own.stride, options_.level);
  }
  return bytes;
}

// A decoder treats a missing stream as a stream of zeros. An empty stream is therefore not stored,
// unless the decoder needs its header to find out which codec is used.

void SurfaceSegmentEncoder::add_symbols(std::size_t stream) {
  using container::StreamKind;
  std::vector<std::byte> bytes = streams_.coders()[stream].finish();
  container::StreamEntry entry;
  entry.kind = listed_[stream].kind;
  if (bytes.empty() && !(entry.kind == StreamKind::connectivity && group_.header.cells > 0)) return;
  entry.codec = entry.kind >= StreamKind::vertex_numbers ? Codec::predictive : options_.codec_id;
  add_stream(entry, std::move(bytes));
}

void SurfaceSegmentEncoder::add_column(std::size_t stream) {
  const std::size_t c = streams_.column_of(stream);
  const ColumnValues own = values_of(c);
  EncodedColumn column = streams_.values().column(c).encode(streams_.values().elements_of(c),
                                                            own.values, own.stride, options_.level);
  if (column.bytes.empty() && own.special.empty() && column.codec == Codec::columns) return;
  add_values(c, own, column.codec, std::move(column.bytes));
}

}  // namespace shm
