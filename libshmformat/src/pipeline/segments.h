// Segments of the encoder.
//   SegmentCutter  decides where segments end
//   SegmentQueue   encodes segments, and passes their groups on in file order
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

/// Decides where segments end. The decision depends only on counts of added vertices and cells, so
/// that the same calls produce the same bytes. Groups end within the segment encoder
/// (codecs/shared/segment_encoder.h).
class SegmentCutter {
 public:
  /// `options` must outlive the cutter.
  explicit SegmentCutter(const WriteOptions& options) : options_(&options) {}

  /// Returns true if a segment begins before the next cell, which belongs to `block` and has number
  /// `cell`.
  bool is_due(std::uint32_t block, std::uint64_t cell) const;
  void begin_segment() { cells_ = introduced_ = 0; }

  /// Counts a cell that introduces `introduced` vertices and ends `ended` vertices.
  void add_cell(std::uint32_t block, std::uint64_t introduced, std::uint64_t ended) {
    block_ = block;
    ++cells_;
    introduced_ += introduced;
    live_ += introduced;
    live_ -= ended;
  }
  /// Counts a vertex that an earlier part has introduced.
  void add_import() { ++live_; }

 private:
  const WriteOptions* options_;
  std::uint64_t live_ = 0;   // number of vertices that a cell has used and that are not finalized
  std::uint32_t block_ = 0;  // block of the last cell
  // Counts of the current segment
  std::uint64_t cells_ = 0;  // number of cells added, both coded and waiting
  std::uint64_t introduced_ =
      0;  // number of vertices that cells of the segment use and no earlier cell has used
};

/// Encodes segments, and passes their groups on in file order. With several threads, a segment is
/// encoded while later segments begin; without threads, in the calls that add its cells. The groups
/// and their order do not depend on the number of threads.
class SegmentQueue {
 public:
  using Receiver = std::function<Result<void>(EncodedGroup&)>;

  /// `schema` and `options` must outlive the queue. `receive` is called in the caller's thread.
  SegmentQueue(const Schema& schema, const WriteOptions& options, Receiver receive);

  /// Begins a segment. The previous segment, if there is one, must have ended.
  void begin_segment(const SegmentStart& start) { start_ = start; }
  /// Last cells of the current segment, which are not being encoded yet. The caller adds cells and
  /// calls added() after each cell.
  SegmentPiece& piece() { return piece_; }
  Result<void> added() { return piece_is_full() ? pass_piece_on() : Result<void>(); }
  Result<void> end_segment();

  /// Passes on all groups that are complete. Only the calls so far determine which groups these
  /// are, not the speed of threads.
  Result<void> catch_up();
  /// Ends the threads and frees all memory. Must be the last call.
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
  bool segment_begun_ = false;  // true: a piece of the current segment has been passed on
  std::unique_ptr<ChoosingEncoder> encoder_;  // used without threads
  std::vector<EncodedGroup> done_;
  std::unique_ptr<Tasks> tasks_;  // used with threads
};

}  // namespace shm
