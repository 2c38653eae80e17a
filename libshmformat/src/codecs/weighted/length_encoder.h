// Length encoder: encodes the bit lengths of residuals and their low bits, as length_coder.h
// describes.
// spec: "Weighted values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/binary.h"

namespace shm {

/// A length in its context.
struct LengthInContext {
  std::uint8_t context = 0, length = 0;
};

/// Writes the tables of frequencies and the coded lengths. Precondition: there are lengths.
[[gnu::cold]] void put_lengths(ByteWriter& out, std::span<const LengthInContext> lengths);

/// Writes numbers of 0 to 64 bits, low bits first.
class BitWriter {
 public:
  void put(std::uint64_t bits, std::uint32_t count) {
    if (count == 0) return;
    held_ |= bits << used_;
    if (used_ + count >= 64) {
      flush(8);
      held_ = used_ == 0 ? 0 : bits >> (64 - used_);
      used_ = used_ + count - 64;
    } else {
      used_ += count;
    }
  }
  /// Ends the stream. Returns the bytes.
  std::vector<std::byte> finish() {
    flush((used_ + 7) / 8);
    return std::move(bytes_);
  }

 private:
  void flush(std::uint32_t count) {
    for (std::uint32_t b = 0; b < count; ++b)
      bytes_.push_back(static_cast<std::byte>(held_ >> 8 * b));
  }
  std::vector<std::byte> bytes_;
  std::uint64_t held_ = 0;
  std::uint32_t used_ = 0;
};

}  // namespace shm
