// GroupDigest: computes the digest of a group while it is encoded, from the caller's data.
// spec: "Digests"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/shared/digest.h"
#include "codecs/shared/group_data.h"

namespace shm {

class GroupDigest {
 public:
  /// `schema` must outlive this object.
  explicit GroupDigest(const Schema& schema) : schema_(&schema), cells_(schema) {}

  /// Adds a vertex to the group. `position`: its position among all vertices of the file in coding
  /// order, if the segment owns it.
  void add_vertex(const SegmentPiece::Vertex& vertex, std::uint64_t position);
  /// Adds a cell to the group, after the vertices that it introduces. `nodes`: handles of its
  /// vertices. `position`: its position among all cells of the file in coding order. Adds to `late`
  /// the nodes of which the number is not known yet.
  void add_cell(const SegmentPiece::Cell& cell, std::span<const std::uint32_t> nodes,
                std::uint64_t position, std::vector<EncodedGroup::LateNode>& late);
  /// Ends the group: returns the digest of its elements and of their values. The nodes that are not
  /// known yet do not count.
  std::uint64_t finish(const GroupValues& values);

 private:
  /// Number of a vertex, as a reader returns it. If it is kNoNumber, the ticket identifies the
  /// vertex.
  struct Vertex {
    std::uint64_t number = kNoNumber;
    std::uint32_t ticket = kNone;
  };
  bool keeps() const { return schema_->order == Order::keep; }

  const Schema* schema_;
  CellDigests cells_;
  std::vector<Vertex> by_handle_;
  // Of the group:
  std::uint64_t sum_ = 0;                // of its cells
  std::vector<std::uint64_t> vertices_;  // number of each vertex; kNoNumber if it is imported
  std::vector<std::uint64_t> cell_numbers_;
  std::vector<std::uint32_t> cell_blocks_;
};

}  // namespace shm
