// NumberSet: a set of numbers. Dense numbers, such as those of a whole mesh, need one bit per
// number. The memory never exceeds 32 bytes per number plus 256 KiB.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace shm {

class NumberSet {
 public:
  void add(std::uint64_t number) {
    ++size_;
    const std::uint64_t word = number / 64;
    if (word >= size_ + kWords) {
      far_.push_back(number);
      return;
    }
    if (word >= bits_.size()) bits_.resize(static_cast<std::size_t>(word) + 1);
    std::uint64_t& bits = bits_[static_cast<std::size_t>(word)];
    const std::uint64_t bit = std::uint64_t{1} << (number % 64);
    if ((bits & bit) != 0 && !twice_) twice_ = number;
    bits |= bit;
  }
  /// Returns how many numbers have been added.
  std::uint64_t size() const { return size_; }
  /// Returns a number that has been added twice, or nullopt if no such number exists.
  std::optional<std::uint64_t> twice() {
    std::sort(far_.begin(), far_.end());
    const auto again = std::adjacent_find(far_.begin(), far_.end());
    if (!twice_ && again != far_.end()) twice_ = *again;
    for (const std::uint64_t number : far_) {
      const std::uint64_t word = number / 64;
      if (!twice_ && word < bits_.size() &&
          (bits_[static_cast<std::size_t>(word)] >> (number % 64) & 1) != 0)
        twice_ = number;
    }
    return twice_;
  }
  /// Returns all numbers in ascending order. Precondition: twice() was called and returned nullopt.
  std::vector<std::uint64_t> numbers() const {
    std::vector<std::uint64_t> numbers;
    numbers.reserve(static_cast<std::size_t>(size_));
    for (std::size_t word = 0; word < bits_.size(); ++word)
      for (std::uint64_t left = bits_[word]; left != 0; left &= left - 1)
        numbers.push_back(std::uint64_t{word} * 64 +
                          static_cast<std::uint64_t>(std::countr_zero(left)));
    const auto middle = static_cast<std::ptrdiff_t>(numbers.size());
    numbers.insert(numbers.end(), far_.begin(), far_.end());
    std::inplace_merge(numbers.begin(), numbers.begin() + middle, numbers.end());
    return numbers;
  }

 private:
  static constexpr std::uint64_t kWords = std::uint64_t{1} << 14;

  std::vector<std::uint64_t> bits_;
  std::vector<std::uint64_t> far_;  // numbers that are too large for bits_
  std::uint64_t size_ = 0;
  std::optional<std::uint64_t> twice_;
};

}  // namespace shm
