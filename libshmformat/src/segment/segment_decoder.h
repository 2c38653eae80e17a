// SegmentDecoder: the groups of one segment as they stand in a file in, blocks of vertices and
// cells out. It checks what a group states before its decoder sees it. It needs nothing of other
// segments, so several can work at once.
// spec: "Segments", "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "segment/group_decoder.h"

namespace shm {

/// The decoder of a segment whose first group has this header.
Result<std::unique_ptr<GroupDecoder>> make_group_decoder(const Schema& schema,
                                                         const SegmentStart& start,
                                                         const DecodedParts& parts,
                                                         CellBytes cell_bytes,
                                                         const container::GroupHeader& header);

class SegmentDecoder {
 public:
  /// `schema` is checked and borrowed. Streams of values that are not among `parts` are not looked
  /// at.
  SegmentDecoder(const Schema& schema, const ReadLimits& limits, std::uint32_t segment,
                 DecodedParts parts = {});
  SegmentDecoder(const SegmentDecoder&) = delete;  // its decoder borrows the group's header
  SegmentDecoder& operator=(const SegmentDecoder&) = delete;

  /// The next group. Where it stands, and which one it is, is for errors.
  Result<void> begin_group(container::GroupChunk chunk);
  bool in_group() const { return in_group_; }
  /// Must hold: in_group(). Some thousand cells at most.
  Result<DecodedBlock> next_block();

  /// The header of the group that began last.
  const container::GroupHeader& group() const { return group_; }
  /// As the header of the first group states it. Must hold: begin_group() succeeded once.
  const SegmentStart& start() const { return start_; }
  /// Numbers of own vertices that are not finalized by now.
  std::vector<std::uint64_t> alive() const;

 private:
  Result<void> check_header();
  Result<void> begin_streams();
  Error damaged(std::string detail, ErrorCode code = ErrorCode::corrupt) const;
  /// An error of the decoder, with the place of the group.
  Error placed(const Error& error) const { return damaged(error.detail, error.code); }

  const Schema* schema_;
  ReadLimits limits_;
  DecodedParts parts_;
  SegmentStart start_;
  std::unique_ptr<GroupDecoder> decoder_;  // from the first group on

  std::vector<std::byte> payload_;
  container::GroupHeader group_;
  std::size_t header_bytes_ = 0;
  bool in_group_ = false;
  std::uint64_t group_offset_ = 0, group_number_ = 0;
  std::map<std::string, std::uint64_t> stream_bytes_;

  std::uint64_t next_cell_ = 0, next_vertex_ = 0;
};

}  // namespace shm
