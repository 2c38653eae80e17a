// Converts a surface to polygons that a halfedge structure can store: each edge belongs to at most
// two faces, two faces traverse their common edge in opposite directions, and the faces around a
// vertex form one fan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "picture/surface.h"
#include "shm/result.h"

namespace shm::converters {

// Largest number of corners of a polygon in a PLY file, in which one byte stores the number of
// corners.
inline constexpr std::size_t kMostPolygonCorners = 255;

struct PolygonOptions {
  // If true, all polygons are split into triangles. If false, only polygons with more than
  // kMostPolygonCorners corners are split.
  bool triangles = false;
};

// The resulting polygons. Each polygon has at least three corners, and its corners are distinct
// vertices.
struct Polygons {
  // Offset of each polygon in `corners`, followed by the size of `corners`.
  std::vector<std::size_t> face_begin{0};
  std::vector<std::uint32_t> corners;  // indices into `vertices`

  // For each polygon, the face of the surface from which it was made.
  std::vector<std::uint32_t> faces;
  // For each vertex of the polygons, the number of the surface vertex that it represents. Vertices
  // of the surface come first, in ascending order, followed by the copies of duplicated vertices.
  std::vector<std::uint32_t> vertices;

  // Number of vertices that were duplicated to separate the faces around them.
  std::uint64_t copies = 0;
  // Counts of the faces that the result omits: `lines_and_points` counts faces with one or two
  // corners, `collapsed` counts faces with fewer than three distinct corners, and `not_finite`
  // counts faces with a coordinate that is not finite or exceeds the range of float32.
  std::uint64_t lines_and_points = 0, collapsed = 0, not_finite = 0;

  std::size_t face_count() const { return faces.size(); }
  std::span<const std::uint32_t> face(std::size_t f) const {
    return std::span(corners).subspan(face_begin[f], face_begin[f + 1] - face_begin[f]);
  }
};

// Converts the faces of a surface to polygons, in the order of the faces. Consecutive equal corners
// are merged. If a quad must be split, it is split along the shorter diagonal, unless only the
// other diagonal yields two triangles with the same orientation. Any other polygon is split into a
// fan around the corner with the lowest x (if equal, the lowest y, then z).
//
// Faces stay connected along an edge if exactly two faces have the edge and traverse it in opposite
// directions. Faces that share only a vertex, or an edge that does not meet this condition, are
// separated: each of them gets its own copy of the shared vertices. A face that would occur twice
// in the fan around a vertex is separated too.
//
// Needs up to 50 bytes per corner, and sorts the corners once. Returns ErrorCode::over_limit if the
// surface has more than 2^30 / 3 corners. Thread safe.
Result<Polygons> polygons_of(const Surface& surface, const PolygonOptions& options = {});

}  // namespace shm::converters
