// The boundary surface of a mesh: the faces that one cell alone has, for pictures, pages, and
// whatever looks at a mesh from outside. It is found in one pass, with memory that follows the
// active surface and what is found.
//   shm::FileRandomSource& file = ...;
//   const auto surface = shm::read_boundary(file);
//   if (!surface) return complain(surface.error().message());
//   draw(surface->points_as<float>(), surface->face_begin, surface->corners);
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "shm/io.h"
#include "shm/mesh.h"
#include "shm/mesh_extract.h"
#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

/// An array whose values are carried along from the mesh to its boundary.
struct BoundaryArray {
  std::uint32_t array = 0;  ///< index into Schema::arrays
  std::uint64_t step = 0;   ///< of a stepped array; else not looked at
};

struct BoundaryOptions {
  std::vector<BoundaryArray> arrays{};
  /// What the surface, and what is held while it is found, may take. Asking for more is
  /// ErrorCode::over_limit. What a Reader or a MeshExtractor takes is not counted.
  std::uint64_t max_bytes = std::uint64_t{1} << 32;
};

/// Sides of volume cells (tetrahedra, pyramids, wedges, hexahedra, polyhedra of shape `faces`) that
/// exactly one volume cell has; and all cells of fewer dimensions themselves: triangles, quads and
/// polygons, lines (2 corners) and vertices (1 corner). Second-order cells count by their corners.
/// Two sides are the same where one goes around the same vertices as the other, in either
/// direction.
///   A side that three cells or more have is none of the boundary.
///   Where a side has a vertex twice in a row it counts once there; with fewer than three corners
/// left it is no side. So a collapsed hexahedron fits to the wedge beside it.
///   What a cell has twice, as a hexahedron without volume, does not count: it lies on both sides
/// of nothing. What it has three times it has once.
///   A triangle or quad that lies on a volume cell changes nothing there: both come.
/// A plain value.
struct BoundarySurface {
  ScalarType coordinate_type = ScalarType::float64;
  /// Vertices that a face uses, in coding order: their numbers in the mesh, as in
  /// MeshBlock::vertex_numbers, and 3 coordinates each.
  std::vector<std::uint64_t> vertex_numbers;
  std::vector<std::byte> xyz;
  /// Faces in coding order of their cells, and of those of one cell by side: faces + 1 offsets into
  /// corners, and indices into the vertices above. Corners of volume cells' sides go around
  /// counter-clockwise seen from outside, if the cell's own do as in schema.h (a mirrored cell has
  /// mirrored sides; of wedges, for which two orders are in use, coordinates tell which it is),
  /// from any of them on; those of other cells are as they are there.
  std::vector<std::uint64_t> face_begin;
  std::vector<std::uint32_t> corners;
  /// For each face: the number of its cell, as in MeshBlock::cell_numbers, and the index of the
  /// block of that.
  std::vector<std::uint64_t> cell_numbers;
  std::vector<std::uint32_t> blocks;
  /// Which side of its cell a face is, from 1, as in MeshSet::sides; of polyhedra as they have
  /// them. 0: the face is the cell.
  std::vector<std::uint32_t> sides;
  /// Of BoundaryOptions::arrays, in their order: an element for each vertex, or for each face, that
  /// of its cell: NaN, and 0 of integers, where the cell has no values.
  std::vector<std::vector<std::byte>> arrays;
  /// Cells of which no face is known: those of shape `other` or `polyhedron`, and with too few
  /// nodes for their shape.
  std::uint64_t left_out = 0;
  bool operator==(const BoundarySurface&) const = default;

  std::size_t vertex_count() const { return vertex_numbers.size(); }
  std::size_t face_count() const { return cell_numbers.size(); }
  template <class T>
  std::vector<T> points_as() const {
    return numbers_as<T>(coordinate_type, xyz);
  }
};

/// Finds the boundary of a mesh that the caller reads, block by block. Not thread safe; distinct
/// BoundaryFinders are independent. After an error it is of no use any more.
class SHM_API BoundaryFinder {
 public:
  /// `schema` is copied. ErrorCode::misuse where it has no such array.
  static Result<BoundaryFinder> create(const Schema& schema, const BoundaryOptions& options = {});
  BoundaryFinder(BoundaryFinder&&) noexcept;
  BoundaryFinder& operator=(BoundaryFinder&&) noexcept;
  ~BoundaryFinder();

  /// The next block, as a Reader gives it, or a MeshExtractor with the arrays that are asked for:
  /// then the boundary is that of the piece, and, as the cells of pieces finalize nothing, memory
  /// follows the piece. Other blocks are ErrorCode::misuse, or corrupt where a cell uses a vertex
  /// that is not there.
  Result<void> add(const MeshBlock& block);
  /// Behind the mesh: values of a stepped array, in coding order. Those that were not asked for are
  /// passed over.
  Result<void> add(const StepPiece& piece);
  /// Values that a StepReader or MeshExtractor gives of an array at a step: by the numbers of their
  /// elements where these are there, else in coding order. Of pieces numbers are needed.
  Result<void> add(std::uint32_t array, std::uint64_t step, const StepValues& values);
  /// Behind all of it. ErrorCode::misuse where no values came of a stepped array that was asked for
  /// and has some, or where it was called before.
  Result<BoundarySurface> finish();

 private:
  class Impl;
  explicit BoundaryFinder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The boundary of a file that can be read anywhere: of values, those that are asked for are read,
/// and no others. `reading`: threads. An index that lies can hide cells, as for a MeshExtractor.
/// ErrorCode::misuse where an array that is asked for is not there, or has no values at its step.
/// `source` is borrowed during the call.
SHM_API Result<BoundarySurface> read_boundary(RandomSource& source,
                                              const BoundaryOptions& options = {},
                                              const ReadLimits& limits = {},
                                              const ReadOptions& reading = {});
/// Of a stream, which is read to its end, or, where it has steps, until all that is asked for has
/// come. All static arrays are decoded, and the steps before those that are asked for.
SHM_API Result<BoundarySurface> read_boundary(ByteSource& source,
                                              const BoundaryOptions& options = {},
                                              const ReadLimits& limits = {},
                                              const ReadOptions& reading = {});

}  // namespace shm
