// Limits on the resources that a file may demand, and options of a Reader.
#pragma once

#include <cstdint>

namespace shm {

/// Limits on the resources that a file may demand; files can be hostile. A file that exceeds a
/// limit fails with ErrorCode::over_limit.
struct ReadLimits {
  std::uint64_t max_active_vertices = std::uint64_t{1} << 27;
  std::uint64_t max_chunk_bytes = std::uint64_t{1} << 30;  ///< size of the payload of one chunk
  /// Size of one chunk group, unpacked. For step values it also limits the size of a group's
  /// neighbourhoods.
  std::uint64_t max_group_bytes = std::uint64_t{1} << 30;
  std::uint64_t max_extra_bytes = std::uint64_t{1} << 30;  ///< size of one extra, unpacked
  /// Memory limit for the active vertices of a segment: this value plus `kActiveBytesEach` per byte
  /// of the file read so far. For a file opened by its index, or by a tool that knows its size, all
  /// bytes of the file count from the beginning. An active vertex counts as 288 bytes; with codec
  /// patterns as 72, with codec shifts as 16.
  std::uint64_t max_active_bytes = std::uint64_t{1} << 26;
  static constexpr std::uint64_t kActiveBytesEach = 256;
  /// Memory limit for the values kept for active vertices and cells of a segment: this value plus
  /// 512 bytes per byte of the segment read so far. Arrays in which almost all values are equal
  /// need no memory. Time steps have a separate limit: this value plus 256 bytes per byte of the
  /// file read so far.
  std::uint64_t max_column_bytes = std::uint64_t{1} << 25;
  /// Memory limit for schema, step times and extras together, unpacked: this value plus 256 bytes
  /// per byte of the file. Files written by a Writer need less.
  std::uint64_t max_unpacked_bytes = std::uint64_t{1} << 26;
  std::uint32_t max_arrays = 65536;
  std::uint32_t max_static_components = 4096;  ///< of all static arrays together
  std::uint32_t max_blocks = 1 << 20;
  std::uint64_t max_steps = 1 << 20;
  std::uint32_t max_segments = 1 << 20;
  // Size of the result: unlimited by default, since a small file can legitimately contain many
  // cells. For a file opened by its index, the counts of the whole file are checked when it is
  // opened.
  std::uint64_t max_vertices = ~std::uint64_t{0};
  std::uint64_t max_cells = ~std::uint64_t{0};
  /// Maximum size of all items that a Decoder or Reader returns: bytes of coordinates and of all
  /// values, steps included, plus 8 bytes per corner of a cell.
  std::uint64_t max_decoded_bytes = ~std::uint64_t{0};
};

/// Options of a Reader. They do not affect its results.
struct ReadOptions {
  /// Number of threads that decode segments ahead of the caller's thread. 1: no such threads, 0:
  /// one per core.
  unsigned threads = 1;
  /// With threads: memory limit for the groups that wait for a thread and the blocks that wait for
  /// the caller, together. Each thread may hold one more group.
  std::uint64_t max_ahead_bytes = std::uint64_t{256} << 20;
  /// Memory limit for the neighbourhoods of the mesh, as in WriteOptions.
  std::uint64_t kept_topology_bytes = std::uint64_t{64} << 20;
};

}  // namespace shm
