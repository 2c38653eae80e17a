// ChunkList: records the chunks that a reader has read, in order to check the index at the end of
// the file. It needs a few bytes per chunk, and 48 more per group for its bounding box.
// - Input: headers of chunks, groups and step values, in file order.
// - Output: the first entry of an index that differs from them, if any.
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
  /// Adds a chunk that is neither a group nor step values. If the reader does not know its kind or
  /// version, only kind, offset and length of its entry are compared.
  void add(const ChunkHeader& header);
  /// `header_bytes`: length of the group header, checksum included.
  void add_group(const ChunkHeader& header, const GroupHeader& group, std::uint64_t header_bytes);
  void add_step_values(const ChunkHeader& header, std::span<const StepPart> parts);

  /// Compares `entries` with the chunks added. Returns nullopt if they are equal. Otherwise returns
  /// the first entry that differs, and the field, e.g. "entry 3, of the group at byte 812, has
  /// another box".
  std::optional<std::string> difference(std::span<const IndexEntry> entries) const;

 private:
  void put_chunk(const ChunkHeader& header, bool is_known);

  ByteWriter lines_;  // the fields of the entries, without running sums: offset, first_cell,
                      // first_vertex, first
  std::uint64_t count_ = 0;
};

}  // namespace shm::container
