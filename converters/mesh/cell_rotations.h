// The rotations of a cell onto itself, which do not turn it inside out.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

// Node i of the rotated cell is node `rotation[i]` of the original.
using Rotation = std::vector<std::uint8_t>;

// All rotations, the identity first: 24 of a hexahedron (of 8, 20 or 27 nodes), 12 of a
// tetrahedron, 6 of a wedge, 4 of pyramids and quads, 3 of triangles, with the nodes on edges,
// faces and inside where VTK's order of them is known. Others, lines among them, have the identity
// alone: an empty list stands for it. Polygons of any size rotate by counting on (see
// `rotates_by_counting`).
const std::vector<Rotation>& rotations_of(CellShape shape, std::size_t nodes);
inline bool rotates_by_counting(CellShape shape) { return shape == CellShape::polygon; }

// Whether `b` is `a` or `a` rotated.
template <class Number>
bool is_rotated(CellShape shape, std::span<const Number> a, std::span<const Number> b) {
  if (a.size() != b.size()) return false;
  const std::size_t n = a.size();
  const auto fits = [&](auto&& node) {
    for (std::size_t i = 0; i < n; ++i)
      if (b[i] != a[node(i)]) return false;
    return true;
  };
  if (fits([](std::size_t i) { return i; })) return true;
  if (rotates_by_counting(shape)) {
    for (std::size_t by = 1; by < n; ++by)
      if (b[0] == a[by] && fits([&](std::size_t i) { return (i + by) % n; })) return true;
    return false;
  }
  for (const Rotation& rotation : rotations_of(shape, n))
    if (fits([&](std::size_t i) { return rotation[i]; })) return true;
  return false;
}

}  // namespace shm::converters
