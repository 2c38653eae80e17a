#include "codecs/shared/group_data.h"

#include "format/schema.h"

namespace shm {

GroupValues::GroupValues(const Schema& schema)
    : schema_(&schema), cell_bytes_(cell_data_bytes(schema)) {
  vertex_bytes_ = 3 * scalar_bytes(schema.coordinate_type);
  columns_.push_back({0, false, vertex_bytes_, 0});
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& info = schema.arrays[a];
    if (info.per_step) continue;
    const bool of_cells = info.location == Location::cell;
    const std::size_t bytes = scalar_bytes(info.type) * info.components;
    columns_.push_back({a, of_cells, bytes, vertex_bytes_});
    if (!of_cells) vertex_bytes_ += bytes;
  }
}

void GroupValues::add_cell(std::uint32_t block, const std::byte* values) {
  for (Column& column : columns_) {
    if (!column.of_cells || !schema_->array_covers(column.array, block)) continue;
    column.cells.append(values, column.bytes);
    values += column.bytes;
  }
}

std::array<double, 6> GroupValues::box() const {
  std::array<double, 6> box{};
  const auto ranges = box_of(schema_->coordinate_type, vertices_.data(), count(0), vertex_bytes_);
  for (std::size_t c = 0; c < 3; ++c) {
    box[c] = ranges[c].minimum;
    box[3 + c] = ranges[c].maximum;
  }
  return box;
}

void GroupValues::clear() {
  vertices_.clear();
  for (Column& column : columns_) column.cells.clear();
}

}  // namespace shm
