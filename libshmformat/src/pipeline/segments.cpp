#include "pipeline/segments.h"

#include <algorithm>
#include <utility>

#include "base/threads.h"

namespace shm {
namespace {

// Minimum number of cells of a segment that ends because of the restart budget (the largest share
// of vertices that may be stored twice). If a new element block begins, which is a better place for
// a cut, half of this number suffices.
constexpr std::uint64_t kLeastSegmentCells = 131072;

// A piece is passed on for encoding when it reaches one of these sizes. The sizes are so large that
// passing a piece to another thread costs comparatively little time, but small compared with the
// size of a group.
constexpr std::size_t kPieceCells = 1024;
constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

// Limit per thread, in bytes, on the pieces that wait to be encoded. The same limit applies to the
// groups that wait to be passed on.
constexpr std::size_t kWaitingBytes = std::size_t{64} << 20;

// Until the pieces of the first segment exceed this size in bytes, which is a few hundred cells,
// they are coded without threads.
constexpr std::size_t kAlonePieceBytes = std::size_t{32} << 10;

using Tasks = OrderedTasks<SegmentPiece, EncodedGroup>;

class SegmentTask final : public Tasks::Task {
 public:
  SegmentTask(const Schema& schema, std::uint32_t group_cells, const CodecTrial& trial,
              const SegmentStart& start)
      : schema_(&schema), group_cells_(group_cells), trial_(trial), start_(start) {}

  Result<void> take(SegmentPiece& piece, const Tasks::Emit& emit) override {
    if (!encoder_)  // create the encoder here, because waiting tasks do not need one yet
      encoder_ = std::make_unique<ChoosingEncoder>(*schema_, group_cells_, trial_, start_);
    auto result = encoder_->take(piece, done_);
    emit_done(emit);
    return result;
  }
  Result<void> end(const Tasks::Emit& emit) override {
    auto result = encoder_->end(done_);
    emit_done(emit);
    encoder_.reset();
    return result;
  }

 private:
  void emit_done(const Tasks::Emit& emit) {
    for (EncodedGroup& group : done_) {
      const std::size_t bytes = group.bytes();
      emit(std::move(group), bytes);
    }
    done_.clear();
  }

  const Schema* schema_;
  std::uint32_t group_cells_;
  CodecTrial trial_;
  SegmentStart start_;
  std::unique_ptr<ChoosingEncoder> encoder_;
  std::vector<EncodedGroup> done_;
};

}  // namespace

bool SegmentCutter::is_due(std::uint32_t block, std::uint64_t cell) const {
  if (cells_ == 0) return false;
  const std::vector<std::uint64_t>& starts = options_->segment_starts;
  if (!starts.empty()) return std::binary_search(starts.begin(), starts.end(), cell);
  if (options_->segment_cells > 0) return cells_ >= options_->segment_cells;
  if (!(options_->restart_budget > 0)) return false;
  const std::uint64_t least = block != block_ ? kLeastSegmentCells / 2 : kLeastSegmentCells;
  return cells_ >= least &&
         static_cast<double>(live_) <= options_->restart_budget * static_cast<double>(introduced_);
}

SegmentQueue::SegmentQueue(const Schema& schema, const WriteOptions& options, Receiver receive)
    : schema_(&schema), options_(&options), receive_(std::move(receive)) {
  if (options.threads == 1) return;
  const unsigned threads = thread_count(options.threads);
  if (threads > 1)
    tasks_ = std::make_unique<Tasks>(threads, Tasks::Limits{.in = threads * kWaitingBytes,
                                                            .out = threads * kWaitingBytes,
                                                            .alone = kAlonePieceBytes});
}

/// Returns the codecs that are tried on the current segment.
CodecTrial SegmentQueue::trial() const {
  const auto& codecs = options_->segment_connectivity;
  const ConnectivityCodec codec =
      codecs.empty() ? options_->connectivity
                     : codecs[std::min<std::size_t>(start_.segment, codecs.size() - 1)];
  CodecTrial trial = trial_for(*schema_, codec, options_->level);
  trial.threads = thread_count(options_->threads);
  trial.with_order = schema_->order != Order::keep || options_->coding_order != nullptr ||
                     (options_->digest && has_steps(*schema_));
  trial.with_digest = options_->digest;
  return trial;
}

bool SegmentQueue::piece_is_full() const {
  return piece_.cells.size() >= kPieceCells || 4 * piece_.nodes.size() >= kPieceBytes ||
         piece_.vertex_values.size() + piece_.cell_data.size() >= kPieceBytes;
}

Result<void> SegmentQueue::pass_piece_on() {
  if (piece_.empty()) return {};
  const bool begins = !std::exchange(segment_begun_, true);
  if (tasks_) {
    if (begins)
      tasks_->begin(
          std::make_unique<SegmentTask>(*schema_, options_->group_cells, trial(), start_));
    while (!tasks_->has_room())
      if (auto status = take_finished(Tasks::Wait::for_output_or_room); !status) return status;
    const std::size_t bytes = piece_.bytes();
    tasks_->push(std::move(piece_), bytes);
    piece_ = tasks_->spare();
    piece_.clear();
    return take_finished(Tasks::Wait::no);
  }
  if (begins)
    encoder_ = std::make_unique<ChoosingEncoder>(*schema_, options_->group_cells, trial(), start_);
  const auto status = encoder_->take(piece_, done_);
  piece_.clear();
  return status ? pass_on_done() : status;
}

Result<void> SegmentQueue::end_segment() {
  if (auto status = pass_piece_on(); !status) return status;
  if (!std::exchange(segment_begun_, false)) return {};
  if (tasks_) {
    tasks_->end();
    return {};
  }
  if (auto status = encoder_->end(done_); !status) return status;
  return pass_on_done();
}

Result<void> SegmentQueue::catch_up() {
  if (auto status = pass_piece_on(); !status) return status;
  return tasks_ ? take_finished(Tasks::Wait::for_output) : Result<void>();
}

/// Passes the groups that threads have finished to the receiver. If `wait` is for_output, first
/// waits until the threads have coded all pieces that they were given.
Result<void> SegmentQueue::take_finished(Tasks::Wait wait) {
  while (true) {
    auto group = tasks_->next(wait);
    if (!group) return group.error();
    if (!*group) return {};
    if (auto status = receive_(**group); !status) return status;
    if (wait == Tasks::Wait::for_output_or_room) wait = Tasks::Wait::no;
  }
}

Result<void> SegmentQueue::pass_on_done() {
  for (EncodedGroup& group : done_)
    if (auto status = receive_(group); !status) return status;
  done_.clear();
  return {};
}

void SegmentQueue::let_go() {
  piece_ = SegmentPiece();
  encoder_.reset();
  tasks_.reset();
}

}  // namespace shm
