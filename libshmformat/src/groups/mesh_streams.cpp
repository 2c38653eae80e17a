#include "groups/mesh_streams.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

namespace shm {
namespace {

/// One pass over all points. Returns nothing if a coordinate is infinite, since a range cannot
/// represent it.
template <class T>
std::optional<std::array<ValueRange, 3>> finite_box(const std::byte* points, std::size_t count,
                                                    std::size_t stride) {
  constexpr T kInfinity = std::numeric_limits<T>::infinity();
  std::array<T, 3> least, most;
  least.fill(kInfinity);
  most.fill(-kInfinity);
  for (std::size_t i = 0; i < count; ++i, points += stride) {
    std::array<T, 3> point;
    std::memcpy(point.data(), points, sizeof point);
    for (std::size_t c = 0; c < 3; ++c) {  // comparisons with NaN are false
      least[c] = point[c] < least[c] ? point[c] : least[c];
      most[c] = point[c] > most[c] ? point[c] : most[c];
    }
  }
  std::array<ValueRange, 3> box{};
  for (std::size_t c = 0; c < 3; ++c) {
    if (least[c] == -kInfinity || most[c] == kInfinity) return std::nullopt;
    box[c] = {static_cast<double>(least[c]), static_cast<double>(most[c])};
  }
  return box;
}

}  // namespace

std::array<ValueRange, 3> box_of(ScalarType type, const std::byte* points, std::size_t count,
                                 std::size_t stride) {
  if (const auto box = type == ScalarType::float32 ? finite_box<float>(points, count, stride)
                                                   : finite_box<double>(points, count, stride))
    return *box;
  std::array<ValueRange, 3> box{};
  for (std::size_t c = 0; c < 3; ++c)
    box[c] = range_of(type, points + c * scalar_bytes(type), count, stride);
  return box;
}

std::size_t point_data_bytes(const Schema& schema) {
  std::size_t bytes = 0;
  for (const ArrayInfo& info : schema.arrays)
    if (info.location == Location::point && !info.per_step)
      bytes += scalar_bytes(info.type) * info.components;
  return bytes;
}

std::vector<std::size_t> cell_data_bytes(const Schema& schema) {
  std::vector<std::size_t> bytes(schema.blocks.size());
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& info = schema.arrays[a];
    if (info.per_step || info.location != Location::cell) continue;
    for (std::uint32_t b = 0; b < bytes.size(); ++b)
      if (schema.array_covers(a, b)) bytes[b] += scalar_bytes(info.type) * info.components;
  }
  return bytes;
}

std::vector<bool> DecodedParts::columns(const Schema& schema) const {
  std::vector<bool> included{geometry};
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (!schema.arrays[a].per_step) included.push_back(includes_array(a));
  return included;
}

bool DecodedParts::includes_values_of(const Schema& schema, Location location) const {
  if (location == Location::point && geometry) return true;
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (schema.arrays[a].location == location && !schema.arrays[a].per_step && includes_array(a))
      return true;
  return false;
}

ArrayInfo coordinates_info(const Schema& schema) {
  ArrayInfo info;
  info.type = schema.coordinate_type;
  info.components = 3;
  info.quantization = schema.coordinate_quantization;
  return info;
}

// --- values

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
