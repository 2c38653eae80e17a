// MeshExtractor: reads a piece of a mesh from a .shm file: some of its cells with their vertices
// and values. The extractor reads the index, the schema, and only the segments that may contain
// such cells. From these segments it reads only the requested streams and, for stepped arrays, only
// the requested steps. It needs memory for one chunk group, for the vertices that later cells may
// use, and 8 to 16 bytes for each vertex and cell of the piece. With threads, more groups are in
// memory at the same time (see ReadOptions). To read steps, it also needs the memory of a
// StepReader.
// spec: "Segments", "Index and trailer"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"
#include "shm/segment_reader.h"
#include "shm/selection.h"
#include "shm/step_reader.h"

namespace shm {

/// Reads pieces of a mesh. The extractor skips segments that, according to the index, cannot
/// contain selected cells. A wrong index can therefore hide cells, which are then missing in the
/// piece, but has no other effect. The data that the extractor reads must agree with the index,
/// including its bounding boxes; otherwise reading fails. A MeshExtractor is not thread safe;
/// distinct MeshExtractors are independent.
class SHM_API MeshExtractor {
 public:
  /// Reads the index and the schema. `source` is borrowed and must outlive the MeshExtractor.
  static Result<MeshExtractor> open(RandomSource& source, const ReadLimits& limits = {});
  /// Opens a damaged file for reading its intact parts:
  /// - in each segment, the groups before the first group whose cells or coordinates are damaged;
  /// - values of arrays whose bitstreams are intact;
  /// - step values of these groups, if everything that the step values refer to is intact.
  ///
  /// After this call, segments() lists the segments that are at least partly intact. vertices(),
  /// cells() and block_cells() return the counts for the whole file, as far as they are known. A
  /// request for all cells returns all intact cells. open_damaged() reads the whole file once. Each
  /// later request reads the parts that it needs again. Undamaged files are accepted too. Fails if
  /// every copy of the schema is lost or the file cannot be read.
  static Result<MeshExtractor> open_damaged(RandomSource& source, const ReadLimits& limits = {});
  MeshExtractor(MeshExtractor&&) noexcept;
  MeshExtractor& operator=(MeshExtractor&&) noexcept;
  ~MeshExtractor();

  const Schema& schema() const;
  const std::vector<SegmentInfo>& segments() const;
  /// Returns the static arrays (indices into Schema::arrays) that are lost in the segment with
  /// index `segment` in segments(). In the parts of the piece that come from this segment, all
  /// values of these arrays are NaN (0 for integers). The value of a vertex can still be intact in
  /// another segment that contains the same vertex. Empty unless the file is damaged.
  std::span<const std::uint32_t> lost_arrays(std::size_t segment) const;
  /// Returns the number of a segment in the original file. It differs from the index of the segment
  /// in segments() if earlier segments are lost.
  std::uint32_t segment_number(std::size_t segment) const;
  /// Returns true if a damaged file has values of a stepped array at a step, or may have had such
  /// values before it was damaged. Even if the result is true, the values may be lost.
  bool had_values(std::uint32_t array, std::uint64_t step) const;
  // Totals of the whole file, according to the index.
  std::uint64_t vertices() const;
  std::uint64_t cells() const;
  std::uint64_t hexahedra() const;
  /// Returns the number of time steps; each stepped array has values at some of the steps.
  std::uint64_t step_count() const;
  /// Returns the digest of the mesh, if the file has digests: see Totals::digest.
  std::optional<std::uint64_t> digest() const;
  const std::vector<std::uint64_t>& block_cells() const;

  /// Reads all extras of the file. Vertex and cell numbers in these extras refer to the whole mesh,
  /// not to the piece.
  Result<std::vector<Extra>> extras();
  /// Returns the time of each step; empty if the file has no step times.
  Result<std::vector<double>> step_times();
  /// Returns the steps at which a stepped array has values, ascending.
  Result<std::vector<std::uint64_t>> steps(std::uint32_t array);

  /// Returns a reader of the file's steps that uses the same index. The first call creates the
  /// reader, which lives as long as this object. A request to that reader cancels a request that
  /// was started with begin_values(), and vice versa.
  Result<StepReader*> step_reader();

  /// Starts a request for a piece, and cancels the previous request. next() then returns the parts
  /// of the requested piece. If the index shows which ranges will be read, begin() announces these
  /// ranges to the source. Only the thread options of `options` are used; the source is always read
  /// in the caller's thread. Results and errors are the same for any number of threads. If the
  /// piece has to be searched for (by a box, or by numbers that are not in file order), the threads
  /// work on one group at a time. Fails with ErrorCode::misuse if the request refers to anything
  /// that does not exist in the file.
  Result<void> begin(const ExtractRequest& request, const ReadOptions& options = {});
  /// Returns the next part of the piece; null at the end. The part is valid until the next call.
  /// Parts come segment by segment, but not always in file order. Vertex and cell numbers are those
  /// in the whole mesh. Each cell occurs once. Each vertex occurs once, before or with the first
  /// cell that uses it. Vertices that no cell uses occur only if all cells are selected or
  /// ExtractRequest::unused_vertices is set. In a part, first_vertex and first_cell are positions
  /// within the piece. last_use is 0, unless the piece consists of all cells of an undamaged file;
  /// then last_use is as in a Reader. `imported` is empty, and arrays that were not requested are
  /// empty too.
  Result<MeshBlock*> next();

  /// Return the numbers of the vertices and cells of the piece, ascending. The lists are complete
  /// only after next() has returned null.
  const std::vector<std::uint64_t>& vertex_numbers() const;
  const std::vector<std::uint64_t>& cell_numbers() const;
  /// Starts reading the values of a stepped array at one step. Call next_values() to get the
  /// values. Call this function after next() has returned null. Reading in ascending order of steps
  /// is fastest. Fails with ErrorCode::misuse if the array has no values at that step.
  Result<void> begin_values(std::uint32_t array, std::uint64_t step);
  /// Returns values of some elements of the piece together with the numbers of these elements, or
  /// null at the end. StepValues::first is 0. Each element occurs once. If the array is neither on
  /// points nor on cells, the piece does not matter: all values are returned. If the file is
  /// damaged, elements whose values are lost are not returned. The values are valid until the next
  /// call.
  Result<StepValues*> next_values();

 private:
  class Impl;
  explicit MeshExtractor(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
