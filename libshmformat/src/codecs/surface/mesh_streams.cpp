#include "codecs/surface/mesh_streams.h"

#include "codecs/surface/plan/column_planner.h"

namespace shm {

template <class Column>
ValueStreams<Column>::ValueStreams(const Schema& schema, const DecodedParts& parts)
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
}

template <class Column>
void ValueStreams<Column>::begin_cell(const CellTopology& cell, std::uint64_t live) {
  if (!finds()) return;
  const bool as_stored = schema_->corner_order || schema_->blocks[cell.block].nodes_per_cell != 8;
  finder_.begin_cell(cell, as_stored, live);
}

template <class Column>
void ValueStreams<Column>::end_cell(const CellTopology& cell) {
  if (!finds()) return;
  if (of_cells_) {
    push_tightly(cells_.items, finder_.cell(cell, cell_reach_));
    push_tightly(cells_.blocks, cell.block);
  }
  finder_.end_cell(cell);
}

// --- all bitstreams

template <class Coder, class Column>
auto MeshStreams<Coder, Column>::list(const Schema& schema) -> std::vector<Stream> {
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

template <class Coder, class Column>
MeshStreams<Coder, Column>::MeshStreams(const Schema& schema, const SegmentStart& start,
                                        const DecodedParts& parts)
    : schema_(&schema),
      connectivity_(schema),
      values_(schema, parts),
      cell_numbers_(schema, start.first_cell) {
  streams_.resize(list(schema).size());
  imports_stream_ = streams_.size() - 1;
}

template class ValueStreams<ColumnPlanner>;
template class ValueStreams<ColumnDecoder>;
template class MeshStreams<RangeEncoder, ColumnPlanner>;
template class MeshStreams<RangeDecoder, ColumnDecoder>;

}  // namespace shm
