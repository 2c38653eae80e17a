// SegmentDecoder: decodes the groups of one segment to blocks of vertices and cells. The caller
// passes each group as stored in the file. SegmentDecoder checks the header of a group before the
// group decoder reads the group. It needs no data of other segments, so several segments can be
// decoded in parallel; DecodingQueue does so.
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
#include "codecs/shared/digest.h"
#include "codecs/shared/group_decoder.h"
#include "shm/blocks.h"
#include "shm/limits.h"

namespace shm {

class SegmentDecoder {
 public:
  /// Creates a decoder of one segment. `schema` must have passed check_schema() and must outlive
  /// the decoder. Streams of values that `parts` does not request are ignored.
  SegmentDecoder(const Schema& schema, const ReadLimits& limits, std::uint32_t segment,
                 DecodedParts parts = {});
  SegmentDecoder(const SegmentDecoder&) = delete;  // not copyable: decoder_ refers to group_
  SegmentDecoder& operator=(const SegmentDecoder&) = delete;

  /// Begins the next group. The offset and the number of the group in `chunk` are used only in
  /// error messages.
  Result<void> begin_group(container::GroupChunk chunk);
  bool in_group() const { return in_group_; }
  /// Decodes the next block, which has at most a few thousand cells. `room`: a block whose memory
  /// may be reused. Precondition: in_group().
  Result<DecodedBlock> next_block(MeshBlock&& room = {});

  /// Returns the header of the current group, or of the previous group if no group is being
  /// decoded.
  const container::GroupHeader& group() const { return group_; }
  /// Returns the number, first cell and first vertex of the segment, as stated in the header of its
  /// first group. Precondition: begin_group() has succeeded once.
  const SegmentStart& start() const { return start_; }
  /// Returns the vertex numbers of all vertices that the segment owns and that are not finalized
  /// yet.
  std::vector<std::uint64_t> alive() const;

 private:
  Result<void> check_header();
  Result<void> begin_streams();
  Error damaged(std::string detail, ErrorCode code = ErrorCode::corrupt) const;
  /// Adds the position of the group in the file to an error reported by the group decoder.
  Error placed(const Error& error) const { return damaged(error.detail, error.code); }

  const Schema* schema_;
  ReadLimits limits_;
  DecodedParts parts_;
  SegmentStart start_;
  std::unique_ptr<GroupDecoder> decoder_;  // decoder of the groups; created when the first group
                                           // begins

  std::vector<std::byte> payload_;
  container::GroupHeader group_;
  std::size_t header_bytes_ = 0;
  // Total payload size in bytes of the segment's groups so far.
  std::uint64_t segment_bytes_ = 0;
  BlockDigests digests_;
  std::uint64_t digest_ = 0;  // of the group's blocks so far
  bool in_group_ = false;
  std::uint64_t group_offset_ = 0, group_number_ = 0;
  std::map<std::string, std::uint64_t> stream_bytes_;

  std::uint64_t next_cell_ = 0, next_vertex_ = 0;
};

/// DecodingQueue: decodes the groups of several segments. It returns blocks and ends of segments in
/// file order. Without threads, it decodes a block when the caller takes the block. With threads,
/// it decodes several segments in parallel and in advance, and stores waiting groups and blocks up
/// to a limit. The output is the same in both cases.
class DecodingQueue {
 public:
  /// Output of the queue: a block or the end of a segment.
  struct Output {
    std::size_t segment = 0;  ///< number that was passed to begin_segment()
    std::uint64_t group = 0;  ///< number of the group of a block
    std::optional<DecodedBlock> block;
    /// Vertex numbers of the segment's vertices that are not finalized when the segment ends.
    std::vector<std::uint64_t> left_alive;
  };

 private:
  using Tasks = OrderedTasks<container::GroupChunk, Output>;

 public:
  /// Function that checks the header of a group before its blocks are decoded. Any thread may call
  /// it.
  using Check =
      std::function<Result<void>(std::uint64_t group, const container::GroupHeader& header)>;

  /// Creates a queue. `schema` must have passed check_schema() and must outlive the queue.
  DecodingQueue(const Schema& schema, const ReadLimits& limits, const ReadOptions& options,
                Check check = {});
  DecodingQueue(const DecodingQueue&) =
      delete;  // not copyable, because tasks have a pointer to the queue
  DecodingQueue& operator=(const DecodingQueue&) = delete;

  /// Begins the next segment. `segment` may be any number; all outputs of this segment contain it.
  /// `number` is the number of the segment in the file.
  void begin_segment(std::size_t segment, std::uint32_t number, DecodedParts parts = {});
  /// Returns true if another group may be added now, even if some blocks have not been taken yet.
  bool wants_group() const;
  /// Adds the next group of the segment. Precondition: wants_group().
  Result<void> add_group(container::GroupChunk chunk);
  /// Ends the input. Call it after the last segment.
  void end();
  /// Returns true if at least one more output can be returned without adding further groups.
  bool is_busy() const;

  using Wait = Tasks::Wait;
  /// Returns the next output. Returns nullopt if all outputs have been returned, or if no output is
  /// available yet, because `wait` forbids waiting for it or because another group must be added
  /// first.
  Result<std::optional<Output>> next(Wait wait);
  /// Lets the queue reuse the memory of a block that the caller no longer needs. Does nothing if
  /// there are threads.
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
  std::optional<Output> left_;  // the end of the previous segment, if it has not been returned yet;
                                // used without threads
  MeshBlock room_;              // block whose memory can be reused; used without threads
  std::unique_ptr<Tasks> tasks_;  // used only with threads: one task per segment
};

/// MeshDecoder: converts the groups of a file to blocks of vertices and cells in coding order. It
/// joins the segments: vertex and cell numbers continue from segment to segment, and a segment may
/// import only vertices that an earlier segment did not finalize. Segments are decoded one after
/// another, or in advance by threads. Its counterpart is mesh_encoder.h.
class MeshDecoder {
 public:
  /// Creates a decoder. `schema` must have passed check_schema() and must outlive the decoder.
  MeshDecoder(const Schema& schema, const ReadLimits& limits, const ReadOptions& options);

  /// Adds the next group. `segment`: the segment to which the group belongs. The group number in
  /// `chunk` is ignored. Precondition: wants_group().
  Result<void> begin_group(container::GroupChunk chunk, std::uint32_t segment);
  /// Returns true if another group may be added now, even if some blocks have not been taken yet.
  bool wants_group() const { return queue_.wants_group(); }
  /// Returns true if at least one more block can be returned without adding further groups.
  bool is_busy() const { return queue_.is_busy(); }
  /// Returns the next block, which has at most a few thousand cells. Returns nullopt after the last
  /// block, or if no block is available yet and `wait` forbids waiting.
  Result<std::optional<MeshBlock>> next_block(bool wait);
  /// Lets the decoder reuse the memory of a block that the caller no longer needs.
  void reuse(MeshBlock&& block) { queue_.reuse(std::move(block)); }

  // The next two functions return the numbers of vertices and of cells in the blocks returned so
  // far.
  std::uint64_t vertices() const { return vertices_; }
  std::uint64_t cells() const { return cells_; }
  std::uint64_t hexahedra() const { return hexahedra_; }
  std::uint64_t max_active_vertices() const { return max_active_vertices_; }
  std::uint64_t imported_vertices() const { return imported_vertices_; }
  /// Returns, for each segment, the number of its first cell.
  const std::vector<std::uint64_t>& segment_starts() const { return segment_starts_; }
  /// Returns, for each segment, the codec of its cells.
  const std::vector<ConnectivityCodec>& segment_connectivity() const {
    return segment_connectivity_;
  }
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }
  /// Returns the sum of the digests of all groups.
  std::uint64_t digest() const { return digest_; }
  /// Returns the coded size in bytes of each kind of stream. The keys are the names used by
  /// SizeReport.
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
  bool checks_digests_;
  DecodingQueue queue_;

  /// Maps each vertex that a later segment may import to the number of the most recent segment that
  /// owned or imported it.
  std::unordered_map<std::uint64_t, std::uint32_t> alive_;
  std::uint64_t groups_ = 0;
  std::uint64_t vertices_ = 0, cells_ = 0, hexahedra_ = 0, max_active_vertices_ = 0,
                imported_vertices_ = 0;
  std::vector<std::uint64_t> segment_starts_;
  std::vector<ConnectivityCodec> segment_connectivity_;
  std::vector<std::uint64_t> block_cells_;
  std::uint64_t digest_ = 0;
  std::map<std::string, std::uint64_t> stream_bytes_;
};

}  // namespace shm
