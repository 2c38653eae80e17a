// CellFrames: the neighbours of a corner, for cells that are not hexahedra. The neighbours are
// classified as in a hexahedron. The frame of a corner lists the corners one step away (near), the
// corners one step away along each of two axes (diagonal), and the sides of the cell across which
// further neighbours are found.
// spec: "Neighbourhoods", of a corner of another cell
#pragma once

#include <array>
#include <cstdint>

#include "mesh/cell_topology.h"

namespace shm {

inline constexpr std::uint8_t kNoPlace = 255;

/// The neighbours of one corner of a cell. `near` and `diagonal` are positions of other corners;
/// `across` and `around` are indices of sides, numbered as in cell_shapes.h. An entry is kNoPlace
/// if no such neighbour exists.
struct CornerFrame {
  std::array<std::uint8_t, 3> near{kNoPlace, kNoPlace, kNoPlace};
  std::array<std::uint8_t, 3> diagonal{kNoPlace, kNoPlace, kNoPlace};
  /// Sides that do not contain the corner. The cell across side across[a] contains the vertex that
  /// continues the edge from this corner to near[a]. The cell across side `around` contains further
  /// neighbours of this corner.
  std::array<std::uint8_t, 2> across{kNoPlace, kNoPlace};
  std::uint8_t around = kNoPlace;
};

/// Returns the neighbours of the corner at `position`. Precondition: position < corner_count of the
/// shape.
constexpr CornerFrame corner_frame(CellShape shape, std::uint32_t corners, std::uint32_t position) {
  const auto at = [](std::uint32_t i) { return static_cast<std::uint8_t>(i); };
  const std::uint32_t p = position;
  CornerFrame frame;
  shape = flat_shape(shape, corners);
  switch (shape) {
    case CellShape::line: frame.near[0] = at(1 - p); break;
    case CellShape::triangle:
      frame.near = {at((p + 2) % 3), at((p + 1) % 3), kNoPlace};
      frame.around = at(1 + (p + 1) % 3);
      break;
    case CellShape::tetrahedron:
      frame.near = {at((p + 3) % 4), at((p + 2) % 4), at((p + 1) % 4)};
      frame.around = at(p == 3 ? 3 : (p + 1) % 3);
      break;
    case CellShape::quad:
    case CellShape::pyramid:
      if (p == 4) {  // `near` of the apex of a pyramid: two opposite corners of the base.
        frame.near = {0, 2, kNoPlace};
        frame.diagonal = {1, 3, kNoPlace};
        frame.around = 0;
        break;
      }
      frame.near = {at((p + 3) % 4), at((p + 1) % 4),
                    shape == CellShape::quad ? kNoPlace : std::uint8_t{4}};
      frame.diagonal[0] = at((p + 2) % 4);
      frame.across = {at(1 + (p + 2) % 4), at(1 + (p + 1) % 4)};
      break;
    case CellShape::wedge: {
      const std::uint32_t in = p % 3, layer = p - in, other = 3 - layer;
      frame.near = {at(other + in), at(layer + (in + 1) % 3), at(layer + (in + 2) % 3)};
      frame.diagonal = {at(other + (in + 1) % 3), at(other + (in + 2) % 3), kNoPlace};
      frame.across[0] = layer == 0 ? 1 : 0;
      frame.around = at(2 + (in + 1) % 3);
      break;
    }
    case CellShape::polygon:
      for (std::uint32_t a = 0; a < 3 && a < p; ++a) frame.near[a] = at(p - 1 - a);
      break;
    case CellShape::hexahedron:
    case CellShape::other:
    case CellShape::vertex:
    case CellShape::polyhedron:
    case CellShape::faces: break;
  }
  return frame;
}

/// Returns the corners that are connected to `corner` by an edge, at most four. The corners of a
/// hexahedron are not identified by position but by corner bits (x + 2y + 4z).
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
