#include "groups/point_box.h"

#include <cstring>
#include <limits>
#include <optional>

namespace shm {
namespace {

/// In one pass. Nothing where a number is infinite, which ranges have no place for.
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
    for (std::size_t c = 0; c < 3; ++c) {  // no NaN is less or more
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

}  // namespace shm
