// ChunkList: the chunks that a reader has come by, as an index must list them. It takes a few bytes
// for each, and a box for each group.
// in:  headers of chunks, groups and step values, in the order of the file
// out: which entry of an index is another one, if any is
// spec: "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bytes/binary.h"
#include "container/format.h"

namespace shm::container {

class ChunkList {
 public:
  /// What a chunk holds that a reader does not know, no entry can be held against.
  void add(const ChunkHeader& header);
  /// `header_bytes`: of the header of the group, checksum included.
  void add_group(const ChunkHeader& header, const GroupHeader& group, std::uint64_t header_bytes);
  void add_step_values(const ChunkHeader& header, std::span<const StepPart> parts);

  /// Nothing where `entries` are what has come; else which of them is not, and what of it, as
  /// "entry 3, of the group at byte 812, has another box".
  std::optional<std::string> difference(std::span<const IndexEntry> entries) const;

 private:
  void put_chunk(const ChunkHeader& header, bool is_known);

  ByteWriter lines_;  // what entries have but for sums: offset, first_cell, first_vertex, first
  std::uint64_t count_ = 0;
};

}  // namespace shm::container
