// CountedSource: passes reads on and counts their bytes.
#pragma once

#include <cstddef>
#include <cstdint>
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
    return source_->read_at(offset, into);
  }
  std::uint64_t bytes = 0;

 private:
  RandomSource* source_;
};

}  // namespace shm::converters
