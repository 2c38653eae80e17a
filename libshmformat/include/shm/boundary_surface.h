// BoundaryFinder and read_boundary: find the boundary surface of a mesh, e.g. for pictures and web
// pages that show the mesh from outside. The boundary consists of the faces that belong to exactly
// one cell. The file is read only once. The memory needed is proportional to the size of the active
// surface plus the size of the result.
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
#include "shm/surface.h"

namespace shm {

/// Finds the boundary of a mesh that the caller reads, block by block. Not thread safe; distinct
/// BoundaryFinders are independent. A BoundaryFinder must not be used after an error.
class SHM_API BoundaryFinder {
 public:
  /// Creates a finder, which keeps a copy of `schema`. Fails with ErrorCode::misuse if a requested
  /// array does not exist, or is neither on points nor on cells.
  static Result<BoundaryFinder> create(const Schema& schema, const BoundaryOptions& options = {});
  BoundaryFinder(BoundaryFinder&&) noexcept;
  BoundaryFinder& operator=(BoundaryFinder&&) noexcept;
  ~BoundaryFinder();

  /// Adds the next block that a Reader or a MeshExtractor has returned. If the blocks come from a
  /// MeshExtractor, the result is the boundary of the extracted piece, and the MeshExtractor must
  /// extract the requested arrays. In this case, memory grows with the size of the piece, because
  /// its cells do not finalize vertices. Fails with ErrorCode::misuse if the block is incomplete or
  /// not the next block, and with ErrorCode::corrupt if a cell uses a vertex that does not exist.
  Result<void> add(const MeshBlock& block);
  /// Adds values of a stepped array, in coding order. Call this function after the last block.
  /// Values that were not requested are ignored.
  Result<void> add(const StepPiece& piece);
  /// Adds values of an array at a step, as returned by a StepReader or MeshExtractor. If `values`
  /// has element numbers, each value belongs to the element with that number; otherwise, the values
  /// are in coding order. Values that belong to a piece of a mesh must have element numbers.
  Result<void> add(std::uint32_t array, std::uint64_t step, const StepValues& values);
  /// Ends the input and returns the boundary. Fails with ErrorCode::misuse if a requested stepped
  /// array has elements but none of its values were added, or if finish() was called before.
  Result<BoundarySurface> finish();

 private:
  class Impl;
  explicit BoundaryFinder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Finds the boundary of a file with random access. The function reads only the requested values.
/// `reading` sets the number of threads. If the index is wrong, cells can be missing, as with a
/// MeshExtractor. Fails with ErrorCode::misuse if a requested array does not exist or has no values
/// at its step. `source` is borrowed during the call.
SHM_API Result<BoundarySurface> read_boundary(RandomSource& source,
                                              const BoundaryOptions& options = {},
                                              const ReadLimits& limits = {},
                                              const ReadOptions& reading = {});
/// Finds the boundary of a stream. The function reads the stream to its end or, if it has time
/// steps, until all requested values have arrived. It has to decode all static arrays, and all time
/// steps before the requested ones, because no part of a stream can be skipped.
SHM_API Result<BoundarySurface> read_boundary(ByteSource& source,
                                              const BoundaryOptions& options = {},
                                              const ReadLimits& limits = {},
                                              const ReadOptions& reading = {});

}  // namespace shm
