// Writer: receives a mesh vertex by vertex and cell by cell, and writes a .shm file to a sink. The
// memory needed depends on the sizes of the active surface, the delay buffer and one chunk group,
// not on the size of the mesh. If the mesh has stepped arrays, the Writer also keeps in memory the
// compressed connectivity, up to 64 MiB of neighbourhoods, with Order::keep up to 64 MiB of packed
// vertex numbers for the digests, and up to three steps of all stepped arrays. Steps beyond 128 MiB
// are in a temporary file (WriteOptions::kept_steps_bytes). spec: "Group" The vertex and cell
// events are those of streaming meshes (Isenburg & Lindstrom 2005).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "shm/io.h"
#include "shm/options.h"
#include "shm/schema.h"

namespace shm {

struct MeshArrays;  // shm/mesh.h

/// Receives a mesh and encodes it. Order of calls: create; then either any mix of add_vertex and
/// add_cell, with each vertex before the first cell that uses it, or add_mesh; then end_mesh; then
/// steps and extras; then finish. After the first error every call returns that error. A Writer is
/// not thread safe; distinct Writers are independent. Values are raw bytes of the declared scalar
/// type in host byte order.
class SHM_API Writer {
 public:
  /// `sink` and options.coding_order are borrowed and must outlive the Writer.
  static Result<Writer> create(ByteSink& sink, Schema schema, const WriteOptions& options = {});
  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;
  ~Writer();

  /// Adds a vertex. `number` identifies the vertex in later calls. The number must not be in use:
  /// either no earlier vertex had this number, or that vertex has been finalized (reuse is not
  /// allowed with Order::keep). With Order::keep a Reader returns the same number. `xyz` contains 3
  /// scalars of the coordinate type. `data` contains the packed values of the static point arrays,
  /// in schema order.
  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data = {});
  /// Adds a vertex that no cell uses. The Writer codes this vertex immediately and does not keep it
  /// in memory. Vertices from add_vertex() that no cell has used by the end of the mesh are coded
  /// too, but stay in memory until then.
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data = {});
  /// Adds a cell. `corners` contains the numbers of its nodes_per_cell vertices, which must have
  /// been added and not yet finalized; a vertex may occur more than once. Bit i (i < 64) of
  /// `last_use` marks corner i as a vertex that no later cell uses. Vertices that are never marked
  /// stay in memory to the end, in both Writer and Reader. `data` contains the packed values of the
  /// static cell arrays that cover `block`, in schema order. `other_last_uses` contains the numbers
  /// of other vertices that no later cell uses, and that the cell has only at corners from 64 on.
  /// It counts only for cells of orders 3 to 10, and is ignored for other cells.
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use = 0, std::span<const std::byte> data = {},
                        std::span<const std::uint64_t> other_last_uses = {});
  /// Adds vertices, as add_vertex() does for one vertex. `xyz` and `data` contain the coordinates
  /// and the values of all vertices, vertex after vertex.
  Result<void> add_vertices(std::span<const std::uint64_t> numbers, std::span<const std::byte> xyz,
                            std::span<const std::byte> data = {});
  /// Adds `cells` cells of one block with the same number of corners. `last_uses` contains one
  /// value per cell, or is empty.
  Result<void> add_cells(std::uint32_t block, std::size_t cells,
                         std::span<const std::uint64_t> corners,
                         std::span<const std::uint64_t> last_uses = {},
                         std::span<const std::byte> data = {});
  /// Adds a whole mesh, whose vertices are numbered from 0. The vertices are interleaved with the
  /// cells and finalized as early as possible (vertex compaction). No other vertices or cells may
  /// be added; continue with end_mesh(). Fails with ErrorCode::misuse if the sizes of the arrays
  /// are inconsistent, or if a vertex or block number does not exist. `mesh` is borrowed during the
  /// call. The call needs 8 bytes of memory per vertex.
  Result<void> add_mesh(const MeshArrays& mesh);

  /// Codes all pending vertices and cells; unused vertices come last. No vertices or cells may
  /// follow.
  Result<void> end_mesh();

  /// Adds values of the stepped array `array` at step `step`. Pass the values of all elements of
  /// the array in coding order, in pieces of any size. Steps of an array must ascend. One array at
  /// one step must be complete before the next array or step begins.
  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values);
  /// Sets the times of all steps so far, at any time after end_mesh. A later call must repeat the
  /// times of the earlier call, and may add the times of further steps.
  Result<void> set_step_times(std::span<const double> times);
  /// Adds an extra, at any time after create. References in the extra must already use the numbers
  /// that a Reader will see.
  Result<void> add_extra(const Extra& extra);

  /// Makes everything added so far a whole file in the sink, with its steps and their times, and
  /// publishes it (ByteSink::publish()). Call it after end_mesh and between whole steps. More
  /// steps, times and extras may follow; if they are never committed, readers ignore them. Values
  /// of small steps share a chunk only with steps of the same commit, so frequent commits make the
  /// file larger. spec: "Commits"
  Result<void> commit();
  /// Writes the index and the totals, and commits the sink. The file is valid only if finish()
  /// succeeds; a FileSink makes its file visible only then. The destructor reports no errors.
  Result<SizeReport> finish();

 private:
  class Impl;
  explicit Writer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
