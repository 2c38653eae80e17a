#include "segment/value_streams.h"

#include <algorithm>

namespace shm {
ArrayInfo coordinates_info(const Schema& schema) {
  ArrayInfo info;
  info.type = schema.coordinate_type;
  info.components = 3;
  info.quantization = schema.coordinate_quantization;
  return info;
}

namespace {

bool has_cell_arrays(const Schema& schema) {
  return std::any_of(schema.arrays.begin(), schema.arrays.end(), [](const ArrayInfo& info) {
    return info.location == Location::cell && !info.per_step;
  });
}

}  // namespace

template <class Coder>
ValueStreams<Coder>::ValueStreams(const Schema& schema)
    : schema_(&schema), has_cell_arrays_(has_cell_arrays(schema)), finder_(has_cell_arrays_) {
  for_each_static_column(schema, [&](auto&&... what) { columns_.emplace_back(what...); });
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (!schema.arrays[a].per_step) arrays_.push_back(a);
}

template <class Coder>
bool ValueStreams<Coder>::of_cells(std::size_t column) const {
  return column > 0 && schema_->arrays[arrays_[column - 1]].location == Location::cell;
}

template <class Coder>
void ValueStreams<Coder>::begin_cell(const CellTopology& cell, std::uint64_t live) {
  const bool as_stored = schema_->corner_order || schema_->blocks[cell.block].nodes_per_cell != 8;
  finder_.begin_cell(cell, as_stored, live);
}

template <class Coder>
void ValueStreams<Coder>::end_cell(const CellTopology& cell) {
  if (has_cell_arrays_) {
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
  return columns_[column].encode(of_cells(column) ? cells_ : vertices_, values, stride, level);
}

template <class Coder>
void ValueStreams<Coder>::begin_group() {
  vertex_reach_ = cell_reach_ = Reach::lattice;
}

template <class Coder>
bool ValueStreams<Coder>::begin_column(std::size_t column, ColumnCodec codec,
                                       std::span<const std::byte> bytes, std::uint64_t limit) {
  if (!columns_[column].begin_group(codec, bytes, limit)) return false;
  Reach& reach = of_cells(column) ? cell_reach_ : vertex_reach_;
  reach = std::max(reach, columns_[column].reach());
  return true;
}

template <class Coder>
bool ValueStreams<Coder>::decode_tile(std::size_t column, std::vector<std::byte>& out) {
  const TiledItems& elements = of_cells(column) ? cells_ : vertices_;
  return columns_[column].decode_tile({elements.items, elements.blocks}, out);
}

template <class Coder>
void ValueStreams<Coder>::clear() {
  vertices_.clear();
  cells_.clear();
}

template class ValueStreams<SplitEncoder>;
template class ValueStreams<SplitDecoder>;

}  // namespace shm
