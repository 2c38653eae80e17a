#include "steps/step_store.h"

#include <algorithm>
#include <utility>

#include "base/errors.h"

namespace shm {
namespace {

/// Largest size in bytes of the space outside of memory.
constexpr std::uint64_t kMostSpace = std::uint64_t{1} << 62;

}  // namespace

/// Reserves a range of the space, which is created if necessary. Returns the offset of the range.
Result<std::uint64_t> StepStore::allocate(std::uint64_t bytes) {
  if (!space_) {
    if (!kept_.make_space)
      return over_limit("the values of earlier steps need more memory than the limit", "steps");
    auto space = kept_.make_space();
    if (!space) return space.error();
    space_ = std::move(*space);
  }
  if (bytes > kMostSpace - space_end_)
    return over_limit("the values of earlier steps are too large", "steps");
  return std::exchange(space_end_, space_end_ + bytes);
}

StepBytes::StepBytes(StepStore& store, std::uint64_t capacity)
    : store_(&store), capacity_(capacity), in_memory_(capacity <= store.memory_left_) {
  if (in_memory_) store_->memory_left_ -= capacity_;
}

StepBytes::StepBytes(StepBytes&& other) noexcept
    : store_(std::exchange(other.store_, nullptr)),
      capacity_(other.capacity_),
      size_(other.size_),
      in_memory_(other.in_memory_),
      bytes_(std::move(other.bytes_)),
      begin_(other.begin_) {}

StepBytes::~StepBytes() {
  if (store_ != nullptr && in_memory_) store_->memory_left_ += capacity_;
}

Result<void> StepBytes::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  if (offset > capacity_ || bytes.size() > capacity_ - offset)
    return corrupt("steps of an array have different numbers of values", "step values");
  size_ = std::max(size_, offset + bytes.size());
  if (in_memory_) {
    if (bytes_.size() < size_) bytes_.resize(static_cast<std::size_t>(size_));
    std::copy(bytes.begin(), bytes.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(offset));
    return {};
  }
  if (!begin_) {
    const auto begin = store_->allocate(capacity_);
    if (!begin) return begin.error();
    begin_ = *begin;
  }
  return store_->space_->write(*begin_ + offset, bytes);
}

Result<std::span<const std::byte>> StepBytes::read(std::uint64_t offset, std::size_t count) {
  if (in_memory_)
    return std::span(std::as_const(bytes_)).subspan(static_cast<std::size_t>(offset), count);
  bytes_.resize(count);
  if (auto status = store_->space_->read(*begin_ + offset, bytes_); !status) return status.error();
  return std::span(std::as_const(bytes_));
}

}  // namespace shm
