// Polygons of a surface in a form that halfedge structures can store: each edge has one or two
// faces, which traverse it in opposite directions, and the faces around a vertex form one fan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "picture/surface.h"
#include "shm/result.h"

namespace shm::converters {

// Largest number of corners in a PLY list whose count is one byte.
inline constexpr std::size_t kMostPolygonCorners = 255;

struct PolygonOptions {
  // True: all polygons are split into triangles; false: only polygons with more than
  // kMostPolygonCorners.
  bool triangles = false;
};

// The resulting polygons. Each polygon has at least three corners, and its corners are different
// vertices.
struct Polygons {
  std::vector<std::size_t> face_begin{0};  // offset of each face in `corners`, then the end
  std::vector<std::uint32_t> corners;      // indices into `vertices`

  // For each polygon, the face of the surface from which it was made.
  std::vector<std::uint32_t> faces;
  // For each vertex, its number in the surface: first the vertices in ascending order, then the
  // copies.
  std::vector<std::uint32_t> vertices;

  // Number of vertices that were duplicated to separate the faces around them.
  std::uint64_t copies = 0;
  // Numbers of faces of the surface that are left out: faces with one or two corners; faces with
  // fewer than three different corners; faces with a coordinate that is not finite or exceeds the
  // range of float32.
  std::uint64_t lines_and_points = 0, collapsed = 0, not_finite = 0;

  std::size_t face_count() const { return faces.size(); }
  std::span<const std::uint32_t> face(std::size_t f) const {
    return std::span(corners).subspan(face_begin[f], face_begin[f + 1] - face_begin[f]);
  }
};

// Returns the polygons of a surface, in the order of its faces. Repeated consecutive corners count
// once. A quad is split along the shorter of the diagonals that turn over no triangle, other
// polygons into a fan around the corner with the least x, then y, then z.
//
// Faces stay connected along an edge if exactly two faces have the edge and traverse it in opposite
// directions. Faces that share any other edge, or only a vertex, are separated: each of them gets
// separate vertices. If a face would meet one of its own vertices again, it is separated too.
//
// Needs up to 50 bytes per corner, and sorts the corners once. Returns ErrorCode::over_limit for
// more than 2^30 / 3 corners. Thread safe.
Result<Polygons> polygons_of(const Surface& surface, const PolygonOptions& options = {});

}  // namespace shm::converters
