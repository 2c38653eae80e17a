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

// Maximum length of a PLY list whose count is one byte.
inline constexpr std::size_t kMostPolygonCorners = 255;

struct PolygonOptions {
  // Split polygons into triangles: all of them, or only those with more than kMostPolygonCorners.
  bool triangles = false;
};

// A plain value. Each face has at least three corners, all of them different vertices.
struct Polygons {
  std::vector<std::size_t> face_begin{0};  // faces + 1 offsets into corners
  std::vector<std::uint32_t> corners;      // indices into `vertices`
  // For each polygon, the face of the surface that it is or belongs to.
  std::vector<std::uint32_t> faces;
  // For each vertex, its number in the surface: ascending, then those of the copies.
  std::vector<std::uint32_t> vertices;

  // Vertices that were duplicated to separate the faces around them.
  std::uint64_t copies = 0;
  // Faces of the surface that are left out: with one or two corners; with fewer than three
  // different corners; with a coordinate that is not finite or exceeds the range of float32.
  std::uint64_t lines_and_points = 0, collapsed = 0, not_finite = 0;

  std::size_t face_count() const { return faces.size(); }
  std::span<const std::uint32_t> face(std::size_t f) const {
    return std::span(corners).subspan(face_begin[f], face_begin[f + 1] - face_begin[f]);
  }
};

// Returns the polygons of a surface, in its order. Repeated consecutive corners count once. A quad
// is split along the shorter of the diagonals that turn over no triangle, other polygons into a fan
// around the corner with the least x, then y, then z.
//
// Faces stay connected along an edge if exactly two faces have it and traverse it in opposite
// directions. Faces that share any other edge, or only a vertex, are separated: each gets vertices
// of its own. A face that meets one of its own vertices again is separated too.
//
// Needs up to 50 bytes per corner, and sorts the corners once. Returns ErrorCode::over_limit for
// more than 2^30 / 3 corners. Thread safe.
Result<Polygons> polygons_of(const Surface& surface, const PolygonOptions& options = {});

}  // namespace shm::converters
