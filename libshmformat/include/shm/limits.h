// ReadLimits and ReadOptions: limits on the resources that a file may demand, and options of a
// Reader.
#pragma once

#include <cstdint>
#include <string>

namespace shm {

/// Limits on the resources that a file may demand, since files can be hostile. Reading a file that
/// exceeds a limit fails with ErrorCode::over_limit.
struct ReadLimits {
  std::uint64_t max_active_vertices = std::uint64_t{1} << 27;
  /// Maximum size in bytes of the payload of one chunk.
  std::uint64_t max_chunk_bytes = std::uint64_t{1} << 30;
  /// Maximum unpacked size in bytes of one group. For step values, it is also the maximum size in
  /// bytes of the neighbourhoods of a group. (A neighbourhood is the list of neighbours from which
  /// an element is predicted.)
  std::uint64_t max_group_bytes = std::uint64_t{1} << 30;
  /// Maximum unpacked size in bytes of one extra.
  std::uint64_t max_extra_bytes = std::uint64_t{1} << 30;
  /// Memory limit in bytes for the active vertices of a segment: this value plus `kActiveBytesEach`
  /// times the number of bytes of the file read so far. If the size of the file is known from the
  /// beginning (because the file is opened through its index, or by the tool), the whole size
  /// counts instead of the bytes read so far. Each active vertex counts as 288 bytes, with the
  /// patterns codec as 72 bytes, and with the shifts codec as 16 bytes.
  std::uint64_t max_active_bytes = std::uint64_t{1} << 26;
  static constexpr std::uint64_t kActiveBytesEach = 256;
  /// Memory limit in bytes for values of the active vertices and cells of a segment: this value
  /// plus 512 times the number of bytes of the segment read so far. Arrays in which almost all
  /// values are equal do not count. Time steps have a separate limit: this value plus 256 times the
  /// number of bytes of the file read so far.
  std::uint64_t max_column_bytes = std::uint64_t{1} << 25;
  /// Memory limit in bytes for the unpacked schema, step times and extras together: this value plus
  /// 256 times the size of the file. Files written by a Writer need less.
  std::uint64_t max_unpacked_bytes = std::uint64_t{1} << 26;
  /// Memory limit in bytes for values of earlier time steps, to which later steps refer. Up to
  /// three steps of each stepped array are kept. Values beyond the limit are kept in a temporary
  /// file in `temporary_folder`; if that is empty, in /var/tmp (on Windows, in the folder for
  /// temporary files). Only the current user may access this file. WebAssembly has no files; there,
  /// reading a file that exceeds the limit fails with ErrorCode::over_limit.
  std::uint64_t max_kept_steps_bytes = std::uint64_t{1} << 27;
  std::string temporary_folder;
  std::uint32_t max_arrays = 65536;
  /// Maximum total number of components of all static arrays.
  std::uint32_t max_static_components = 4096;
  std::uint32_t max_blocks = 1 << 20;
  std::uint64_t max_steps = 1 << 20;
  std::uint32_t max_segments = 1 << 20;
  // Limits on the size of the decoded mesh. By default, the size is unlimited, because a small file
  // can legitimately contain many cells. If a file is opened by its index, the counts of the whole
  // file are checked at that time.
  std::uint64_t max_vertices = ~std::uint64_t{0};
  std::uint64_t max_cells = ~std::uint64_t{0};
  /// Maximum total size in bytes of all items that a Decoder or Reader returns. It counts the
  /// coordinates and all values, including those of time steps, plus 8 bytes per corner of a cell.
  std::uint64_t max_decoded_bytes = ~std::uint64_t{0};
};

/// Options of a Reader. They affect its speed and memory, but not the data that it returns.
struct ReadOptions {
  /// Number of threads that decode segments in advance, before the caller requests their contents.
  /// If 1, no threads are started. If 0, one thread per core is started.
  unsigned threads = 1;
  /// Memory limit in bytes for coded groups that wait for a thread and decoded blocks that wait for
  /// the caller, together. The group that each thread is decoding does not count. Without threads
  /// this limit has no effect.
  std::uint64_t max_ahead_bytes = std::uint64_t{256} << 20;
  /// True if reading fails when decoded vertices, cells, values or step times do not match the
  /// digests in the file. Functions that decode only some arrays, or only one step, compare
  /// nothing.
  bool check_digests = true;
  /// Memory limit in bytes for neighbourhoods of the mesh, which are used to predict step values.
  /// See WriteOptions::kept_topology_bytes.
  std::uint64_t kept_topology_bytes = std::uint64_t{64} << 20;
  /// Number of bytes of the source that belong to the file, as bytes_of_file() returns it, or 0 if
  /// it is not known. Bytes after the last index of a live file may be an incomplete step: if the
  /// number is not known, reading fails there with ErrorCode::truncated.
  std::uint64_t file_bytes = 0;
};

}  // namespace shm
