#include "codecs/patterns/pattern_segment_encoder.h"

#include <algorithm>
#include <utility>

#include "base/lists.h"

namespace shm {

using container::StreamKind;

PatternSegmentEncoder::PatternSegmentEncoder(const Schema& schema, const SegmentOptions& options,
                                             const SegmentStart& start)
    : SegmentEncoder(schema, options, start),
      patterns_(schema, schema.order == Order::keep),
      finder_(schema),
      columns_(term_columns(schema)) {}

void PatternSegmentEncoder::take(const SegmentPiece& piece, std::size_t index) {
  const SegmentPiece::Vertex& vertex = piece.vertices[index];
  take_vertex(piece, index);
  if (vertex.imported && schema_->order != Order::keep)
    group_.imports.push_back({vertex.ticket, 0, {}});
}

bool PatternSegmentEncoder::encode_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                                        const Place& place) {
  const auto nodes = piece.nodes_of(cell, place.node);
  PatternCell coded;
  coded.block = cell.block;
  coded.last_use = cell.last_use;
  numbers_.clear();
  std::size_t vertex = place.vertex;
  const std::size_t end = vertex + cell.new_vertices;
  for (std::size_t i = 0; vertex < end; ++i) {
    if (piece.vertices[vertex].handle != nodes[i]) continue;
    coded.introduced |= std::uint64_t{1} << i;
    if (piece.vertices[vertex].imported) coded.imports |= std::uint64_t{1} << i;
    numbers_.push_back(piece.vertices[vertex].number);
    take(piece, vertex++);
  }
  const std::uint64_t live_before = patterns_.live();
  patterns_.add_cell(coded, nodes, numbers_);
  note_active(live_before + cell.new_vertices);
  if (!options_.values) return true;
  coded.slots = patterns_.slots();
  coded.again = patterns_.again();
  finder_.add_cell(coded, vertices_);
  cell_blocks_.push_back(cell.block);
  return true;
}

void PatternSegmentEncoder::encode_unused(const SegmentPiece& piece, std::size_t vertex) {
  patterns_.add_unused(piece.vertices[vertex].number);
  take(piece, vertex);
  note_active(patterns_.live() + 1);
  if (options_.values) vertices_.push_back({patterns_.slot_count(), 0, {}});
}

/// Adds nothing, because this codec is never a candidate if codecs are chosen by size.
void PatternSegmentEncoder::add_size_at_hand(SegmentSize&) {}
std::uint64_t PatternSegmentEncoder::values_at_hand(RatedDomains*) { return 0; }

void PatternSegmentEncoder::encode_streams() {
  container::StreamEntry connectivity;
  connectivity.kind = StreamKind::connectivity;
  connectivity.codec = container::Codec::patterns;
  add_stream(connectivity, patterns_.finish(scratch_.packing));
  for (std::size_t c = 0; options_.values && c < columns_.size(); ++c) {
    TermColumn::Elements elements;
    if (values_.of_cells(c)) {
      elements.count = static_cast<std::size_t>(std::count_if(
          cell_blocks_.begin(), cell_blocks_.end(),
          [&](std::uint32_t block) { return schema_->array_covers(values_.array(c), block); }));
    } else {
      elements = {vertices_, vertices_.size(), patterns_.slot_count() + 1};
    }
    if (elements.count == 0) continue;
    const ColumnValues own = values_of(c);
    auto encoded = columns_[c].encode(elements, own.values, own.stride, scratch_);
    add_values(c, own, encoded.codec, std::move(encoded.bytes));
  }
  vertices_.clear();
  cell_blocks_.clear();
}

}  // namespace shm
