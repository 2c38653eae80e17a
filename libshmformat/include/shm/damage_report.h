// DamageReport: the damaged parts of a file. All types are plain values.
// spec: "Recovery"
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "shm/schema.h"

namespace shm {

enum class DamageKind : std::uint8_t {
  damaged = 1,   ///< the bytes have changed
  missing,       ///< the bytes are not in the file: they were cut off or removed
  repeated,      ///< intact, but a copy of something that already occurred
  out_of_order,  ///< intact, but in the wrong place
  stray,         ///< bytes that belong to no part of the file
};

/// One chunk, or another part of the file, that is damaged or not in its place. A chunk with
/// several parts of step values yields one Damage per part, all with the same offset and bytes; all
/// but the first have `chunks` 0.
struct Damage {
  DamageKind kind = DamageKind::damaged;
  /// Name of the part: "file start", "schema", "group", "step values", "step times", "extra",
  /// "index" or "end record"; "chunk" if the kind of chunk is unknown.
  std::string section;
  /// Position of the part in the file and its size. For a missing part: its expected position, and
  /// 0.
  std::uint64_t offset = 0, bytes = 0;
  std::uint64_t chunks =
      1;  ///< number of chunks lost here; more than 1 only if their headers are lost too
  /// Segment of a group or of step values, if known.
  std::optional<std::uint32_t> segment{};
  /// First damaged cell in coding order, if known, and the number of damaged cells. If a header is
  /// lost and there is no index, both are derived from the groups before and after.
  std::optional<std::uint64_t> first_cell{};
  std::uint64_t cells = 0;
  /// Damaged arrays (indices into Schema::arrays). For step values: the array that the values
  /// belong to. For a group: the arrays whose bitstreams are damaged, if the rest of the group is
  /// intact; otherwise empty.
  std::vector<std::uint32_t> arrays{};
  std::optional<std::uint64_t> step{};  ///< step of step values
};

struct DamageReport {
  std::vector<Damage> damages;  ///< in file order; empty if all checksums are correct
  /// True if all chunks and the index are intact, in any place. write_in_order() then restores the
  /// file.
  bool restorable = false;
  /// True if all chunks with values are intact. Only parts that locate other parts can then be
  /// lost.
  bool complete = false;
  /// True if the index is lost and all other losses, as far as they are known, are parts that only
  /// locate other parts. write_in_order() rebuilds the index if the values can be decoded. If
  /// `complete` is false, the file may have had further chunks at its end; the rebuilt index must
  /// then fit into the bytes after the last chunk.
  bool lacks_index = false;
  /// True if a rebuilt index may contain other ranges for arrays with an error bound: the ranges of
  /// their restored values. Possible only for files from before 0.10.
  bool has_other_ranges = false;
  std::optional<Schema> schema;  ///< empty if all copies are lost
  std::optional<std::uint64_t> vertices, cells,
      steps;  ///< totals of the whole file, if the index is intact
};

}  // namespace shm
