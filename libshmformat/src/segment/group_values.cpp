#include "segment/group_values.h"

#include "model/value_range.h"
#include "segment/mesh_streams.h"

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
  for (Column& it : columns_) {
    if (!it.of_cells || !schema_->array_covers(it.array, block)) continue;
    expect_more(it.cells, it.bytes);
    it.cells.insert(it.cells.end(), values, values + it.bytes);
    values += it.bytes;
  }
}

std::array<double, 6> GroupValues::box() const {
  std::array<double, 6> box{};
  const std::size_t width = scalar_bytes(schema_->coordinate_type);
  for (std::size_t c = 0; c < 3; ++c) {
    const std::byte* first = count(0) == 0 ? nullptr : vertices_.data() + c * width;
    const ValueRange range = range_of(schema_->coordinate_type, first, count(0), vertex_bytes_);
    box[c] = range.minimum;
    box[3 + c] = range.maximum;
  }
  return box;
}

std::vector<container::ArrayRange> GroupValues::ranges() const {
  std::vector<container::ArrayRange> ranges;
  for (std::size_t column = 1; column < columns_.size(); ++column)
    ranges.push_back(
        range_of_array(*schema_, array(column), values(column), count(column), stride(column)));
  return ranges;
}

void GroupValues::clear() {
  vertices_.clear();
  for (Column& it : columns_) it.cells.clear();
}

}  // namespace shm
