// Computes positions along a Hilbert curve with the algorithm of John Skilling (2004), which uses
// the "transpose" form of the position.
#include "order/hilbert_curve.h"

#include <algorithm>
#include <cstddef>

#include "mesh/mesh_points.h"

namespace shm::converters {
namespace {

constexpr std::uint32_t kAxisBits = 20;

}  // namespace

std::uint64_t along_curve(CurvePlace x) {
  constexpr std::uint32_t kTop = 1u << (kAxisBits - 1);
  for (std::uint32_t q = kTop; q > 1; q >>= 1) {
    const std::uint32_t low = q - 1;
    for (std::size_t i = 0; i < 3; ++i) {
      if (x[i] & q) {
        x[0] ^= low;
      } else {
        const std::uint32_t t = (x[0] ^ x[i]) & low;
        x[0] ^= t;
        x[i] ^= t;
      }
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  std::uint32_t t = 0;
  for (std::uint32_t q = kTop; q > 1; q >>= 1)
    if (x[2] & q) t ^= q - 1;
  for (std::uint32_t& value : x) value ^= t;
  std::uint64_t distance = 0;
  for (std::uint32_t bit = kAxisBits; bit-- > 0;)
    for (const std::uint32_t value : x) distance = distance << 1 | (value >> bit & 1);
  return distance;
}

CurveGrid::CurveGrid(MeshSource& mesh) {
  std::array<double, 3> high{};
  for_each_point(mesh, [&](std::uint64_t vertex, const std::array<double, 3>& point) {
    for (std::size_t c = 0; c < 3; ++c) {
      low_[c] = vertex == 0 ? point[c] : std::min(low_[c], point[c]);
      high[c] = vertex == 0 ? point[c] : std::max(high[c], point[c]);
    }
  });
  double side = 0;
  for (std::size_t c = 0; c < 3; ++c) side = std::max(side, high[c] / 2 - low_[c] / 2);
  scale_ = side > 0 ? ((1u << kAxisBits) - 1) / side : 0;
}

CurvePlace CurveGrid::place(const std::array<double, 3>& point) const {
  CurvePlace places;
  for (std::size_t c = 0; c < 3; ++c) {
    // `place` may be infinite if the bounding box is extremely small.
    const double place = (point[c] / 2 - low_[c] / 2) * scale_;
    places[c] = place >= 0 && place < (1u << kAxisBits) ? static_cast<std::uint32_t>(place)
                                                        : (1u << kAxisBits) - 1;
  }
  return places;
}

}  // namespace shm::converters
