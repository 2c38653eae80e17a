// NumberTable: a number for each vertex or cell, zero at first, read and written anywhere, in the
// spool. Numbers take 4 bytes each where none can be larger than that.
#pragma once

#include <cstdint>
#include <limits>

#include "base/spool.h"

namespace shm::converters {

class NumberTable {
 public:
  static constexpr std::uint64_t kAnyNumber = std::numeric_limits<std::uint64_t>::max();

  // `most`: the largest number that will be written.
  NumberTable(Spool& spool, std::uint64_t size, std::uint64_t most = kAnyNumber)
      : size_(size),
        narrow_(most <= std::numeric_limits<std::uint32_t>::max()),
        paged_(spool, narrow_ ? sizeof(std::uint32_t) : sizeof(std::uint64_t)) {}
  std::uint64_t size() const { return size_; }
  std::uint64_t get(std::uint64_t index) {
    return narrow_ ? paged_.get<std::uint32_t>(index) : paged_.get<std::uint64_t>(index);
  }
  void set(std::uint64_t index, std::uint64_t value) {
    if (narrow_)
      paged_.set(index, static_cast<std::uint32_t>(value));
    else
      paged_.set(index, value);
  }

 private:
  std::uint64_t size_;
  bool narrow_;
  PagedArray paged_;
};

}  // namespace shm::converters
