// Polygons of a surface as structures of halfedges can hold them: each edge has one or two faces,
// which go along it in opposite directions, and the faces around a vertex are one fan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "picture/surface.h"
#include "shm/result.h"

namespace shm::converters {

// What a list of PLY counts with its one byte.
inline constexpr std::size_t kMostPolygonCorners = 255;

struct PolygonOptions {
  // Split into triangles: all polygons, or those alone that have more than kMostPolygonCorners.
  bool triangles = false;
};

// A plain value. Each face has three corners or more, all of them different vertices.
struct Polygons {
  std::vector<std::size_t> face_begin{0};  // faces + 1 offsets into corners
  std::vector<std::uint32_t> corners;      // indices into `vertices`
  std::vector<std::uint32_t> faces;        // of each: which face of the surface it is, or is of
  std::vector<std::uint32_t> vertices;     // of each: which vertex of the surface it is; ascending
                                           // but for copies, which stand behind all others

  // Vertices that are there once more, since the faces around them were taken apart.
  std::uint64_t copies = 0;
  // Faces of the surface that are none here: of one or two corners; of fewer than three different
  // ones; with a coordinate that is not finite, or beyond what float32 holds.
  std::uint64_t lines_and_points = 0, collapsed = 0, not_finite = 0;

  std::size_t face_count() const { return faces.size(); }
  std::span<const std::uint32_t> face(std::size_t f) const {
    return std::span(corners).subspan(face_begin[f], face_begin[f + 1] - face_begin[f]);
  }
};

// The polygons of a surface, in its order. Corners that stand twice in a row count once. Quads are
// split along the shorter one of the diagonals that leave no triangle turned over, other polygons
// into a fan around the corner whose x, then y, then z is least.
//   Faces stay together along an edge that exactly two have and go along in opposite directions;
// along others, and where they have but a vertex in common, they are taken apart: each gets
// vertices of its own. So are faces that come upon one of their own vertices again.
//   Takes up to 50 bytes a corner, and sorts them once. ErrorCode::over_limit: more than 2^30
// / 3 corners. May be called by several threads at a time.
Result<Polygons> polygons_of(const Surface& surface, const PolygonOptions& options = {});

}  // namespace shm::converters
