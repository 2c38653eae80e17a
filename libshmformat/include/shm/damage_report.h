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
  missing,       ///< the part is not in the file: its bytes were cut off or removed
  repeated,      ///< the part is intact, but a copy of a part that already occurred
  out_of_order,  ///< the part is intact, but in the wrong place
  stray,         ///< the bytes belong to no part of the file
};

/// One chunk, or another part of the file, that is damaged or not in its place. If a chunk with
/// several parts of step values is damaged, there is one Damage per part, all with the same offset
/// and bytes. All of them except the first have `chunks` = 0.
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
  /// First damaged cell in coding order, if known, and the number of damaged cells. If a chunk
  /// header is lost and there is no index, both are derived from the groups before and after.
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
  /// True if all chunks and the index are intact, even if some of them are not in their place.
  /// write_in_order() then restores the file.
  bool restorable = false;
  /// True if all chunks with values are intact. Other parts, such as the index, may be lost. Such
  /// parts only help to find the chunks.
  bool complete = false;
  /// True if the index is lost but all known chunks with values are intact. write_in_order() then
  /// rebuilds the index if the values can be decoded. If `complete` is false, further chunks at the
  /// end of the file may have been lost. In that case the rebuilt index must fit into the bytes
  /// after the last chunk.
  bool lacks_index = false;
  /// True if the value ranges in a rebuilt index may differ from those in the original index. The
  /// reason is that a rebuilt index contains the ranges of the restored values, which differ from
  /// the source's values in arrays with an error bound. Possible only for files from before 0.10.
  bool has_other_ranges = false;
  std::optional<Schema> schema;  ///< schema of the file; empty if all copies are lost
  std::optional<std::uint64_t> vertices, cells,
      steps;  ///< totals of the whole file, if the index is intact
};

}  // namespace shm
