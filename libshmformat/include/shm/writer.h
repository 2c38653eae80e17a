// Writer: push a mesh in, vertex by vertex and cell by cell; a .shm file comes out at the sink.
// Memory follows the active surface, the delay buffer and one chunk group, not the mesh. With
// stepped arrays it also holds the compressed connectivity, up to 64 MiB of neighbourhoods, and one
// step of all stepped arrays where that is 128 MiB or less.
// spec: "Group"; the event grammar is that of streaming meshes (Isenburg & Lindstrom 2005).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "shm/io.h"
#include "shm/schema.h"

namespace shm {

struct MeshArrays;  // shm/mesh.h

/// Hears in which order vertices and cells are coded: the order of step values, of stream
/// numbers, and of what a Reader will yield. Called from inside Writer calls, in the caller's
/// thread, group by group: its vertices, then its cells.
class SHM_API CodingOrder {
 public:
  virtual ~CodingOrder() = default;
  virtual void vertex(std::uint64_t number) = 0;  ///< the number given to add_vertex
  virtual void cell(std::uint64_t number) = 0;    ///< cells count from 0 in order of add_cell
};

struct WriteOptions {
  std::uint32_t group_cells = 65536;    ///< cells in one chunk group, 1..2^20
  CodingOrder* coding_order = nullptr;  ///< borrowed, may be null
  Level level = Level::standard;
  /// automatic: what the level tries, the smallest on the first cells of each segment.
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  /// Step values: of an array's steps at least one in so many refers to no other, so that reading
  /// may begin there; 1: all. The schema in the file says so, and neither side holds steps for
  /// later ones then; Schema::step_references says less still.
  std::uint32_t key_steps = 8;
  /// Step values: the neighbourhoods of the mesh are kept while those of all cells and vertices
  /// take no more than so many bytes; else they are derived anew for each array and step, which
  /// takes longer. Of arrays on few elements what these need is kept as well, within as many bytes
  /// (at least 1 MiB). The file is the same.
  std::uint64_t kept_topology_bytes = std::uint64_t{64} << 20;
  /// Threads that encode segments, beside the caller's; 1: none, 0: one for each core. The file is
  /// the same for any number. Each may hold 64 MiB of cells that wait.
  unsigned threads = 1;

  // Segments: runs of cells that can be decoded alone, and by several threads at once. Vertices
  // that an earlier segment owns are coded again ("imported") where a segment uses them.
  /// A segment begins where the vertices that it may have to import are at most this fraction of
  /// those that the segment before it introduced. 0: never.
  double restart_budget = .002;
  std::uint64_t segment_cells = 0;  ///< not 0: the cells of every segment, whatever the budget
  /// Not empty: segments begin before the cells of these numbers and nowhere else; ascending, 0 is
  /// ignored.
  std::vector<std::uint64_t> segment_starts{};
  /// Not empty: how the hexahedra of each segment are encoded, in order; further segments as the
  /// last.
  std::vector<ConnectivityCodec> segment_connectivity{};
};

/// Where the bytes went. All byte counts add up to `total_bytes`.
struct SizeReport {
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0;
  std::uint64_t max_active_vertices = 0;
  std::uint64_t segments = 0;
  std::uint64_t imported_vertices = 0;  ///< coded again by segments that do not own them
  std::uint64_t total_bytes = 0;
  /// Bytes of each kind of stream: "connectivity", "corner order", "vertex numbers",
  /// "cell numbers", "geometry", array_stream_name() of each array, "extras", "container".
  std::map<std::string, std::uint64_t> streams;
};

/// Order of calls: create; then any mix of add_vertex and add_cell, where a vertex comes before
/// the first cell that uses it, or add_mesh; then end_mesh; then steps and extras; then finish.
/// After the first error every call returns that error. Not thread safe; distinct Writers are
/// independent. Values are raw bytes of the declared scalar type in host byte order.
class SHM_API Writer {
 public:
  /// `sink` and options.coding_order are borrowed and must outlive the Writer.
  static Result<Writer> create(ByteSink& sink, Schema schema, const WriteOptions& options = {});
  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;
  ~Writer();

  /// `number` names the vertex in later calls. It must be free: never used, or (not in Order::keep)
  /// finalized. Order::keep gives it back on reading. `xyz`: 3 scalars of the coordinate type.
  /// `data`: the static point arrays of the schema in order, packed.
  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data = {});
  /// A vertex that no cell uses: coded at once, never kept. Vertices that turn out unused when the
  /// mesh ends are coded too, but wait in memory until then.
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data = {});
  /// `corners`: numbers of live vertices, repeats allowed; as many as the block's nodes_per_cell.
  /// Bit i of `last_use` (i < 64): no later cell uses corner i. Vertices never marked stay in
  /// memory to the end, on both sides.
  /// `data`: the static cell arrays that cover this block, in order, packed.
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use = 0, std::span<const std::byte> data = {});
  // Many in one call, of which each is done as above.
  /// `xyz` and `data`: of all of them, one after the other.
  Result<void> add_vertices(std::span<const std::uint64_t> numbers, std::span<const std::byte> xyz,
                            std::span<const std::byte> data = {});
  /// `cells` of one block, with as many corners each. `last_uses`: one for each of them, or none.
  Result<void> add_cells(std::uint32_t block, std::size_t cells,
                         std::span<const std::uint64_t> corners,
                         std::span<const std::uint64_t> last_uses = {},
                         std::span<const std::byte> data = {});
  /// A whole mesh, its vertices with numbers from 0 on: interleaved with the cells, and finalized
  /// as early as possible (vertex compaction). Nothing was added before; only end_mesh() and what
  /// comes behind it follow. ErrorCode::misuse where sizes contradict each other, or numbers name
  /// what there is not. `mesh` is borrowed for the call. Takes 8 bytes for each vertex meanwhile.
  Result<void> add_mesh(const MeshArrays& mesh);

  /// Codes what is pending, unused vertices last. No vertices or cells after it.
  Result<void> end_mesh();

  /// Values of array `array` (a per_step one) at step `step`, for all its elements in coding
  /// order; give them in pieces of any size. Steps of one array come in ascending order; one
  /// array at one step is finished before the next begins.
  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values);
  /// The time of each step, once, any time after end_mesh.
  Result<void> set_step_times(std::span<const double> times);
  /// Any time after create. References must already be in the numbers a Reader will see.
  Result<void> add_extra(const Extra& extra);

  /// Writes index and totals, and commits the sink. The file is good, and a FileSink's there, only
  /// if this succeeds; the destructor is silent.
  Result<SizeReport> finish();

 private:
  class Impl;
  explicit Writer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
