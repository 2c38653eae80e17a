// MeshExtractor: a piece of a mesh out of a .shm file: some of its cells with their vertices and
// values. Beside index and schema it reads the segments that may have such cells, of these only the
// streams that are wanted, and of stepped arrays only the steps that are asked for.
// Memory: one chunk group (with threads: what ReadOptions say), the vertices that wait for their
// last use, and 8 to 16 bytes for each vertex and cell of the piece; for steps also what a
// StepReader takes. spec: "Segments", "Index and trailer"
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
#include "shm/step_reader.h"

namespace shm {

/// Which cells: those that meet every condition that is there; without any, all.
struct CellSelection {
  struct Range {
    std::uint64_t first = 0, end = 0;  ///< first, first + 1, ..., end - 1
  };
  /// Numbers as in MeshBlock::cell_numbers.
  std::optional<Range> range{};
  /// The same, one by one, ascending.
  std::optional<std::vector<std::uint64_t>> numbers{};
  /// Indices into Schema::blocks, ascending.
  std::optional<std::vector<std::uint32_t>> blocks{};
  /// Smallest x y z, largest x y z: cells with a vertex in this box, its faces included.
  std::optional<std::array<double, 6>> box{};

  bool all() const { return !range && !numbers && !blocks && !box; }
};

struct ExtractRequest {
  CellSelection cells{};
  /// If given: these vertices, ascending numbers as in MeshBlock::vertex_numbers, and no cells.
  /// Of the conditions for cells only a box may stand beside it: vertices in it.
  std::optional<std::vector<std::uint64_t>> vertices{};
  /// Indices of the static arrays whose values are wanted; nothing: of all.
  std::optional<std::vector<std::uint32_t>> arrays{};
  /// Whether coordinates are wanted: MeshBlock::xyz is empty where they are not, and no condition
  /// needs them.
  bool coordinates = true;
  /// Beside cells: vertices that no cell uses, of all segments that are read for the cells and of
  /// those without cells. (The Writer codes them behind the last cell, unless it is given them
  /// before.) They come in any case where all cells are wanted.
  bool unused_vertices = false;
};

/// The index says where to look, and is believed where it says that nothing is to be found: an
/// index that lies can hide cells (they are missing in the piece), and nothing else. What is read
/// must be what the index says of it, boxes included, or reading fails. Not thread safe; distinct
/// MeshExtractors are independent.
class SHM_API MeshExtractor {
 public:
  /// Reads index and schema. `source` is borrowed and must outlive the MeshExtractor.
  static Result<MeshExtractor> open(RandomSource& source, const ReadLimits& limits = {});
  /// Of a damaged file what is whole: of each segment the groups before the first whose cells or
  /// coordinates are hurt, values of arrays where their bitstreams are whole, step values of these
  /// groups with all that they refer to. segments() are then those of which anything is left, and
  /// vertices(), cells() and block_cells() what is known of the whole file. A piece of all cells is
  /// what is left of them. Reads all of the file once, and then what is asked for. Takes undamaged
  /// files, too. Fails where no schema is left, or the file cannot be read.
  static Result<MeshExtractor> open_damaged(RandomSource& source, const ReadLimits& limits = {});
  MeshExtractor(MeshExtractor&&) noexcept;
  MeshExtractor& operator=(MeshExtractor&&) noexcept;
  ~MeshExtractor();

  const Schema& schema() const;
  const std::vector<SegmentInfo>& segments() const;
  /// Of segments(): static arrays (indices into Schema::arrays) that are lost in the segment; in
  /// parts of the piece they are NaN there, integers 0, unless another segment has the vertex, too.
  /// Empty unless the file is damaged; so are the next two.
  std::span<const std::uint32_t> lost_arrays(std::size_t segment) const;
  /// What a segment is called in the file, where some are lost.
  std::uint32_t segment_number(std::size_t segment) const;
  /// Whether a stepped array had values at a step, or may have had: they need not be left.
  bool had_values(std::uint32_t array, std::uint64_t step) const;
  // Of the whole file, as the index tells.
  std::uint64_t vertices() const;
  std::uint64_t cells() const;
  std::uint64_t hexahedra() const;
  /// Time steps: values stand at some of the steps below.
  std::uint64_t step_count() const;
  const std::vector<std::uint64_t>& block_cells() const;

  /// Reads all extras of the file. Their references are to numbers of the whole mesh.
  Result<std::vector<Extra>> extras();
  /// The time of each step, or nothing.
  Result<std::vector<double>> step_times();
  /// The steps at which a stepped array has values, ascending.
  Result<std::vector<std::uint64_t>> steps(std::uint32_t array);

  /// The reader of its steps, over the same index; made by the first call that needs it, it lives
  /// as long as this. A request to it drops what begin_values() began, and the other way round.
  Result<StepReader*> step_reader();

  /// What next() is to give; drops the piece before. Tells the source what will be read, as far as
  /// the index knows. Of the options those that concern threads are looked at; the source is read
  /// in the caller's thread all the same. What comes, and what fails, is the same for any number of
  /// threads; those of pieces that are looked for (by a box, or in other order than the file's)
  /// work on one group at a time. ErrorCode::misuse where the request names what the file has not.
  Result<void> begin(const ExtractRequest& request, const ReadOptions& options = {});
  /// The next part of the piece; null at the end. Valid until the next call. Parts come segment by
  /// segment, not always in order; numbers are those of the whole mesh. Each cell comes once, each
  /// vertex once, before or with the first cell that uses it (vertices that no cell uses only
  /// where all cells are wanted, or ExtractRequest::unused_vertices). In a part, first_vertex and
  /// first_cell count within the piece, last_use is 0 (unless the piece is all cells of an
  /// undamaged file: then it is as a Reader gives it), `imported` is empty, and arrays that are not
  /// wanted are.
  Result<MeshBlock*> next();

  // After next() gave null.
  /// Numbers of the piece's vertices and cells, ascending.
  const std::vector<std::uint64_t>& vertex_numbers() const;
  const std::vector<std::uint64_t>& cell_numbers() const;
  /// A stepped array at a step: what next_values() is to give. Steps in ascending order cost least.
  /// ErrorCode::misuse where the array has no values at that step.
  Result<void> begin_values(std::uint32_t array, std::uint64_t step);
  /// Values of elements of the piece, each of which comes once, with their numbers
  /// (StepValues::first is 0); null at the end. Valid until the next call. Of a damaged file not of
  /// those whose values are lost.
  Result<StepValues*> next_values();

 private:
  class Impl;
  explicit MeshExtractor(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
