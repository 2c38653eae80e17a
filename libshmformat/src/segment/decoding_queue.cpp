#include "segment/decoding_queue.h"

#include <utility>

#include "bytes/binary.h"

namespace shm {
namespace {

std::size_t bytes_of(const MeshBlock& block) {
  std::size_t bytes = block.xyz.size() + block.imported.size() + 4 * block.cell_blocks.size();
  for (const auto* numbers : {&block.vertex_numbers, &block.cell_numbers, &block.corner_begin,
                              &block.corners, &block.last_use, &block.vertices_before_cell})
    bytes += 8 * numbers->size();
  for (const auto& values : block.arrays) bytes += values.size();
  return bytes;
}

}  // namespace

class DecodingQueue::SegmentTask final : public DecodingQueue::Tasks::Task {
 public:
  SegmentTask(const DecodingQueue& queue, std::size_t segment, std::uint32_t number,
              DecodedParts parts)
      : check_(queue.check_),
        segment_(segment),
        decoder_(*queue.schema_, queue.limits_, number, std::move(parts)) {}

  Result<void> take(container::GroupChunk& chunk, const Tasks::Emit& emit) override {
    const std::uint64_t group = chunk.number;
    if (auto good = decoder_.begin_group(std::move(chunk)); !good) return good;
    if (check_)
      if (auto good = check_(group, decoder_.group()); !good) return good;
    while (decoder_.in_group()) {
      auto block = decoder_.next_block();
      if (!block) return block.error();
      const std::size_t bytes = bytes_of(block->mesh);
      emit({segment_, group, std::move(*block), {}}, bytes);
    }
    return {};
  }
  Result<void> end(const Tasks::Emit& emit) override {
    auto alive = decoder_.alive();
    const std::size_t bytes = alive.size() * 8;
    emit({segment_, 0, std::nullopt, std::move(alive)}, bytes);
    return {};
  }

 private:
  const Check& check_;
  std::size_t segment_;
  SegmentDecoder decoder_;
};

DecodingQueue::DecodingQueue(const Schema& schema, const ReadLimits& limits,
                             const ReadOptions& options, Check check)
    : schema_(&schema), limits_(limits), check_(std::move(check)) {
  if (options.threads == 1) return;
  const unsigned threads = thread_count(options.threads);
  const std::size_t ahead = to_size(options.max_ahead_bytes);
  if (threads > 1) tasks_ = std::make_unique<Tasks>(threads, ahead / 4, ahead - ahead / 4);
  if (tasks_ && !tasks_->has_threads()) tasks_.reset();
}

void DecodingQueue::begin_segment(std::size_t segment, std::uint32_t number, DecodedParts parts) {
  if (tasks_) {
    tasks_->begin(std::make_unique<SegmentTask>(*this, segment, number, std::move(parts)));
    return;
  }
  leave_segment();
  segment_.reset(new Segment{segment, {*schema_, limits_, number, std::move(parts)}});
}

void DecodingQueue::leave_segment() {
  if (segment_) left_ = Output{segment_->segment, 0, std::nullopt, segment_->decoder.alive()};
  segment_.reset();
}

bool DecodingQueue::wants_group() const { return tasks_ ? tasks_->has_room() : !is_busy(); }

Result<void> DecodingQueue::add_group(container::GroupChunk chunk) {
  if (tasks_) {
    const std::size_t bytes = chunk.payload.size();
    tasks_->push(std::move(chunk), bytes);
    return {};
  }
  segment_->group = chunk.number;
  auto good = segment_->decoder.begin_group(std::move(chunk));
  if (good && check_) good = check_(segment_->group, segment_->decoder.group());
  if (!good) segment_.reset();
  return good;
}

void DecodingQueue::end() {
  if (tasks_)
    tasks_->end();
  else
    leave_segment();
}

bool DecodingQueue::is_busy() const {
  if (tasks_) return !tasks_->is_idle();
  return left_ || (segment_ && segment_->decoder.in_group());
}

Result<std::optional<DecodingQueue::Output>> DecodingQueue::next(Wait wait) {
  if (tasks_) return tasks_->next(wait);
  if (left_) return std::exchange(left_, std::nullopt);
  if (!segment_ || !segment_->decoder.in_group()) return std::optional<Output>();
  auto block = segment_->decoder.next_block();
  if (!block) return block.error();
  return std::optional<Output>({segment_->segment, segment_->group, std::move(*block), {}});
}

}  // namespace shm
