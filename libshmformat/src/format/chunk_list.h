// ChunkList: the chunks that a reader has passed, in order to check the index at the end of the
// file. It needs a few bytes per chunk, plus a bounding box per group.
// in:  headers of chunks, groups and step values, in file order
// out: the first entry of an index that differs, if any
// spec: "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/binary.h"
#include "format/format.h"

namespace shm::container {

class ChunkList {
 public:
  /// Adds any other chunk. If the reader does not know its kind or version, only kind, offset and
  /// length of its entry are compared.
  void add(const ChunkHeader& header);
  /// `header_bytes`: length of the group header, checksum included.
  void add_group(const ChunkHeader& header, const GroupHeader& group, std::uint64_t header_bytes);
  void add_step_values(const ChunkHeader& header, std::span<const StepPart> parts);

  /// Returns nullopt if `entries` are exactly the chunks added. Otherwise names the first entry
  /// that differs and the field, e.g. "entry 3, of the group at byte 812, has another box".
  std::optional<std::string> difference(std::span<const IndexEntry> entries) const;

 private:
  void put_chunk(const ChunkHeader& header, bool is_known);

  ByteWriter lines_;  // the fields of the entries, without running sums: offset, first_cell,
                      // first_vertex, first
  std::uint64_t count_ = 0;
};

}  // namespace shm::container
