// SegmentQueue: encodes segments, and passes their groups on in file order. With several threads, a
// segment is encoded while later segments begin; without threads, in the calls that add its cells.
// The groups and their order do not depend on the number of threads.
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
