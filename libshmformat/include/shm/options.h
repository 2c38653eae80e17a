// Options of writing, and the sizes that a writer reports.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "shm/schema.h"

namespace shm {

/// Receives the order in which vertices and cells are coded. It is the order of step values and of
/// stream numbers, and the order in which a Reader yields vertices and cells. The Writer calls it
/// in the caller's thread, group by group: first for the vertices of a group, then for its cells.
class SHM_API CodingOrder {
 public:
  virtual ~CodingOrder() = default;
  virtual void vertex(std::uint64_t number) = 0;  ///< the number passed to add_vertex
  virtual void cell(
      std::uint64_t number) = 0;  ///< counted from 0 in the order of the add_cell calls
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
  /// Step values: memory limit for the neighbourhoods of the mesh. If the neighbourhoods of all
  /// cells and vertices need more, they are derived again for each array and step, which takes
  /// longer. For arrays on few elements, the neighbourhoods of these elements are kept as well,
  /// within a second limit of the same size (at least 1 MiB). The file does not depend on this
  /// limit.
  std::uint64_t kept_topology_bytes = std::uint64_t{64} << 20;
  /// Number of threads that encode segments in addition to the caller's thread. 1: no such threads,
  /// 0: one per core. The file does not depend on it. Each thread may hold 64 MiB of waiting cells.
  unsigned threads = 1;

  // Segments: runs of cells that can be decoded independently, also by several threads at the same
  // time. If a segment uses vertices that an earlier segment owns, it codes them again (they are
  // "imported").
  /// A new segment begins when the vertices that it may have to import are at most this fraction of
  /// the vertices that the segment before it introduced. 0: never.
  double restart_budget = .002;
  std::uint64_t segment_cells =
      0;  ///< not 0: number of cells of every segment; overrides the budget
  /// Not empty: segments begin exactly before the cells with these numbers; ascending, 0 is
  /// ignored.
  std::vector<std::uint64_t> segment_starts{};
  /// Not empty: connectivity codec of each segment, in order; further segments use the last one.
  std::vector<ConnectivityCodec> segment_connectivity{};
};

/// Sizes of a file and its parts. The sizes in `streams` add up to `total_bytes`.
struct SizeReport {
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0;
  std::uint64_t max_active_vertices = 0;
  std::uint64_t segments = 0;
  std::uint64_t imported_vertices = 0;  ///< vertices coded again by segments that do not own them
  std::uint64_t total_bytes = 0;
  /// Size in bytes of each kind of stream: "connectivity", "corner order", "vertex numbers", "cell
  /// numbers", "geometry", array_stream_name() of each array, "extras", "container".
  std::map<std::string, std::uint64_t> streams;
};

}  // namespace shm
