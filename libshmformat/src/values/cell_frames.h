// CellFrames: how the corners of a cell that is no hexahedron stand to one of them: which are one
// step away, which along two axes at once, and behind which sides of the cell the next ones are.
// spec: "Neighbourhoods", of a corner of another cell
#pragma once

#include <array>
#include <cstdint>

#include "surface/cell_topology.h"

namespace shm {

inline constexpr std::uint8_t kNoPlace = 255;

/// Positions of corners and numbers of sides (cell_shapes.h), as seen from a corner.
struct CornerFrame {
  std::array<std::uint8_t, 3> near{kNoPlace, kNoPlace, kNoPlace};
  std::array<std::uint8_t, 3> diagonal{kNoPlace, kNoPlace, kNoPlace};
  /// Sides that do not have the corner: behind them along an axis; behind it what lacks here.
  std::array<std::uint8_t, 2> across{kNoPlace, kNoPlace};
  std::uint8_t around = kNoPlace;
};

/// Must hold: position < corner_count of the shape.
constexpr CornerFrame corner_frame(CellShape shape, std::uint32_t corners, std::uint32_t position) {
  const auto at = [](std::uint32_t i) { return static_cast<std::uint8_t>(i); };
  const std::uint32_t p = position;
  CornerFrame it;
  shape = flat_shape(shape, corners);
  switch (shape) {
    case CellShape::line: it.near[0] = at(1 - p); break;
    case CellShape::triangle:
      it.near = {at((p + 2) % 3), at((p + 1) % 3), kNoPlace};
      it.around = at(1 + (p + 1) % 3);
      break;
    case CellShape::tetrahedron:
      it.near = {at((p + 3) % 4), at((p + 2) % 4), at((p + 1) % 4)};
      it.around = at(p == 3 ? 3 : (p + 1) % 3);
      break;
    case CellShape::quad:
    case CellShape::pyramid:
      if (p == 4) {  // between two corners across the base
        it.near = {0, 2, kNoPlace};
        it.diagonal = {1, 3, kNoPlace};
        it.around = 0;
        break;
      }
      it.near = {at((p + 3) % 4), at((p + 1) % 4),
                 shape == CellShape::quad ? kNoPlace : std::uint8_t{4}};
      it.diagonal[0] = at((p + 2) % 4);
      it.across = {at(1 + (p + 2) % 4), at(1 + (p + 1) % 4)};
      break;
    case CellShape::wedge: {
      const std::uint32_t in = p % 3, layer = p - in, other = 3 - layer;
      it.near = {at(other + in), at(layer + (in + 1) % 3), at(layer + (in + 2) % 3)};
      it.diagonal = {at(other + (in + 1) % 3), at(other + (in + 2) % 3), kNoPlace};
      it.across[0] = layer == 0 ? 1 : 0;
      it.around = at(2 + (in + 1) % 3);
      break;
    }
    case CellShape::polygon:
      for (std::uint32_t a = 0; a < 3 && a < p; ++a) it.near[a] = at(p - 1 - a);
      break;
    case CellShape::hexahedron:
    case CellShape::other:
    case CellShape::vertex:
    case CellShape::polyhedron:
    case CellShape::faces: break;
  }
  return it;
}

/// Corners that an edge joins to `corner`, the first ones; hexahedra by corner bits.
constexpr std::array<std::uint8_t, 4> corner_neighbours(CellShape shape, std::uint32_t corner) {
  const auto at = [](std::uint32_t i) { return static_cast<std::uint8_t>(i); };
  const std::uint32_t p = corner;
  switch (shape) {
    case CellShape::line: return {at(1 - p), kNoPlace, kNoPlace, kNoPlace};
    case CellShape::triangle: return {at((p + 2) % 3), at((p + 1) % 3), kNoPlace, kNoPlace};
    case CellShape::tetrahedron:
      return {at((p + 3) % 4), at((p + 2) % 4), at((p + 1) % 4), kNoPlace};
    case CellShape::quad: return {at((p + 3) % 4), at((p + 1) % 4), kNoPlace, kNoPlace};
    case CellShape::pyramid:
      if (p == 4) return {0, 1, 2, 3};
      return {at((p + 3) % 4), at((p + 1) % 4), 4, kNoPlace};
    case CellShape::wedge:
      return {at((p + 3) % 6), at(p - p % 3 + (p + 1) % 3), at(p - p % 3 + (p + 2) % 3), kNoPlace};
    case CellShape::hexahedron: return {at(p ^ 1), at(p ^ 2), at(p ^ 4), kNoPlace};
    case CellShape::polygon:
    case CellShape::other:
    case CellShape::vertex:
    case CellShape::polyhedron:
    case CellShape::faces: break;
  }
  return {kNoPlace, kNoPlace, kNoPlace, kNoPlace};
}

}  // namespace shm
