// PartWriter and PartJoiner: one file by several writers at once, each with some consecutive
// segments of the mesh: ranks of an MPI program, processes, threads. The bytes are those of one
// Writer that gets the whole mesh with the same schema and options. The library moves nothing
// between the writers: what they have to tell each other goes through the caller.
//
// Each part:
//   create                 where its first segment begins must be known: its first cell, and how
//                          many vertices earlier parts own
//   add_...                its cells, each vertex before the first of them that uses it; end_mesh
//   set_imported_numbers   not in Order::keep: what numbers the vertices of earlier parts got
//   mesh_chunks            place() these behind those of the part before, write them
//   begin_steps, and for each array and step in turn:
//     begin_step, add_step_values, end_step   one part says what the step refers to (StepReference)
//   end_steps              of begin_steps; chunks as of a step
// One PartJoiner, anywhere:
//   create                 writes what stands before all parts
//   add                    what each part tells of its chunks, in the order of the file
//   times, extras, finish  write what stands behind
// spec: "Segments", "Container", "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "shm/io.h"
#include "shm/schema.h"
#include "shm/writer.h"

namespace shm {

/// Where a part begins: always where a segment does.
struct PartStart {
  std::uint32_t segment = 0;       ///< its first one
  std::uint64_t first_cell = 0;    ///< cells of all parts before
  std::uint64_t first_vertex = 0;  ///< vertices that these parts own: first used by their cells
};

/// Finished chunks, front to back.
struct PartChunks {
  std::vector<std::byte> bytes;  ///< as they stand in the file, once place() has numbered them
  std::vector<std::byte> index;  ///< what the index tells of them: for PartJoiner::add
  std::uint32_t count = 0;       ///< chunks
};
/// Numbers the chunks: `first` chunks stand before them in the file, that of the schema included
/// (PartJoiner::chunks). Corrupt where `chunks` are not what a PartWriter gave.
SHM_API Result<void> place(PartChunks& chunks, std::uint32_t first);

/// Where the elements of a part stand among all, for time steps.
struct PartSteps {
  std::uint32_t first_group = 0;  ///< chunks of mesh_chunks() of all parts before
  /// By array of the schema; of arrays without time steps they do not matter.
  std::vector<std::uint64_t> first_elements;  ///< elements in all parts before
  std::vector<std::uint64_t> elements;        ///< of the whole mesh
};

/// Memory as of a Writer, and the finished chunks until the caller takes them; not in Order::keep
/// also 16 bytes a vertex until then. After the first error every call returns that error. Not
/// thread safe; distinct PartWriters are independent.
class SHM_API PartWriter {
 public:
  /// Segments must begin at known cells: options.segment_cells or options.segment_starts say
  /// where, or options.restart_budget is 0. options.coding_order is borrowed, and hears the part's
  /// own vertices and its cells, whose numbers go on from start.first_cell.
  static Result<PartWriter> create(Schema schema, const WriteOptions& options,
                                   const PartStart& start);
  PartWriter(PartWriter&&) noexcept;
  PartWriter& operator=(PartWriter&&) noexcept;
  ~PartWriter();

  /// As in Writer; a vertex that no cell of an earlier part uses.
  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data = {});
  /// A vertex that a cell of an earlier part uses. Not in the part that begins with segment 0.
  Result<void> add_imported_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                   std::span<const std::byte> data = {});
  /// As in Writer; in the last part only.
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data = {});
  /// As in Writer: `last_use` means cells of the whole mesh. No more cells than up to where the
  /// next part begins.
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use = 0, std::span<const std::byte> data = {});
  /// Codes what is pending. By now options.coding_order has heard all: own vertex i of the part has
  /// number start.first_vertex + i where the order is not keep.
  Result<void> end_mesh();
  /// After end_mesh, not in Order::keep: the numbers of the imported vertices, in order of
  /// add_imported_vertex.
  Result<void> set_imported_numbers(std::span<const std::uint64_t> numbers);
  /// After all of these, once.
  Result<PartChunks> mesh_chunks();

  /// After mesh_chunks, before the first step.
  Result<void> begin_steps(const PartSteps& steps);
  /// Whether this part chooses what steps of the array refer to: it has the first element.
  bool chooses(std::uint32_t array) const;
  /// Steps come in the same order in all parts; of one array they ascend. `basis`: what the part
  /// that chooses has chosen; nothing in that part. It does not matter where a part has no
  /// elements.
  Result<void> begin_step(std::uint32_t array, std::uint64_t step,
                          std::optional<StepReference> basis = std::nullopt);
  /// Values of the part's own elements in coding order, in pieces of any size.
  Result<void> add_step_values(std::span<const std::byte> values);
  /// Of the part that chooses: the choice, as soon as it is made, which takes a group.
  std::optional<StepReference> step_basis() const;
  /// What is finished by now: small values wait, to stand in one chunk with others.
  Result<PartChunks> end_step();
  /// After the last step: what still waited.
  Result<PartChunks> end_steps();

 private:
  class Impl;
  explicit PartWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Order of calls: create; add the mesh chunks of all parts, then those of each step; then times
/// and extras; then finish. After the first error every call returns that error.
class SHM_API PartJoiner {
 public:
  /// `sink` is borrowed. It gets only what the joiner writes itself: what a call writes belongs
  /// where offset() was before the call. `schema`, `options`: those of the parts.
  static Result<PartJoiner> create(ByteSink& sink, Schema schema, const WriteOptions& options);
  PartJoiner(PartJoiner&&) noexcept;
  PartJoiner& operator=(PartJoiner&&) noexcept;
  ~PartJoiner();

  /// Where the next byte of the file goes, and how many chunks stand before it.
  std::uint64_t offset() const;
  std::uint32_t chunks() const;
  /// The chunks that stand next, from offset() on: `index` is theirs, `bytes` their size. Corrupt
  /// where they do not go together.
  Result<void> add(std::span<const std::byte> index, std::uint64_t bytes);

  /// As in Writer.
  Result<void> set_step_times(std::span<const double> times);
  Result<void> add_extra(const Extra& extra);
  Result<SizeReport> finish();  ///< commits the sink

 private:
  class Impl;
  explicit PartJoiner(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
