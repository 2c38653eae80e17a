// The vertices of a mesh as finite points in double precision, for geometric computations.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns a coordinate as double, or 0 if it is not finite.
inline double finite_coordinate(const std::byte* from, ScalarType type) {
  double wide;
  if (type == ScalarType::float32) {
    float narrow;
    std::memcpy(&narrow, from, sizeof narrow);
    wide = static_cast<double>(narrow);
  } else {
    std::memcpy(&wide, from, sizeof wide);
  }
  return std::isfinite(wide) ? wide : 0;
}

// Returns the point whose three coordinates, of type `type`, are stored at `from`.
inline std::array<double, 3> point_at(const std::byte* from, ScalarType type) {
  std::array<double, 3> point{};
  for (std::size_t c = 0; c < 3; ++c)
    point[c] = finite_coordinate(from + c * scalar_bytes(type), type);
  return point;
}

// Calls visit(vertex, {x, y, z}) for all vertices, in ascending order.
template <class Visit>
void for_each_point(MeshSource& mesh, Visit&& visit) {
  constexpr std::uint64_t kPiecePoints = 1 << 16;
  const MeshInfo& info = mesh.info();
  const ScalarType type = info.schema.coordinate_type;
  const std::size_t bytes = scalar_bytes(type);
  std::vector<std::byte> piece;
  for (std::uint64_t first = 0; first < info.vertices; first += kPiecePoints) {
    const std::uint64_t count = std::min(kPiecePoints, info.vertices - first);
    piece.resize(count * 3 * bytes);
    mesh.read_points(first, count, piece.data());
    for (std::uint64_t i = 0; i < count; ++i)
      visit(first + i, point_at(piece.data() + 3 * i * bytes, type));
  }
}

}  // namespace shm::converters
