// SegmentDecoder: converts the groups of one segment, as the file stores them, to blocks of
// vertices and cells. It checks the header of a group before the group decoder reads the group. It
// needs no data of other segments, so several segments can be decoded in parallel. DecodingQueue
// decodes several segments in this way.
// spec: "Segments", "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/ordered_tasks.h"
#include "codecs/shared/group_decoder.h"
#include "shm/blocks.h"
#include "shm/limits.h"

namespace shm {

class SegmentDecoder {
 public:
  /// Creates a decoder of one segment. `schema` has passed check_schema() and must outlive the
  /// decoder. Streams of values that are not in `parts` are ignored.
  SegmentDecoder(const Schema& schema, const ReadLimits& limits, std::uint32_t segment,
                 DecodedParts parts = {});
  SegmentDecoder(const SegmentDecoder&) = delete;  // not copyable, because decoder_ borrows group_
  SegmentDecoder& operator=(const SegmentDecoder&) = delete;

  /// Begins the next group. The offset and the number of the group are used only in error messages.
  Result<void> begin_group(container::GroupChunk chunk);
  bool in_group() const { return in_group_; }
  /// Decodes the next block, which has at most some thousand cells. Must hold: in_group(). `room`
  /// is a block whose memory may be reused.
  Result<DecodedBlock> next_block(MeshBlock&& room = {});

  /// Returns the header of the current or last group.
  const container::GroupHeader& group() const { return group_; }
  /// Returns the start of the segment according to the header of its first group. Must hold:
  /// begin_group() succeeded once.
  const SegmentStart& start() const { return start_; }
  /// Returns the numbers of the segment's own vertices that are not finalized yet.
  std::vector<std::uint64_t> alive() const;

 private:
  Result<void> check_header();
  Result<void> begin_streams();
  Error damaged(std::string detail, ErrorCode code = ErrorCode::corrupt) const;
  /// Adds the position of the group to an error of the group decoder.
  Error placed(const Error& error) const { return damaged(error.detail, error.code); }

  const Schema* schema_;
  ReadLimits limits_;
  DecodedParts parts_;
  SegmentStart start_;
  std::unique_ptr<GroupDecoder> decoder_;  // decoder of the groups; created with the first group

  std::vector<std::byte> payload_;
  container::GroupHeader group_;
  std::size_t header_bytes_ = 0;
  // Total payload size in bytes of the groups of the segment so far.
  std::uint64_t segment_bytes_ = 0;
  bool in_group_ = false;
  std::uint64_t group_offset_ = 0, group_number_ = 0;
  std::map<std::string, std::uint64_t> stream_bytes_;

  std::uint64_t next_cell_ = 0, next_vertex_ = 0;
};

/// DecodingQueue: decodes the groups of several segments, segment after segment, and returns blocks
/// and ends of segments in the same order. Without threads, it decodes when blocks are taken. With
/// threads, it decodes several segments in parallel and in advance, and stores waiting groups and
/// blocks, within limits. The output is the same in both cases.
class DecodingQueue {
 public:
  /// Output of the queue: either a block, or the end of a segment.
  struct Output {
    std::size_t segment = 0;  ///< number of the segment that was passed to begin_segment()
    std::uint64_t group = 0;  ///< number of the group of a block
    std::optional<DecodedBlock> block;
    /// Numbers of the vertices that are not finalized at the end of the segment.
    std::vector<std::uint64_t> left_alive;
  };

 private:
  using Tasks = OrderedTasks<container::GroupChunk, Output>;

 public:
  /// Function that checks a group's header before its blocks are decoded. May be called in any
  /// thread.
  using Check =
      std::function<Result<void>(std::uint64_t group, const container::GroupHeader& header)>;

  /// Creates a queue. `schema` has passed check_schema() and must outlive the queue.
  DecodingQueue(const Schema& schema, const ReadLimits& limits, const ReadOptions& options,
                Check check = {});
  DecodingQueue(const DecodingQueue&) =
      delete;  // not copyable, because the tasks have a pointer to the queue
  DecodingQueue& operator=(const DecodingQueue&) = delete;

  /// Begins the next segment. The outputs of the segment contain `segment`; `number` is the number
  /// of the segment in the file.
  void begin_segment(std::size_t segment, std::uint32_t number, DecodedParts parts = {});
  /// Returns true if another group may be added before all blocks have been taken.
  bool wants_group() const;
  /// Adds the next group of the segment. Must hold: wants_group().
  Result<void> add_group(container::GroupChunk chunk);
  /// Ends the input. Must be called after the last segment.
  void end();
  /// Returns true if outputs are available, or will be available without further groups.
  bool is_busy() const;

  using Wait = Tasks::Wait;
  /// Returns the next output. Returns nullopt if no output is available yet and `wait` forbids
  /// waiting, if another group may be added first, or after the last output.
  Result<std::optional<Output>> next(Wait wait);
  /// Reuses the memory of a block that the caller no longer needs. Does nothing if there are
  /// threads.
  void reuse(MeshBlock&& block) {
    if (!tasks_) room_ = std::move(block);
  }

 private:
  class SegmentTask;
  /// Segment that is being decoded without threads.
  struct Segment {
    std::size_t segment;
    SegmentDecoder decoder;
    std::uint64_t group = 0;
  };

  void leave_segment();

  const Schema* schema_;
  ReadLimits limits_;
  Check check_;
  std::unique_ptr<Segment> segment_;  // current segment; used only without threads
  std::optional<Output> left_;    // an output that has not been returned yet: the end of the last
                                  // segment; used without threads
  MeshBlock room_;                // block whose memory may be reused; used without threads
  std::unique_ptr<Tasks> tasks_;  // tasks of the threads; used only with threads
};

/// MeshDecoder: converts chunk groups to blocks of vertices and cells in coding order. It joins the
/// segments: numbers continue from segment to segment, and a vertex that a segment imports must be
/// left alive by an earlier segment. Segments are decoded one after the other, or in advance by
/// threads. The counterpart that encodes is mesh_encoder.h.
class MeshDecoder {
 public:
  /// Creates a decoder. `schema` has passed check_schema() and must outlive the decoder.
  MeshDecoder(const Schema& schema, const ReadLimits& limits, const ReadOptions& options);

  /// Adds the next group, which belongs to `segment`. The group number in `chunk` is ignored. Must
  /// hold: wants_group().
  Result<void> begin_group(container::GroupChunk chunk, std::uint32_t segment);
  /// Returns true if another group may begin before all blocks have been taken.
  bool wants_group() const { return queue_.wants_group(); }
  /// Returns true if blocks are available, or will be available without further groups.
  bool is_busy() const { return queue_.is_busy(); }
  /// Returns the next block, which has at most some thousand cells. Returns nullopt if
  /// `wait` is not set and no block is available yet, or after the last block.
  Result<std::optional<MeshBlock>> next_block(bool wait);
  /// Reuses the memory of a block that the caller no longer needs.
  void reuse(MeshBlock&& block) { queue_.reuse(std::move(block)); }

  // Return the numbers of vertices and cells in the blocks returned so far.
  std::uint64_t vertices() const { return vertices_; }
  std::uint64_t cells() const { return cells_; }
  std::uint64_t hexahedra() const { return hexahedra_; }
  std::uint64_t max_active_vertices() const { return max_active_vertices_; }
  std::uint64_t imported_vertices() const { return imported_vertices_; }
  /// Returns the number of the first cell of each segment.
  const std::vector<std::uint64_t>& segment_starts() const { return segment_starts_; }
  /// Returns the codec of the cells of each segment.
  const std::vector<ConnectivityCodec>& segment_connectivity() const {
    return segment_connectivity_;
  }
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }
  /// Returns the coded size in bytes of each kind of stream, by the names that SizeReport uses.
  const std::map<std::string, std::uint64_t>& stream_bytes() const { return stream_bytes_; }

 private:
  Result<void> begin_segment(std::uint32_t segment, std::uint64_t offset);
  void leave(const std::vector<std::uint64_t>& alive, std::uint32_t segment);
  Result<void> join(const DecodedBlock& block);
  Result<void> check_imports(const DecodedBlock& block);
  void count(const DecodedBlock& block);
  Error damaged(std::string detail, std::uint64_t group, std::uint64_t offset,
                ErrorCode code = ErrorCode::corrupt) const;

  const Schema* schema_;
  ReadLimits limits_;
  std::uint64_t groups_begun_ = 0;
  std::uint32_t segments_begun_ = 0;
  DecodingQueue queue_;

  /// Vertices that a later segment may import. The value is the last segment that owned or imported
  /// the vertex.
  std::unordered_map<std::uint64_t, std::uint32_t> alive_;
  std::uint64_t groups_ = 0;
  std::uint64_t vertices_ = 0, cells_ = 0, hexahedra_ = 0, max_active_vertices_ = 0,
                imported_vertices_ = 0;
  std::vector<std::uint64_t> segment_starts_;
  std::vector<ConnectivityCodec> segment_connectivity_;
  std::vector<std::uint64_t> block_cells_;
  std::map<std::string, std::uint64_t> stream_bytes_;
};

}  // namespace shm
