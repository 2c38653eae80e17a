// SegmentDecoder: the groups of one segment as they stand in a file in, blocks of vertices and
// cells out. It checks what a group states before its decoder sees it. It needs nothing of other
// segments, so several can work at once: a DecodingQueue has them do so.
// spec: "Segments", "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bytes/ordered_tasks.h"
#include "groups/group_decoder.h"
#include "shm/reader.h"

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
  /// Must hold: in_group(). Some thousand cells at most. `room`: a block whose room it takes.
  Result<DecodedBlock> next_block(MeshBlock&& room = {});

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
  std::uint64_t segment_bytes_ = 0;  // of its groups so far
  bool in_group_ = false;
  std::uint64_t group_offset_ = 0, group_number_ = 0;
  std::map<std::string, std::uint64_t> stream_bytes_;

  std::uint64_t next_cell_ = 0, next_vertex_ = 0;
};

/// Groups of several segments in, segment after segment, blocks and the ends of segments out, in
/// the same order. They are decoded one after the other when they are taken, or by threads ahead,
/// segment beside segment; what comes out is the same. With threads it keeps what waits, within
/// limits.
class DecodingQueue {
 public:
  /// Either a block, or the end of its segment.
  struct Output {
    std::size_t segment = 0;  ///< as begin_segment() was told
    std::uint64_t group = 0;  ///< of a block: number of its group
    std::optional<DecodedBlock> block;
    std::vector<std::uint64_t> left_alive;  ///< at the end: numbers of vertices not finalized
  };

 private:
  using Tasks = OrderedTasks<container::GroupChunk, Output>;

 public:
  /// Looks at the header of a group before its blocks are decoded, in any thread.
  using Check =
      std::function<Result<void>(std::uint64_t group, const container::GroupHeader& header)>;

  /// `schema` is checked and borrowed.
  DecodingQueue(const Schema& schema, const ReadLimits& limits, const ReadOptions& options,
                Check check = {});
  DecodingQueue(const DecodingQueue&) = delete;  // its tasks borrow it
  DecodingQueue& operator=(const DecodingQueue&) = delete;

  /// What follows is of another segment. `segment` is for outputs; `number` is that of the file.
  void begin_segment(std::size_t segment, std::uint32_t number, DecodedParts parts = {});
  /// Whether another group may be added before all blocks have been taken.
  bool wants_group() const;
  /// The next group of the segment. Must hold: wants_group().
  Result<void> add_group(container::GroupChunk chunk);
  /// No segment will follow.
  void end();
  /// Whether outputs are there or coming.
  bool is_busy() const;

  using Wait = Tasks::Wait;
  /// The next output. Nothing where none is there yet and it is not waited for, where another group
  /// may be added, or where nothing is coming.
  Result<std::optional<Output>> next(Wait wait);
  /// Takes the room of a block that was taken, for one to come; not with threads.
  void reuse(MeshBlock&& block) {
    if (!tasks_) room_ = std::move(block);
  }

 private:
  class SegmentTask;
  /// A segment that is decoded here.
  struct Segment {
    std::size_t segment;
    SegmentDecoder decoder;
    std::uint64_t group = 0;
  };

  void leave_segment();

  const Schema* schema_;
  ReadLimits limits_;
  Check check_;
  std::unique_ptr<Segment> segment_;  // without threads
  std::optional<Output> left_;        // the same: the end of the one before
  MeshBlock room_;                    // the same
  std::unique_ptr<Tasks> tasks_;      // with threads
};

}  // namespace shm
