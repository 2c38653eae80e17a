#include "codecs/surface/mesh_streams.h"

#include <algorithm>

namespace shm {
template <class Coder>
ValueStreams<Coder>::ValueStreams(const Schema& schema, const DecodedParts& parts)
    : schema_(&schema),
      of_vertices_(parts.vertex_neighbourhoods ||
                   parts.includes_values_of(schema, Location::point)),
      of_cells_(parts.cell_neighbourhoods || parts.includes_values_of(schema, Location::cell)),
      finder_(of_cells_) {
  if (parts.vertex_neighbourhoods) least_vertex_reach_ = Reach::farther;
  if (parts.cell_neighbourhoods) least_cell_reach_ = Reach::farther;
  is_of_cells_.push_back(false);
  for (const ArrayInfo& info : schema.arrays)
    if (!info.per_step) is_of_cells_.push_back(info.location == Location::cell);
  const std::vector<bool> included = parts.columns(schema);
  for_each_static_column(schema, [&](auto&&... arguments) {
    auto& column = columns_.emplace_back();
    if (included[columns_.size() - 1]) column.emplace(arguments...);
  });
  if constexpr (Coder::kDecodes) {
    memory_ = std::make_unique<ColumnMemory>();
    for (auto& column : columns_)
      if (column) column->use_memory(*memory_);
  }
}

template <class Coder>
void ValueStreams<Coder>::begin_cell(const CellTopology& cell, std::uint64_t live) {
  if (!finds()) return;
  const bool as_stored = schema_->corner_order || schema_->blocks[cell.block].nodes_per_cell != 8;
  finder_.begin_cell(cell, as_stored, live);
}

template <class Coder>
void ValueStreams<Coder>::end_cell(const CellTopology& cell) {
  if (!finds()) return;
  if (of_cells_) {
    push_tightly(cells_.items, finder_.cell(cell, cell_reach_));
    push_tightly(cells_.blocks, cell.block);
  }
  finder_.end_cell(cell);
}

template <class Coder>
void ValueStreams<Coder>::begin_tile() {
  vertices_.tile_begin.push_back(vertices_.items.size());
  cells_.tile_begin.push_back(cells_.items.size());
}

template <class Coder>
EncodedColumn ValueStreams<Coder>::encode(std::size_t column, const std::byte* values,
                                          std::size_t stride, Level level) {
  return columns_[column]->encode(elements_of(column), values, stride, level);
}

template <class Coder>
bool ValueStreams<Coder>::begin_column(std::size_t column, Codec codec,
                                       std::span<const std::byte> bytes, std::uint64_t limit) {
  if (!columns_[column]->begin_group(codec, bytes, limit)) return false;
  Reach& reach = is_of_cells_[column] ? cell_reach_ : vertex_reach_;
  reach = std::max(reach, columns_[column]->reach());
  return true;
}

template <class Coder>
bool ValueStreams<Coder>::decode_tile(std::size_t column, std::vector<std::byte>& out) {
  const TiledItems& elements = elements_of(column);
  return columns_[column]->decode_tile({elements.items, elements.blocks}, out);
}

template <class Coder>
void ValueStreams<Coder>::clear() {
  vertices_.clear();
  cells_.clear();
}

// --- all bitstreams

template <class Coder>
auto MeshStreams<Coder>::list(const Schema& schema) -> std::vector<Stream> {
  using container::StreamKind;
  std::vector<Stream> streams = {{StreamKind::connectivity},
                                 {StreamKind::corner_order},
                                 {StreamKind::cell_numbers},
                                 {StreamKind::vertex_numbers},
                                 {StreamKind::geometry}};
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (!schema.arrays[a].per_step) streams.push_back({StreamKind::array, a});
  streams.push_back({StreamKind::imports});
  return streams;
}

template <class Coder>
MeshStreams<Coder>::MeshStreams(const Schema& schema, const SegmentStart& start,
                                const DecodedParts& parts)
    : schema_(&schema),
      connectivity_(schema),
      values_(schema, parts),
      cell_numbers_(schema, start.first_cell) {
  streams_.resize(list(schema).size());
  imports_stream_ = streams_.size() - 1;
}

template class ValueStreams<SplitEncoder>;
template class ValueStreams<SplitDecoder>;
template class MeshStreams<RangeEncoder>;
template class MeshStreams<RangeDecoder>;

}  // namespace shm
