// NumberTable: one 64-bit number for each vertex or cell, zero at first, read and written anywhere.
// Small tables live in memory, larger ones in the spool.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spool.h"

namespace shm::converters {

class NumberTable {
 public:
  NumberTable(Spool& spool, std::uint64_t size)
      : size_(size), paged_(spool, sizeof(std::uint64_t)) {
    if (size <= kResidentNumbers) resident_.resize(size);
  }
  std::uint64_t size() const { return size_; }
  std::uint64_t get(std::uint64_t index) {
    return resident_.empty() ? paged_.get<std::uint64_t>(index) : resident_[index];
  }
  void set(std::uint64_t index, std::uint64_t value) {
    if (resident_.empty())
      paged_.set(index, value);
    else
      resident_[index] = value;
  }

 private:
  static constexpr std::uint64_t kResidentNumbers = std::uint64_t{1} << 22;  // 32 MiB

  std::uint64_t size_;
  std::vector<std::uint64_t> resident_;
  PagedArray paged_;
};

}  // namespace shm::converters
