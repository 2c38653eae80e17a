#include "codecs/shared/group_parts.h"

#include <cstring>
#include <limits>

namespace shm {
namespace {

/// Finds the box of finite coordinates in one pass over all points. Returns nothing if a coordinate
/// is infinite, since a ValueRange cannot represent infinity.
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
    for (std::size_t c = 0; c < 3; ++c) {  // NaN changes nothing: comparisons with it are false
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

}  // namespace shm
