// SegmentDecoder: takes the groups of one segment as the file stores them, gives out blocks of
// vertices and cells. It checks the header of a group before the group decoder sees it. It needs
// nothing from other segments, so several segments can be decoded at once: a DecodingQueue does
// that.
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

#include "base/ordered_tasks.h"
#include "codecs/shared/group_decoder.h"
#include "shm/blocks.h"
#include "shm/limits.h"

namespace shm {

class SegmentDecoder {
 public:
  /// `schema` has passed check_schema() and must outlive the decoder. Streams of values outside
  /// `parts` are ignored.
  SegmentDecoder(const Schema& schema, const ReadLimits& limits, std::uint32_t segment,
                 DecodedParts parts = {});
  SegmentDecoder(const SegmentDecoder&) = delete;  // its decoder borrows the group's header
  SegmentDecoder& operator=(const SegmentDecoder&) = delete;

  /// Begins the next group. Its offset and number serve for error messages only.
  Result<void> begin_group(container::GroupChunk chunk);
  bool in_group() const { return in_group_; }
  /// Decodes the next block, of some thousand cells at most. Must hold: in_group(). `room`: a block
  /// whose memory is reused.
  Result<DecodedBlock> next_block(MeshBlock&& room = {});

  /// The header of the current or last group.
  const container::GroupHeader& group() const { return group_; }
  /// The start of the segment according to the header of its first group. Must hold: begin_group()
  /// succeeded once.
  const SegmentStart& start() const { return start_; }
  /// Numbers of own vertices that are not finalized yet.
  std::vector<std::uint64_t> alive() const;

 private:
  Result<void> check_header();
  Result<void> begin_streams();
  Error damaged(std::string detail, ErrorCode code = ErrorCode::corrupt) const;
  /// Adds the place of the group to an error of the group decoder.
  Error placed(const Error& error) const { return damaged(error.detail, error.code); }

  const Schema* schema_;
  ReadLimits limits_;
  DecodedParts parts_;
  SegmentStart start_;
  std::unique_ptr<GroupDecoder> decoder_;  // from the first group on

  std::vector<std::byte> payload_;
  container::GroupHeader group_;
  std::size_t header_bytes_ = 0;
  std::uint64_t segment_bytes_ = 0;  // payload bytes of its groups so far
  bool in_group_ = false;
  std::uint64_t group_offset_ = 0, group_number_ = 0;
  std::map<std::string, std::uint64_t> stream_bytes_;

  std::uint64_t next_cell_ = 0, next_vertex_ = 0;
};

/// DecodingQueue: takes the groups of several segments, segment after segment; gives out blocks and
/// ends of segments in the same order. It decodes segments one after the other when blocks are
/// taken, or several at once in threads that work ahead. The output is the same. With threads it
/// holds waiting groups and blocks, within limits.
class DecodingQueue {
 public:
  /// Either a block, or the end of its segment.
  struct Output {
    std::size_t segment = 0;  ///< the number passed to begin_segment()
    std::uint64_t group = 0;  ///< number of the group of a block
    std::optional<DecodedBlock> block;
    std::vector<std::uint64_t>
        left_alive;  ///< numbers of vertices that are not finalized at the end
  };

 private:
  using Tasks = OrderedTasks<container::GroupChunk, Output>;

 public:
  /// Check of a group's header before its blocks are decoded. It is called in any thread.
  using Check =
      std::function<Result<void>(std::uint64_t group, const container::GroupHeader& header)>;

  /// `schema` has passed check_schema() and must outlive the queue.
  DecodingQueue(const Schema& schema, const ReadLimits& limits, const ReadOptions& options,
                Check check = {});
  DecodingQueue(const DecodingQueue&) = delete;  // its tasks borrow it
  DecodingQueue& operator=(const DecodingQueue&) = delete;

  /// Begins the next segment. Outputs carry `segment`; `number` is its number in the file.
  void begin_segment(std::size_t segment, std::uint32_t number, DecodedParts parts = {});
  /// Returns true if another group may be added before all blocks have been taken.
  bool wants_group() const;
  /// Adds the next group of the segment. Must hold: wants_group().
  Result<void> add_group(container::GroupChunk chunk);
  /// Declares that no segment follows.
  void end();
  /// Returns true if outputs are available or will be.
  bool is_busy() const;

  using Wait = Tasks::Wait;
  /// Returns the next output. Returns nothing if none is available yet and `wait` is no, if another
  /// group may be added, or if nothing will come.
  Result<std::optional<Output>> next(Wait wait);
  /// Reuses the memory of a block that the caller has finished with; ignored with threads.
  void reuse(MeshBlock&& block) {
    if (!tasks_) room_ = std::move(block);
  }

 private:
  class SegmentTask;
  /// The segment that is being decoded without threads.
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
  std::optional<Output> left_;        // without threads: the end of the last segment
  MeshBlock room_;                    // without threads
  std::unique_ptr<Tasks> tasks_;      // with threads
};

}  // namespace shm
