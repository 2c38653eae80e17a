// LenientSource: another source in which unreadable sectors read as zeros, so that lost sectors are
// handled like any other damage.
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
    for (std::size_t at = 0; at < into.size();) {
      const auto piece = into.subspan(
          at, std::min<std::size_t>(into.size() - at, kSectorBytes - (offset + at) % kSectorBytes));
      if (!source_->read_at(offset + at, piece))
        std::fill(piece.begin(), piece.end(), std::byte{0});
      at += piece.size();
    }
    return {};
  }

 private:
  RandomSource* source_;
};

}  // namespace shm::converters
