// CompactNumbers: a long list of numbers. Each number needs 4 bytes while all numbers are below
// 2^32, otherwise 8 bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace shm {

class CompactNumbers {
 public:
  CompactNumbers() = default;
  /// Returns the list 0, 1, ..., count - 1. Does not reserve memory for more numbers.
  static CompactNumbers counted(std::size_t count) {
    CompactNumbers numbers = zeros(count);
    for (std::size_t i = 0; i < count; ++i) numbers.set(i, i);
    return numbers;
  }
  /// Returns a list of `count` zeros, which the caller will replace with numbers below `count`.
  static CompactNumbers zeros(std::size_t count) {
    CompactNumbers numbers;
    numbers.is_wide_ = count > kMostNarrow;
    if (numbers.is_wide_)
      numbers.wide_.resize(count);
    else
      numbers.narrow_.resize(count);
    return numbers;
  }

  std::size_t size() const { return is_wide_ ? wide_.size() : narrow_.size(); }
  std::size_t capacity() const { return is_wide_ ? wide_.capacity() : narrow_.capacity(); }
  void reserve(std::size_t count) {
    if (is_wide_)
      wide_.reserve(count);
    else
      narrow_.reserve(count);
  }
  /// Access the number at index `i`. Precondition: i < size().
  std::uint64_t operator[](std::size_t i) const { return is_wide_ ? wide_[i] : narrow_[i]; }
  void set(std::size_t i, std::uint64_t number) {
    if (number > kMostNarrow) widen();
    if (is_wide_)
      wide_[i] = number;
    else
      narrow_[i] = static_cast<std::uint32_t>(number);
  }
  void push_back(std::uint64_t number) {
    if (number > kMostNarrow) widen();
    if (is_wide_)
      wide_.push_back(number);
    else
      narrow_.push_back(static_cast<std::uint32_t>(number));
  }

 private:
  static constexpr std::uint64_t kMostNarrow = std::numeric_limits<std::uint32_t>::max();
  void widen() {
    if (is_wide_) return;
    is_wide_ = true;
    wide_.assign(narrow_.begin(), narrow_.end());
    narrow_ = std::vector<std::uint32_t>();
  }

  // True if all numbers are in wide_, because at least one number needs 64 bits; otherwise all
  // numbers are in narrow_.
  bool is_wide_ = false;
  std::vector<std::uint32_t> narrow_;
  std::vector<std::uint64_t> wide_;
};

}  // namespace shm
