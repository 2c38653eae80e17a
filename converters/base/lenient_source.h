// LenientSource: forwards reads to another source, but returns zeros for sectors that cannot be
// read, so that lost sectors are handled like any other damage.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shm/io.h"

namespace shm::converters {

class LenientSource final : public RandomSource {
 public:
  // `source` is borrowed.
  explicit LenientSource(RandomSource& source) : source_(&source) {}
  std::uint64_t size() const override { return source_->size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    constexpr std::size_t kSectorBytes = 4096;
    if (source_->read_at(offset, into)) return {};
    for (std::size_t position = 0; position < into.size();) {
      const auto piece = into.subspan(
          position, std::min<std::size_t>(into.size() - position,
                                          kSectorBytes - (offset + position) % kSectorBytes));
      if (!source_->read_at(offset + position, piece))
        std::fill(piece.begin(), piece.end(), std::byte{0});
      position += piece.size();
    }
    return {};
  }

 private:
  RandomSource* source_;
};

}  // namespace shm::converters
