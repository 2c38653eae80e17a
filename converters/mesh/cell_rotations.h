// The rotations that map a cell onto itself, without mirror images.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

// A rotation of a cell: node i of the rotated cell is node `rotation[i]` of the original cell.
using Rotation = std::vector<std::uint8_t>;

// Returns all rotations, beginning with the identity: 24 for a hexahedron (with 8, 20 or 27 nodes),
// 12 for a tetrahedron, 6 for a wedge, 4 for pyramids and quads, 3 for triangles. A rotation also
// permutes the nodes on edges, on faces and inside the cell if VTK defines their order. For any
// other cell, such as a line, the list is empty. It is also empty for polygons: their rotations are
// the cyclic permutations of their nodes (see `rotates_by_counting`).
const std::vector<Rotation>& rotations_of(CellShape shape, std::size_t nodes);
inline bool rotates_by_counting(CellShape shape) { return shape == CellShape::polygon; }

// Returns true if `b` equals `a` or a rotation of `a`.
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
