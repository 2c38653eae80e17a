// Cells along a Hilbert curve (John Skilling's transpose form of it, 2004).
#include <algorithm>
#include <array>
#include <utility>

#include "cell_orders.h"
#include "mesh_points.h"

namespace shm::converters {
namespace {

constexpr std::uint32_t kAxisBits = 20;

using Place = std::array<std::uint32_t, 3>;

// Where a point of the curve's 2^20 cells a side lies along the curve.
std::uint64_t along_curve(Place x) {
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

// Points on a grid over their box, equally fine along all axes.
std::vector<Place> places_of_points(MeshSource& mesh) {
  std::array<double, 3> low{}, high{};
  for_each_point(mesh, [&](std::uint64_t vertex, const std::array<double, 3>& point) {
    for (std::size_t c = 0; c < 3; ++c) {
      low[c] = vertex == 0 ? point[c] : std::min(low[c], point[c]);
      high[c] = vertex == 0 ? point[c] : std::max(high[c], point[c]);
    }
  });
  double side = 0;
  for (std::size_t c = 0; c < 3; ++c) side = std::max(side, high[c] / 2 - low[c] / 2);
  const double scale = side > 0 ? ((1u << kAxisBits) - 1) / side : 0;
  std::vector<Place> places(mesh.info().vertices);
  for_each_point(mesh, [&](std::uint64_t vertex, const std::array<double, 3>& point) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double place = (point[c] / 2 - low[c] / 2) * scale;  // inf for the tiniest boxes
      places[vertex][c] = place >= 0 && place < (1u << kAxisBits)
                              ? static_cast<std::uint32_t>(place)
                              : (1u << kAxisBits) - 1;
    }
  });
  return places;
}

}  // namespace

CellSequence hilbert_order(const CellTable& cells, MeshSource& mesh) {
  const std::vector<Place> places = places_of_points(mesh);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  keys.reserve(cells.size());
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    std::array<std::uint64_t, 3> sum{};
    const auto corners = cells.cell(cell);
    for (const std::uint32_t v : corners)
      for (std::size_t c = 0; c < 3; ++c) sum[c] += places[v][c];
    Place centre{};
    for (std::size_t c = 0; c < 3 && !corners.empty(); ++c)
      centre[c] = static_cast<std::uint32_t>(sum[c] / corners.size());
    keys.emplace_back(along_curve(centre), cell);
  }
  std::sort(keys.begin(), keys.end());
  CellSequence order;
  order.reserve(cells.size());
  for (const auto& key : keys) order.push_back(key.second);
  return order;
}

}  // namespace shm::converters
