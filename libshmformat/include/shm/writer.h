// Writer: takes a mesh vertex by vertex and cell by cell, and writes a .shm file to a sink. Memory
// follows the active surface, the delay buffer and one chunk group, not the mesh. With stepped
// arrays it also holds the compressed connectivity, up to 64 MiB of neighbourhoods, and one step of
// all stepped arrays if that is 128 MiB or less.
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

/// Receives the order in which vertices and cells are coded. It is the order of step values and of
/// stream numbers, and the order in which a Reader yields them. Called during calls of the Writer,
/// in the caller's thread, group by group: the vertices of a group, then its cells.
class SHM_API CodingOrder {
 public:
  virtual ~CodingOrder() = default;
  virtual void vertex(std::uint64_t number) = 0;  ///< the number given to add_vertex
  virtual void cell(std::uint64_t number) = 0;    ///< counted from 0 in order of add_cell
};

struct WriteOptions {
  std::uint32_t group_cells = 65536;    ///< cells in one chunk group, 1..2^20
  CodingOrder* coding_order = nullptr;  ///< borrowed, may be null
  Level level = Level::standard;
  /// automatic: the level chooses, by trying codecs on the first cells of each segment.
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  /// Step values: at least one of this many steps of an array is a key step, i.e. refers to no
  /// other step, so that reading can begin there. 1: every step is a key step; the schema in the
  /// file records this, and neither Writer nor Reader then holds earlier steps.
  /// Schema::step_references can restrict references further.
  std::uint32_t key_steps = 8;
  /// Step values: memory limit for the neighbourhoods of the mesh. If those of all cells and
  /// vertices exceed it, they are derived again for each array and step, which takes longer. For
  /// arrays on few elements, the part that they need is kept as well, within a limit of the same
  /// size (at least 1 MiB). The file does not depend on it.
  std::uint64_t kept_topology_bytes = std::uint64_t{64} << 20;
  /// Number of threads that encode segments in addition to the caller's thread. 1: none, 0: one per
  /// core. The file does not depend on it. Each thread may hold 64 MiB of waiting cells.
  unsigned threads = 1;

  // Segments: runs of cells that can be decoded independently, also by several threads at once. If
  // a segment uses vertices that an earlier segment owns, it codes them again (they are
  // "imported").
  /// A new segment begins when the vertices that it may have to import are at most this fraction of
  /// the vertices that the segment before it introduced. 0: never.
  double restart_budget = .002;
  std::uint64_t segment_cells = 0;  ///< not 0: cells of every segment; overrides the budget
  /// Not empty: segments begin exactly before the cells with these numbers; ascending, 0 is
  /// ignored.
  std::vector<std::uint64_t> segment_starts{};
  /// Not empty: connectivity codec of each segment, in order; further segments use the last one.
  std::vector<ConnectivityCodec> segment_connectivity{};
};

/// Sizes of a file and its parts. All byte counts add up to `total_bytes`.
struct SizeReport {
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0;
  std::uint64_t max_active_vertices = 0;
  std::uint64_t segments = 0;
  std::uint64_t imported_vertices = 0;  ///< vertices coded again by segments that do not own them
  std::uint64_t total_bytes = 0;
  /// Bytes of each kind of stream: "connectivity", "corner order", "vertex numbers",
  /// "cell numbers", "geometry", array_stream_name() of each array, "extras", "container".
  std::map<std::string, std::uint64_t> streams;
};

/// Order of calls: create; then either any mix of add_vertex and add_cell, with each vertex before
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

  /// Adds a vertex. `number` identifies it in later calls. The number must be free: never used
  /// before, or (except in Order::keep) finalized. With Order::keep a Reader restores it. `xyz`: 3
  /// scalars of the coordinate type. `data`: values of the static point arrays in schema order,
  /// packed.
  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data = {});
  /// Adds a vertex that no cell uses: it is coded at once and not kept. Other vertices that turn
  /// out to be unused at the end of the mesh are coded too, but stay in memory until then.
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data = {});
  /// Adds a cell. `corners`: nodes_per_cell numbers of live vertices; repeats are allowed. Bit i of
  /// `last_use` (i < 64): no later cell uses corner i. Vertices that are never marked stay in
  /// memory to the end, in Writer and Reader. `data`: values of the static cell arrays that cover
  /// this block, in schema order, packed.
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use = 0, std::span<const std::byte> data = {});
  // Several vertices or cells in one call, each handled as above.
  /// `xyz` and `data`: those of all vertices, one after the other.
  Result<void> add_vertices(std::span<const std::uint64_t> numbers, std::span<const std::byte> xyz,
                            std::span<const std::byte> data = {});
  /// Adds `cells` cells of one block with the same number of corners. `last_uses`: one value per
  /// cell, or empty.
  Result<void> add_cells(std::uint32_t block, std::size_t cells,
                         std::span<const std::uint64_t> corners,
                         std::span<const std::uint64_t> last_uses = {},
                         std::span<const std::byte> data = {});
  /// Adds a whole mesh, with vertices numbered from 0. Vertices are interleaved with the cells and
  /// finalized as early as possible (vertex compaction). No other vertices or cells
  /// may be added; continue with end_mesh(). ErrorCode::misuse if sizes contradict each other, or
  /// if a vertex or block number does not exist. `mesh` is borrowed during the call, which needs 8
  /// bytes per vertex.
  Result<void> add_mesh(const MeshArrays& mesh);

  /// Codes everything that is pending, unused vertices last. No vertices or cells may follow.
  Result<void> end_mesh();

  /// Adds values of array `array` (a per_step array) at step `step`. Pass the values of all its
  /// elements in coding order, in pieces of any size. Steps of an array must ascend, and one array
  /// at one step must be complete before the next begins.
  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values);
  /// Sets the time of each step. Call it once, at any time after end_mesh.
  Result<void> set_step_times(std::span<const double> times);
  /// May be called at any time after create. References must already use the numbers that a Reader
  /// will see.
  Result<void> add_extra(const Extra& extra);

  /// Writes index and totals, and commits the sink. The file is valid, and the file of a FileSink
  /// exists, only if this succeeds; the destructor reports nothing.
  Result<SizeReport> finish();

 private:
  class Impl;
  explicit Writer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
