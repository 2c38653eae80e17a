// What is damaged in a file. Plain values.
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
  missing,       ///< the bytes are not in the file: cut off, or taken out
  repeated,      ///< intact, but a copy of something that already occurred
  out_of_order,  ///< intact, but not in its place
  stray,         ///< bytes that belong to nothing
};

/// One chunk, or another part of the file, that is damaged or not in its place. A chunk with
/// several parts of step values yields one Damage per part, all with the same offset and bytes; all
/// but the first have `chunks` 0.
struct Damage {
  DamageKind kind = DamageKind::damaged;
  /// "file start", "schema", "group", "step values", "step times", "extra", "index", "end record";
  /// "chunk" if the kind is unknown.
  std::string section;
  /// Position in the file; for a missing part its expected position, with 0 bytes.
  std::uint64_t offset = 0, bytes = 0;
  std::uint64_t chunks = 1;  ///< number of chunks lost here if their headers are lost too
  /// Segment of a group or of step values, if known.
  std::optional<std::uint32_t> segment{};
  /// First damaged cell in coding order, if known, and the number of damaged cells. If a header is
  /// lost and there is no index, both follow from the groups before and after.
  std::optional<std::uint64_t> first_cell{};
  std::uint64_t cells = 0;
  /// Damaged arrays (indices into Schema::arrays). For step values: their array. For a group: the
  /// arrays whose bitstreams are damaged, if the rest of the group is intact; otherwise empty.
  std::vector<std::uint32_t> arrays{};
  std::optional<std::uint64_t> step{};  ///< step of step values
};

struct DamageReport {
  std::vector<Damage> damages;  ///< in file order; empty: all checksums are right
  /// All chunks and the index are intact, in any place: write_in_order() restores the file.
  bool restorable = false;
  /// All chunks with values are intact: at most the parts that locate other parts are lost.
  bool complete = false;
  /// The index is lost and, as far as is known, otherwise only parts that locate other parts.
  /// write_in_order() rebuilds the index if the values can be decoded. If `complete` is false, the
  /// file may have had further chunks at its end; the rebuilt index must then fit into the bytes
  /// after the last chunk.
  bool lacks_index = false;
  /// A rebuilt index may have different ranges for arrays with an error bound: the ranges of their
  /// restored values. Only for files from before 0.10.
  bool has_other_ranges = false;
  std::optional<Schema> schema;  ///< empty if all copies are lost
  std::optional<std::uint64_t> vertices, cells,
      steps;  ///< totals of the whole file, if the index is intact
};

}  // namespace shm
