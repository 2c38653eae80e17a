// NumberTable: one 64-bit number for each vertex or cell, zero at first, read and written anywhere,
// in the spool.
#pragma once

#include <cstdint>

#include "spool.h"

namespace shm::converters {

class NumberTable {
 public:
  NumberTable(Spool& spool, std::uint64_t size)
      : size_(size), paged_(spool, sizeof(std::uint64_t)) {}
  std::uint64_t size() const { return size_; }
  std::uint64_t get(std::uint64_t index) { return paged_.get<std::uint64_t>(index); }
  void set(std::uint64_t index, std::uint64_t value) { paged_.set(index, value); }

 private:
  std::uint64_t size_;
  PagedArray paged_;
};

}  // namespace shm::converters
