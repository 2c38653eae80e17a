// CountedSource: forwards reads to another source and counts two things: all bytes read, and the
// distinct bytes of the file that were read.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <span>

#include "shm/io.h"

namespace shm::converters {

class CountedSource final : public RandomSource {
 public:
  // `source` is borrowed.
  explicit CountedSource(RandomSource& source) : source_(&source) {}
  std::uint64_t size() const override { return source_->size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    bytes += into.size();
    touch(offset, offset + into.size());
    return source_->read_at(offset, into);
  }
  std::uint64_t bytes = 0;
  std::uint64_t distinct_bytes() const { return distinct_; }

 private:
  void touch(std::uint64_t begin, std::uint64_t end) {
    auto next = ranges_.upper_bound(begin);
    if (next != ranges_.begin() && std::prev(next)->second >= begin) begin = (--next)->first;
    for (; next != ranges_.end() && next->first <= end; next = ranges_.erase(next)) {
      end = std::max(end, next->second);
      distinct_ -= next->second - next->first;
    }
    ranges_.emplace(begin, end);
    distinct_ += end - begin;
  }

  RandomSource* source_;
  std::map<std::uint64_t, std::uint64_t> ranges_;  // byte ranges read so far; maps begin to end
  std::uint64_t distinct_ = 0;
};

}  // namespace shm::converters
