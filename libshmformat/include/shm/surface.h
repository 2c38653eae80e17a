// The boundary surface of a mesh. Plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "shm/blocks.h"
#include "shm/schema.h"

namespace shm {

/// An array whose values are carried along from the mesh to its boundary.
struct BoundaryArray {
  std::uint32_t array = 0;  ///< index into Schema::arrays
  std::uint64_t step = 0;   ///< step of a stepped array; ignored for static arrays
};

struct BoundaryOptions {
  std::vector<BoundaryArray> arrays{};
  /// Memory limit for the surface and for the search. A mesh that needs more is
  /// ErrorCode::over_limit. Memory of a Reader or a MeshExtractor is not counted.
  std::uint64_t max_bytes = std::uint64_t{1} << 32;
};

/// The boundary consists of the sides of volume cells (tetrahedra, pyramids, wedges, hexahedra,
/// polyhedra of shape `faces`) that exactly one volume cell has, and of all cells of lower
/// dimension themselves: triangles, quads and polygons, lines (2 corners) and vertices (1 corner).
/// Second-order cells count by their corners. Two sides are the same if they go around the same
/// vertices in the same order, in either direction.
/// - A side that three or more cells have does not belong to the boundary.
/// - If a vertex occurs twice in a row in a side, it counts once. With fewer than three corners
/// left it is not a side. So a collapsed hexahedron matches the wedge next to it.
/// - A side that one cell has twice, as in a hexahedron without volume, does not count, since the
/// cell is on both sides of it. A side that one cell has three times counts once.
/// - A triangle or quad on the side of a volume cell changes nothing: both are part of the
/// boundary.
///
/// A plain value.
struct BoundarySurface {
  ScalarType coordinate_type = ScalarType::float64;
  /// Vertices used by faces, in coding order: their numbers in the mesh, as in
  /// MeshBlock::vertex_numbers, and 3 coordinates each.
  std::vector<std::uint64_t> vertex_numbers;
  std::vector<std::byte> xyz;
  /// Faces in the coding order of their cells, and within a cell by side: faces + 1 offsets into
  /// corners, and indices into the vertices above. The corners of a side of a volume cell go around
  /// counter-clockwise as seen from outside, starting with any corner, provided that the corners of
  /// the cell are ordered as in schema.h. (A mirrored cell has mirrored sides. Two orders are in
  /// use for wedges; coordinates decide which one a cell has.) The corners of other cells are
  /// stored as in the mesh.
  std::vector<std::uint64_t> face_begin;
  std::vector<std::uint32_t> corners;
  /// For each face: the number of its cell, as in MeshBlock::cell_numbers, and the block index of
  /// that cell.
  std::vector<std::uint64_t> cell_numbers;
  std::vector<std::uint32_t> blocks;
  /// For each face: which side of its cell it is, counted from 1, as in MeshSet::sides; for
  /// polyhedra, counted in the order of their faces. 0: the face is the cell itself.
  std::vector<std::uint32_t> sides;
  /// Values of BoundaryOptions::arrays, in the same order. Point arrays have one element per
  /// vertex. Cell arrays have one element per face, taken from its cell; NaN, or 0 for integers, if
  /// the cell has no values.
  std::vector<std::vector<std::byte>> arrays;
  /// Number of cells whose faces are unknown: those of shape `other` or `polyhedron`, and those
  /// with too few nodes for their shape.
  std::uint64_t left_out = 0;
  bool operator==(const BoundarySurface&) const = default;

  std::size_t vertex_count() const { return vertex_numbers.size(); }
  std::size_t face_count() const { return cell_numbers.size(); }
  template <class T>
  std::vector<T> points_as() const {
    return numbers_as<T>(coordinate_type, xyz);
  }
};

}  // namespace shm
