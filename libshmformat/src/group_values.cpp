#include "group_values.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "mesh_streams.h"

namespace shm {
namespace {

struct Range {
  double minimum = std::numeric_limits<double>::infinity();
  double maximum = -std::numeric_limits<double>::infinity();
};

/// Of `count` scalars, `stride` bytes apart; what is not finite does not count.
template <class T>
Range range_as(const std::byte* values, std::size_t count, std::size_t stride) {
  Range range;
  for (std::size_t i = 0; i < count; ++i, values += stride) {
    T value;
    std::memcpy(&value, values, sizeof value);
    const auto v = static_cast<double>(value);
    if (!std::isfinite(v)) continue;
    range.minimum = std::min(range.minimum, v);
    range.maximum = std::max(range.maximum, v);
  }
  return range;
}

Range range_of(ScalarType type, const std::byte* values, std::size_t count, std::size_t stride) {
  switch (type) {
    case ScalarType::int8: return range_as<std::int8_t>(values, count, stride);
    case ScalarType::uint8: return range_as<std::uint8_t>(values, count, stride);
    case ScalarType::int16: return range_as<std::int16_t>(values, count, stride);
    case ScalarType::uint16: return range_as<std::uint16_t>(values, count, stride);
    case ScalarType::int32: return range_as<std::int32_t>(values, count, stride);
    case ScalarType::uint32: return range_as<std::uint32_t>(values, count, stride);
    case ScalarType::int64: return range_as<std::int64_t>(values, count, stride);
    case ScalarType::uint64: return range_as<std::uint64_t>(values, count, stride);
    case ScalarType::float32: return range_as<float>(values, count, stride);
    case ScalarType::float64: return range_as<double>(values, count, stride);
  }
  return {};
}

}  // namespace

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
    const Range range = count(0) == 0
                            ? Range()
                            : range_of(schema_->coordinate_type, vertices_.data() + c * width,
                                       count(0), vertex_bytes_);
    box[c] = range.minimum;
    box[3 + c] = range.maximum;
  }
  return box;
}

std::vector<container::ArrayRange> GroupValues::ranges() const {
  std::vector<container::ArrayRange> ranges;
  for (std::size_t column = 1; column < columns_.size(); ++column) {
    const Column& it = columns_[column];
    const ArrayInfo& info = schema_->arrays[it.array];
    container::ArrayRange& range = ranges.emplace_back();
    range.array = it.array;
    for (std::size_t c = 0; c < info.components; ++c) {
      const Range one = count(column) == 0
                            ? Range()
                            : range_of(info.type, values(column) + c * scalar_bytes(info.type),
                                       count(column), stride(column));
      range.minimum.push_back(one.minimum);
      range.maximum.push_back(one.maximum);
    }
  }
  return ranges;
}

void GroupValues::clear() {
  vertices_.clear();
  for (Column& it : columns_) it.cells.clear();
}

}  // namespace shm
