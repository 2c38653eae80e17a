// BoundarySurface: the boundary surface of a mesh. All types are plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "shm/blocks.h"
#include "shm/schema.h"

namespace shm {

/// Array whose values are transferred from the mesh to its boundary.
struct BoundaryArray {
  std::uint32_t array = 0;  ///< index into Schema::arrays
  std::uint64_t step = 0;   ///< step of a stepped array; ignored for static arrays
};

struct BoundaryOptions {
  std::vector<BoundaryArray> arrays{};
  /// True: the sides of cells of higher order are divided into flat faces at all nodes that lie on
  /// them. A side of order p becomes p * p quadrilaterals or triangles; a quadrilateral without a
  /// node in its middle becomes four triangles and a quadrilateral. Only the nodes of second-order
  /// cells and of Lagrange cells of orders 3 to 10 are used, in blocks whose cells all have the
  /// same number of nodes. A side between two cells of different order is then part of the
  /// boundary, seen from both cells. False: all nodes that are not corners are ignored.
  bool subdivide = false;
  /// Memory limit in bytes for the surface and for the data needed to find it. A mesh that needs
  /// more fails with ErrorCode::over_limit. The memory of a Reader or a MeshExtractor is not
  /// counted.
  std::uint64_t max_bytes = std::uint64_t{1} << 32;
};

/// Boundary surface of a mesh. It consists of two kinds of faces:
/// - the sides of volume cells (tetrahedra, pyramids, wedges, hexahedra, polyhedra of shape
///   `faces`) that belong to exactly one volume cell,
/// - all cells of lower dimension: triangles, quads and polygons, lines (2 corners) and vertices (1
///   corner).
///
/// Nodes that are not corners are ignored, unless BoundaryOptions::subdivide is set. Two sides are
/// equal if they go around the same vertices in the same order, in either direction.
/// - A side that three or more cells share is not part of the boundary.
/// - If a vertex occurs twice in a row in a side, the repetition is ignored. A side with fewer than
///   three corners after that is ignored, so a collapsed hexahedron matches the wedge next to it.
/// - If a side occurs twice in one cell, as in a hexahedron with zero volume, the two occurrences
///   cancel each other, since the cell lies on both sides of the face. A side that occurs three
///   times in one cell therefore counts once.
/// - A triangle or quad that coincides with a side of a volume cell does not affect this side: both
///   the triangle or quad and, if it belongs to one cell only, the side are part of the boundary.
struct BoundarySurface {
  ScalarType coordinate_type = ScalarType::float64;
  /// Vertices that the faces use, in coding order: `vertex_numbers` contains their numbers in the
  /// mesh, as in MeshBlock::vertex_numbers, and `xyz` contains 3 coordinates of each vertex.
  std::vector<std::uint64_t> vertex_numbers;
  std::vector<std::byte> xyz;
  /// Faces in the coding order of their cells, and within a cell by side. If sides are divided, the
  /// faces of a side follow each other. `face_begin` contains the offsets of the faces in `corners`
  /// (faces + 1 entries). `corners` contains indices into `vertex_numbers`. The corners of a side
  /// of a volume cell go around counter-clockwise as seen from outside, starting with any corner,
  /// provided that the corners of the cell are ordered as in schema.h. A mirrored cell has mirrored
  /// sides. Some files list the corners of wedges in mirrored order; the coordinates of a wedge
  /// show which of the two orders it has. The corners of other cells are stored as in the mesh.
  std::vector<std::uint64_t> face_begin;
  std::vector<std::uint32_t> corners;
  /// Origin of each face: the number of its cell, as in MeshBlock::cell_numbers, and the block
  /// index of that cell.
  std::vector<std::uint64_t> cell_numbers;
  std::vector<std::uint32_t> blocks;
  /// For each face, the side of the cell that forms the face, counted from 1 as in MeshSet::sides.
  /// The sides of a polyhedron are counted in the order of its faces. The value is 0 if the cell
  /// itself is the face.
  std::vector<std::uint32_t> sides;
  /// Values of BoundaryOptions::arrays, in the same order. Point arrays have one element per
  /// vertex. Cell arrays have one element per face: the value of the face's cell, or NaN (0 for
  /// integers) if the cell has no value.
  std::vector<std::vector<std::byte>> arrays;
  /// Number of cells that were skipped because their faces cannot be determined: cells of shape
  /// `other` or `polyhedron`, and cells with too few nodes for their shape.
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
