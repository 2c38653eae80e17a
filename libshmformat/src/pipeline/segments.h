// Segments of the encoder.
//   SegmentCutter  decides before which cells new segments begin
//   SegmentQueue   encodes segments, and passes on their groups in file order
// spec: "Segments"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "base/ordered_tasks.h"
#include "codecs/shared/segment_encoder.h"
#include "pipeline/choosing_encoder.h"
#include "shm/options.h"

namespace shm {

/// Decides before which cells a new segment begins. The decision depends only on the vertices and
/// cells added so far, so the same calls always produce the same bytes. The end of a group, in
/// contrast, is decided by the segment encoder (codecs/shared/segment_encoder.h).
class SegmentCutter {
 public:
  /// `options` must outlive the cutter.
  explicit SegmentCutter(const WriteOptions& options) : options_(&options) {}

  /// Returns true if a new segment begins before the next cell. `block`, `cell`: element block and
  /// number of this cell.
  bool is_due(std::uint32_t block, std::uint64_t cell) const;
  void begin_segment() { cells_ = introduced_ = 0; }

  /// Counts a cell. `introduced`: number of vertices that the cell introduces. `ended`: number of
  /// its vertices that no later cell uses.
  void add_cell(std::uint32_t block, std::uint64_t introduced, std::uint64_t ended) {
    block_ = block;
    ++cells_;
    introduced_ += introduced;
    live_ += introduced;
    live_ -= ended;
  }
  /// Counts a vertex that was introduced by an earlier part of the mesh.
  void add_import() { ++live_; }

 private:
  const WriteOptions* options_;
  std::uint64_t live_ = 0;   // number of vertices that a cell has used and that are not finalized
                             // yet
  std::uint32_t block_ = 0;  // block of the most recent cell
  // Counts of the current segment
  std::uint64_t cells_ = 0;  // number of cells added so far, whether they are coded or waiting
  std::uint64_t introduced_ =
      0;  // number of vertices that were first used by cells of the current segment
};

/// Encodes segments, and passes on their groups in file order. With several threads, a segment is
/// encoded while later segments are being added. Without threads, it is encoded by the calls that
/// add its cells. The groups and their order do not depend on the number of threads.
class SegmentQueue {
 public:
  using Receiver = std::function<Result<void>(EncodedGroup&)>;

  /// `schema` and `options` must outlive the queue. `receive` is called only in the caller's
  /// thread.
  SegmentQueue(const Schema& schema, const WriteOptions& options, Receiver receive);

  /// Begins a segment. If there is a previous segment, it must have ended.
  void begin_segment(const SegmentStart& start) { start_ = start; }
  /// Returns the piece to which the caller adds cells. It contains the cells of the current segment
  /// that have not been passed on for encoding yet. The caller must call added() after each cell.
  SegmentPiece& piece() { return piece_; }
  Result<void> added() { return piece_is_full() ? pass_piece_on() : Result<void>(); }
  Result<void> end_segment();

  /// Passes on all groups that are complete. Which groups these are depends only on the calls made
  /// so far, not on the speed of the threads.
  Result<void> catch_up();
  /// Ends the threads and frees all memory. No other function may be called after it.
  void let_go();

 private:
  using Tasks = OrderedTasks<SegmentPiece, EncodedGroup>;

  bool piece_is_full() const;
  Result<void> pass_piece_on();
  Result<void> take_finished(Tasks::Wait wait);
  Result<void> pass_on_done();
  CodecTrial trial() const;

  const Schema* schema_;
  const WriteOptions* options_;
  Receiver receive_;
  SegmentStart start_;
  SegmentPiece piece_;
  bool segment_begun_ = false;  // true if at least one piece of the current segment has been passed
                                // on for encoding
  std::unique_ptr<ChoosingEncoder> encoder_;  // used without threads
  std::vector<EncodedGroup> done_;
  std::unique_ptr<Tasks> tasks_;  // used with threads
};

}  // namespace shm
