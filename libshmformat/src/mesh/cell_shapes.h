// Cell shapes: describes the corners, faces and edges of cells other than hexahedra. Corners are in
// the order in which the file stores them.
// spec: "Corners of other cells"
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "mesh/hexahedron.h"
#include "mesh/open_faces.h"
#include "shm/schema.h"

namespace shm {

/// Largest number of nodes of a polygon that are coded as corners. The remaining nodes of the
/// polygon are coded in the same way as nodes that are not corners.
inline constexpr std::uint32_t kMaxPolygonCorners = 32;

namespace shapes {

inline constexpr std::array<ShapeFace, 1> kLine = {{{2, {0, 1}}}};
inline constexpr std::array<ShapeFace, 4> kTriangle = {
    {{3, {0, 1, 2}}, {2, {0, 1}}, {2, {1, 2}}, {2, {2, 0}}}};
inline constexpr std::array<ShapeFace, 5> kQuad = {
    {{4, {0, 1, 2, 3}}, {2, {0, 1}}, {2, {1, 2}}, {2, {2, 3}}, {2, {3, 0}}}};
inline constexpr std::array<ShapeFace, 4> kTetrahedron = {
    {{3, {0, 1, 3}}, {3, {1, 2, 3}}, {3, {2, 0, 3}}, {3, {0, 2, 1}}}};
inline constexpr std::array<ShapeFace, 5> kPyramid = {
    {{4, {0, 3, 2, 1}}, {3, {0, 1, 4}}, {3, {1, 2, 4}}, {3, {2, 3, 4}}, {3, {3, 0, 4}}}};
inline constexpr std::array<ShapeFace, 5> kWedge = {
    {{3, {0, 1, 2}}, {3, {3, 5, 4}}, {4, {0, 3, 4, 1}}, {4, {1, 4, 5, 2}}, {4, {2, 5, 3, 0}}}};
inline constexpr auto kHexahedron = [] {
  std::array<ShapeFace, 6> table{};
  for (std::size_t k = 0; k < 6; ++k) table[k] = {4, kFaceCorners[k]};
  return table;
}();
/// Edges of a polygon. The first index is the number of corners.
inline constexpr auto kPolygon = [] {
  std::array<std::array<ShapeFace, kMaxPolygonCorners>, kMaxPolygonCorners + 1> table{};
  for (std::size_t n = 2; n <= kMaxPolygonCorners; ++n)
    for (std::size_t i = 0; i < n; ++i)
      table[n][i] = {2, {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>((i + 1) % n)}};
  return table;
}();

}  // namespace shapes

/// Returns the number of corners of a cell. The corners are the first nodes of the cell. Returns 0
/// if neighbours across the sides of the cell cannot be found.
constexpr std::uint32_t corner_count(CellShape shape, std::uint64_t nodes) {
  std::uint64_t corners = 0;
  switch (shape) {
    case CellShape::line: corners = 2; break;
    case CellShape::triangle: corners = 3; break;
    case CellShape::quad:
    case CellShape::tetrahedron: corners = 4; break;
    case CellShape::pyramid: corners = 5; break;
    case CellShape::wedge: corners = 6; break;
    case CellShape::hexahedron: corners = 8; break;
    case CellShape::polygon:
      corners = nodes < 3 ? 3 : std::min<std::uint64_t>(nodes, kMaxPolygonCorners);
      break;
    case CellShape::other:
    case CellShape::vertex:
    case CellShape::polyhedron:
    case CellShape::faces: break;
  }
  return corners <= nodes ? static_cast<std::uint32_t>(corners) : 0;
}

/// If the shape is a polygon with three or four corners, returns triangle or quad. Otherwise
/// returns `shape`.
constexpr CellShape flat_shape(CellShape shape, std::uint32_t corners) {
  if (shape != CellShape::polygon || corners > 4) return shape;
  return corners == 3 ? CellShape::triangle : CellShape::quad;
}

/// Returns the faces of a cell. The first face of a flat cell is the cell itself, and its edges
/// follow. Precondition: `corners` is the result of corner_count().
constexpr std::span<const ShapeFace> faces_of(CellShape shape, std::uint32_t corners) {
  switch (shape) {
    case CellShape::line: return shapes::kLine;
    case CellShape::triangle: return shapes::kTriangle;
    case CellShape::quad: return shapes::kQuad;
    case CellShape::tetrahedron: return shapes::kTetrahedron;
    case CellShape::pyramid: return shapes::kPyramid;
    case CellShape::wedge: return shapes::kWedge;
    case CellShape::hexahedron: return shapes::kHexahedron;
    case CellShape::polygon:
      if (corners == 3) return shapes::kTriangle;
      if (corners == 4) return shapes::kQuad;
      return std::span(shapes::kPolygon[corners]).first(corners);
    case CellShape::other:
    case CellShape::vertex:
    case CellShape::polyhedron:
    case CellShape::faces: break;
  }
  return {};
}

constexpr CellSides sides_of(CellShape shape, std::uint32_t corners) {
  const bool flat = shape == CellShape::triangle || shape == CellShape::quad ||
                    (shape == CellShape::polygon && corners <= 4);
  return {faces_of(shape, corners), flat, shape != CellShape::line};
}

}  // namespace shm
