// CompactNumbers: a long list of numbers, 4 bytes each while all are below 2^32, else 8.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace shm {

class CompactNumbers {
 public:
  CompactNumbers() = default;
  /// 0, 1 and so on. Room for all that come later is the caller's to make.
  static CompactNumbers counted(std::size_t count) {
    CompactNumbers numbers = zeros(count);
    for (std::size_t i = 0; i < count; ++i) numbers.set(i, i);
    return numbers;
  }
  /// `count` zeros, to be set to numbers below `count`.
  static CompactNumbers zeros(std::size_t count) {
    CompactNumbers numbers;
    if (count <= kNarrow)
      numbers.narrow_.resize(count);
    else
      numbers.wide_.resize(count);
    return numbers;
  }

  std::size_t size() const { return wide_.empty() ? narrow_.size() : wide_.size(); }
  std::size_t capacity() const { return wide_.empty() ? narrow_.capacity() : wide_.capacity(); }
  void reserve(std::size_t count) {
    if (wide_.empty())
      narrow_.reserve(count);
    else
      wide_.reserve(count);
  }
  /// Must hold for both: i < size().
  std::uint64_t operator[](std::size_t i) const { return wide_.empty() ? narrow_[i] : wide_[i]; }
  void set(std::size_t i, std::uint64_t number) {
    if (number > kNarrow) widen();
    if (wide_.empty())
      narrow_[i] = static_cast<std::uint32_t>(number);
    else
      wide_[i] = number;
  }
  void push_back(std::uint64_t number) {
    if (number > kNarrow) widen();
    if (wide_.empty())
      narrow_.push_back(static_cast<std::uint32_t>(number));
    else
      wide_.push_back(number);
  }

 private:
  static constexpr std::uint64_t kNarrow = std::numeric_limits<std::uint32_t>::max();
  void widen() {
    if (!wide_.empty()) return;
    wide_.assign(narrow_.begin(), narrow_.end());
    narrow_ = {};
  }
  std::vector<std::uint32_t> narrow_;
  std::vector<std::uint64_t> wide_;  // all of them, once one needs it
};

}  // namespace shm
