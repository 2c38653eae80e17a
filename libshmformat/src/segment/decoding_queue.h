// DecodingQueue: groups of segments in, blocks of vertices and cells out, in the same order. They
// are decoded one after the other when they are taken, or by threads ahead, segment beside segment.
// What comes out is the same.
// in:    groups, segment after segment
// out:   blocks, and the end of each segment
// keeps: with threads, what waits, within limits; without, the group at hand
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bytes/ordered_tasks.h"
#include "segment/segment_decoder.h"
#include "shm/reader.h"

namespace shm {

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
  /// Looks at the header of a group before it is decoded, in any thread.
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
  std::unique_ptr<Tasks> tasks_;      // with threads
};

}  // namespace shm
