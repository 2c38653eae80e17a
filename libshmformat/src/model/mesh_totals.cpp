#include "model/mesh_totals.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace shm {
namespace {

template <class T>
ValueRange range_as(const std::byte* values, std::size_t count, std::size_t stride) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ValueRange range{kInfinity, -kInfinity};
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

}  // namespace

ValueRange range_of(ScalarType type, const std::byte* values, std::size_t count,
                    std::size_t stride) {
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
  return range_as<std::uint8_t>(values, 0, stride);
}

container::ArrayRange range_of_array(const Schema& schema, std::uint32_t array,
                                     const std::byte* values, std::size_t count,
                                     std::size_t stride) {
  const ArrayInfo& info = schema.arrays[array];
  container::ArrayRange range;
  range.array = array;
  for (std::size_t c = 0; c < info.components; ++c) {
    const ValueRange one = range_of(
        info.type, count == 0 ? values : values + c * scalar_bytes(info.type), count, stride);
    range.minimum.push_back(one.minimum);
    range.maximum.push_back(one.maximum);
  }
  return range;
}

}  // namespace shm
