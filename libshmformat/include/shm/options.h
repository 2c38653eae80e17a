// WriteOptions and SizeReport: the options of a Writer, and the sizes that a Writer reports.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "shm/schema.h"

namespace shm {

/// Receives the order in which the Writer codes vertices and cells (coding order). Step values and
/// stream numbers follow this order, and a Reader yields vertices and cells in this order. The
/// Writer calls a CodingOrder in the caller's thread, group by group: first for the vertices of a
/// group, then for its cells.
class SHM_API CodingOrder {
 public:
  virtual ~CodingOrder() = default;
  virtual void vertex(std::uint64_t number) = 0;  ///< receives the number passed to add_vertex
  /// Receives the number of a cell, counted from 0 in the order of the add_cell calls.
  virtual void cell(std::uint64_t number) = 0;
};

struct WriteOptions {
  std::uint32_t group_cells = 65536;    ///< number of cells in one chunk group, 1..2^20
  CodingOrder* coding_order = nullptr;  ///< receiver of the coding order; borrowed, may be null
  Level level = Level::standard;
  /// True if the file contains digests of the vertices, cells, values and step times to which it
  /// decodes. They show errors of a decoder, which checksums cannot show. They need 8 bytes per
  /// chunk, and up to a tenth of the time for writing and reading at level fast (decision 0109).
  bool digest = true;
  /// Codec of the cells. If it is `automatic`, the level chooses, by trying codecs on the first
  /// cells of each segment.
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  /// Distance between key steps: among any `key_steps` consecutive steps of an array, at least one
  /// is a key step. Reading can begin there: a key step refers at most to its base, the most recent
  /// step that refers to no other step. If the distance is 1, no step refers to another. The schema
  /// then states this, so neither the Writer nor the Reader keeps earlier steps.
  /// Schema::step_references can restrict references further.
  std::uint32_t key_steps = 8;
  /// Memory limit in bytes for values of earlier steps. See ReadLimits::max_kept_steps_bytes. The
  /// file does not depend on this limit.
  std::uint64_t kept_steps_bytes = std::uint64_t{1} << 27;
  std::string temporary_folder;
  /// Memory limit in bytes for neighbourhoods of the mesh, which are used to predict step values.
  /// If the neighbourhoods of all cells and vertices need more memory, they are derived again for
  /// each array and step, which takes longer. The same applies to the vertex numbers that the
  /// digests of step values need, with a second limit of the same size. If an array covers only a
  /// few elements, the neighbourhoods of these elements are also kept in memory. A second limit of
  /// the same size (at least 1 MiB) applies to them. The file does not depend on this limit.
  std::uint64_t kept_topology_bytes = std::uint64_t{64} << 20;
  /// Memory limit in bytes for steps of small arrays (at most 64 KiB per step) that wait until
  /// several steps can be coded together, which takes far fewer bytes. Each step of an array counts
  /// as its values plus 100 bytes. While these steps are encoded, their encoded forms are kept in
  /// memory, too. If the limit is 0, each step is written as soon as it is complete.
  std::uint64_t waiting_bytes = std::uint64_t{8} << 20;
  /// Number of step values after which the level `standard` does not try its slowest codec any
  /// more. That codec needs a few microseconds per value, and makes smooth fields up to a fifth
  /// smaller. With the default, small files become as small as possible, and it adds at most a few
  /// seconds to the time for large files.
  std::uint64_t slow_step_values = std::uint64_t{1} << 19;
  /// Number of worker threads that encode segments. If it is 1, the Writer starts no threads and
  /// encodes in the caller's thread. If it is 0, the Writer starts one thread per core. The
  /// contents of the file do not depend on this number. Per thread, up to 64 MiB of cells may wait
  /// in memory to be encoded.
  unsigned threads = 1;

  // A segment is a run of cells that can be decoded independently of other segments, also by
  // several threads at the same time. If a segment uses vertices that an earlier segment owns, the
  // segment codes these vertices again ("imports" them).
  /// A new segment begins if the current segment is long enough and the new segment would have to
  /// import few vertices: at most restart_budget times the number of vertices that the current
  /// segment has introduced. If restart_budget is 0, no new segment begins.
  double restart_budget = .002;
  /// Number of cells of every segment. If it is not 0, it overrides restart_budget.
  std::uint64_t segment_cells = 0;
  /// Numbers of the first cells of segments, ascending. A 0 has no effect, since the first segment
  /// always begins at cell 0. If the list is empty, segment_cells or restart_budget determines the
  /// first cells of segments.
  std::vector<std::uint64_t> segment_starts{};
  /// Connectivity codec of each segment, in order. If there are more segments than codecs, the
  /// final codec in the list is used for the remaining segments. If the list is empty,
  /// `connectivity` is used for all segments.
  std::vector<ConnectivityCodec> segment_connectivity{};
};

/// Sizes of a file and its parts. The sizes in `streams` add up to `total_bytes`.
struct SizeReport {
  std::uint64_t vertices = 0, cells = 0, hexahedra = 0;
  std::uint64_t max_active_vertices = 0;
  std::uint64_t segments = 0;
  /// Number of imports in all segments: a vertex counts once for each segment that codes it again
  /// because an earlier segment owns it.
  std::uint64_t imported_vertices = 0;
  std::uint64_t total_bytes = 0;
  /// Size in bytes of each kind of stream. The keys are "connectivity", "corner order", "vertex
  /// numbers", "cell numbers", "geometry", the array_stream_name() of each array, "extras" and
  /// "container".
  std::map<std::string, std::uint64_t> streams;
};

}  // namespace shm
