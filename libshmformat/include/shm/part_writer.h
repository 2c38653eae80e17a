// PartWriter and PartJoiner: several writers (ranks of an MPI program, processes, threads) write
// one file together. Each writer writes one part: some consecutive segments of the mesh. The file
// has the same bytes as the file that one Writer would produce from the whole mesh with the same
// schema and options. The library does not communicate between the writers: the caller transfers
// data from one writer to another.
//
// Calls for each part, in order:
// - create(): needs the start of the part: its first segment, its first cell, and the number of
//   vertices that earlier parts own.
// - add_...(): adds the cells of the part. Each vertex is added before its first cell in the part.
// - end_mesh(): codes all pending cells.
// - set_imported_numbers(): sets the numbers of the vertices that earlier parts own. Not in
//   Order::keep.
// - mesh_chunks(): returns chunks. Pass them to place(), and write them after the chunks of the
// previous part.
// - begin_steps(): begins the time steps.
// - begin_step(), add_step_values(), end_step(), for each array and step: code the values. For each
//   array, one part chooses the earlier steps that the values refer to; pass its choice to the
//   other parts.
// - end_steps(): ends the time steps. Returns chunks, as end_step() does.
// Calls for the single PartJoiner, which can be in any process:
// - create(): writes everything before the parts.
// - add(): receives the index data of the chunks of each part, in file order.
// - set_step_times(), add_extra(), finish(): write everything after the parts.
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

/// Start of a part, which is always the start of a segment.
struct PartStart {
  std::uint32_t segment = 0;     ///< number of its first segment
  std::uint64_t first_cell = 0;  ///< number of cells in all earlier parts
  /// Number of vertices that earlier parts own. Earlier parts own all vertices that their cells
  /// use.
  std::uint64_t first_vertex = 0;
};

/// Finished chunks of a part, in file order.
struct PartChunks {
  std::vector<std::byte> bytes;  ///< data of the chunks, complete after place()
  std::vector<std::byte> index;  ///< index entries of these chunks; pass them to PartJoiner::add
  std::uint32_t count = 0;       ///< number of chunks
};
/// Writes the final chunk numbers into the chunks of a part. `first` is the number of chunks that
/// precede the part in the file, including the schema (PartJoiner::chunks). Fails with
/// ErrorCode::corrupt if `chunks` did not come from a PartWriter.
SHM_API Result<void> place(PartChunks& chunks, std::uint32_t first);

/// Position of a part's elements among the elements of the whole mesh, needed for time steps.
struct PartSteps {
  /// Number of chunks that mesh_chunks() returned in all earlier parts.
  std::uint32_t first_group = 0;
  /// `first_elements` and `elements` have one entry for each array of the schema. The entries of
  /// arrays without time steps are ignored.
  std::vector<std::uint64_t> first_elements;  ///< number of elements in all earlier parts
  std::vector<std::uint64_t> elements;        ///< number of elements in the whole mesh
};

/// Writes one part of a file. A PartWriter needs the memory of a Writer, plus the size of the
/// finished chunks until the caller takes them. Unless the order is Order::keep, it also needs 16
/// bytes per vertex until the chunks of the mesh have been taken. After the first error every call
/// returns that error. A PartWriter is not thread safe; distinct PartWriters are independent.
class SHM_API PartWriter {
 public:
  /// Begins a part. Segments must begin at cells that are known in advance: set
  /// options.segment_cells or options.segment_starts, or set options.restart_budget to 0.
  /// options.coding_order is borrowed. It receives the vertices that the part owns, and the cells
  /// of the part, whose numbers start at start.first_cell.
  static Result<PartWriter> create(Schema schema, const WriteOptions& options,
                                   const PartStart& start);
  PartWriter(PartWriter&&) noexcept;
  PartWriter& operator=(PartWriter&&) noexcept;
  ~PartWriter();

  /// Adds a vertex that no cell of an earlier part uses, as Writer::add_vertex() does.
  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data = {});
  /// Adds a vertex that a cell of an earlier part uses. Not allowed in the part that begins with
  /// segment 0.
  Result<void> add_imported_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                   std::span<const std::byte> data = {});
  /// Adds a vertex that no cell uses, as Writer::add_unused_vertex() does. Allowed only in the
  /// final part.
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data = {});
  /// Adds a cell, as Writer::add_cell() does; `last_use` refers to the cells of the whole mesh. A
  /// part must not add cells beyond the start of the next part.
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use = 0, std::span<const std::byte> data = {},
                        std::span<const std::uint64_t> other_last_uses = {});
  /// Codes all pending cells. After this call options.coding_order has received all vertices and
  /// cells of the part. Unless the order is Order::keep, the vertices that the part owns have the
  /// numbers start.first_vertex, start.first_vertex + 1, ..., in coding order.
  Result<void> end_mesh();
  /// Sets the numbers of the imported vertices, in the order of the calls to add_imported_vertex().
  /// Call this function after end_mesh. If the order is Order::keep, do not call it.
  Result<void> set_imported_numbers(std::span<const std::uint64_t> numbers);
  /// Returns the chunks of the mesh. Call this function once, after end_mesh() and, unless the
  /// order is Order::keep, after set_imported_numbers().
  Result<PartChunks> mesh_chunks();

  /// Begins the time steps. Call this function after mesh_chunks, before the first step.
  Result<void> begin_steps(const PartSteps& steps);
  /// Returns true if this part contains the first element of the array. The part that contains the
  /// first element (the choosing part) chooses, for each step of the array, how the values of all
  /// parts are coded.
  bool chooses(std::uint32_t array) const;
  /// Begins a step of an array. All parts must process the arrays and steps in the same order, and
  /// the steps of each array must ascend. `basis` states how the values are coded. Pass the result
  /// of step_basis() of the choosing part (see chooses()), also if this part has no elements of the
  /// array. In the choosing part itself, pass std::nullopt.
  Result<void> begin_step(std::uint32_t array, std::uint64_t step,
                          std::optional<StepBasis> basis = std::nullopt);
  /// Adds values of the elements that the part owns, in coding order, in pieces of any size.
  Result<void> add_step_values(std::span<const std::byte> values);
  /// Returns how the values of the current step are coded. Only for the choosing part (see
  /// chooses()). This part chooses it as soon as it has received the values of one group. Until
  /// then the result is std::nullopt. It may remain std::nullopt if this part has all elements of
  /// the array, since no other part needs it then.
  std::optional<StepBasis> step_basis() const;
  /// Ends the step, and returns the chunks that are finished. If the step has few values, they are
  /// held back, so that they can share a chunk with later values.
  Result<PartChunks> end_step();
  /// Ends the time steps, and returns the chunks that were held back.
  Result<PartChunks> end_steps();

 private:
  class Impl;
  explicit PartWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Writes everything in the file that the PartWriters do not write: the beginning, the end, and
/// everything between the parts. Order of calls: create; add the mesh chunks of all parts, then the
/// chunks of each step; then times and extras; then finish. After the first error every call
/// returns that error.
class SHM_API PartJoiner {
 public:
  /// Writes everything before the parts. `sink` is borrowed. It receives only the bytes that the
  /// joiner itself writes, not the chunks of the parts. The bytes that a call writes must be stored
  /// in the file at the offset that offset() returned before this call. `schema` and `options` must
  /// be those of the parts.
  static Result<PartJoiner> create(ByteSink& sink, Schema schema, const WriteOptions& options);
  PartJoiner(PartJoiner&&) noexcept;
  PartJoiner& operator=(PartJoiner&&) noexcept;
  ~PartJoiner();

  /// Return the offset of the next byte of the file, and the number of chunks before that byte.
  std::uint64_t offset() const;
  std::uint32_t chunks() const;
  /// Adds the next chunks of the file, from offset() on. `index` is the index data of these chunks;
  /// `bytes` is the total size of the chunks in bytes. Fails with ErrorCode::corrupt if the two do
  /// not match.
  Result<void> add(std::span<const std::byte> index, std::uint64_t bytes);

  /// Work like the functions of the same name in Writer.
  Result<void> set_step_times(std::span<const double> times);
  Result<void> add_extra(const Extra& extra);
  Result<SizeReport> finish();  ///< commits the sink

 private:
  class Impl;
  explicit PartJoiner(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
