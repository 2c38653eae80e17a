// A file in memory that counts the bytes that are read of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/io.h"

namespace shm {

class CountedSource final : public RandomSource {
 public:
  explicit CountedSource(std::span<const std::byte> file) : source_(file) {}
  std::uint64_t size() const override { return source_.size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    bytes += into.size();
    return source_.read_at(offset, into);
  }
  std::uint64_t bytes = 0;

 private:
  MemoryRandomSource source_;
};

}  // namespace shm
