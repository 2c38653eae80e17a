// DamageReport: lists the damaged parts of a file. All types are plain values.
// spec: "Recovery"
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shm/schema.h"

namespace shm {

enum class DamageKind : std::uint8_t {
  damaged = 1,   ///< the bytes of the part have changed
  missing,       ///< the part has been removed, or the file was truncated before it
  repeated,      ///< the part is an intact copy of an earlier part of the file
  out_of_order,  ///< the part is intact, but at the wrong position
  stray,         ///< the bytes belong to no part of the file
};

/// One chunk, or another part of the file, that is damaged, missing, repeated or out of order, or
/// bytes that belong to no part. A chunk can contain step values of several arrays. If such a chunk
/// is damaged, there is one Damage for each array, all with the same `offset` and `bytes`; in all
/// of them except the first, `chunks` is 0.
struct Damage {
  DamageKind kind = DamageKind::damaged;
  /// Name of the part: "file start", "schema", "group", "step values", "step times", "extra",
  /// "index" or "end record"; "chunk" if the kind of chunk is unknown.
  std::string section;
  /// Position of the part in the file and its size in bytes. For a missing part: its expected
  /// position, and size 0.
  std::uint64_t offset = 0, bytes = 0;
  /// Number of chunks lost at this position. It can exceed 1 only if the headers of these chunks
  /// are lost too.
  std::uint64_t chunks = 1;
  /// Number of the segment to which a group or step values belong, if known.
  std::optional<std::uint32_t> segment{};
  /// First damaged cell in coding order, if known, and the number of damaged cells. If both the
  /// header of the chunk and the index are lost, the two numbers are derived from the groups before
  /// and after the chunk.
  std::optional<std::uint64_t> first_cell{};
  std::uint64_t cells = 0;
  /// Damaged arrays (indices into Schema::arrays). For step values this is the array to which the
  /// values belong. For a group these are the arrays whose bitstreams are damaged, if the rest of
  /// the group is intact; otherwise the list is empty.
  std::vector<std::uint32_t> arrays{};
  std::optional<std::uint64_t> step{};  ///< number of the time step, for step values only
};

struct DamageReport {
  /// All damage found, in file order. Empty if all checksums are correct.
  std::vector<Damage> damages;
  /// True if all chunks and the index are intact, even if some of them are at the wrong position.
  /// write_in_order() then restores the file.
  bool restorable = false;
  /// True if all chunks with values are intact. Parts that only help to find chunks, such as the
  /// index, may be lost.
  bool complete = false;
  /// True if the index is lost but all known chunks with values are intact. write_in_order() then
  /// rebuilds the index if the values can be decoded. If `complete` is false, further chunks at the
  /// end of the file may have been lost. In that case the rebuilt index must fit into the bytes
  /// after the last chunk.
  bool lacks_index = false;
  /// True if the value ranges in a rebuilt index may differ from those in the original index. This
  /// is possible only for files of format versions before 0.10 that contain arrays with an error
  /// bound: the original index contains the value ranges before rounding, the rebuilt index the
  /// ranges after rounding.
  bool has_other_ranges = false;
  std::optional<Schema> schema;  ///< schema of the file; empty if all copies are lost
  std::optional<std::uint64_t> vertices, cells,
      steps;  ///< totals of the whole file, if the index is intact
};

}  // namespace shm
