// Length coder: decodes the bit lengths of residuals, which are coded with static models, and their
// low bits. The encoder (length_encoder.h) counts the lengths in each context, merges contexts with
// similar counts, and writes one table of frequencies for each merged context. The lengths are
// coded by rANS (range asymmetric numeral systems).
//
// A context is the mean length of the residuals of near elements. There are two lists of such
// contexts: kPlainLengths if no near element has the residual 0, and kSomeZeroLengths if some have.
// Two other contexts are kAllZeroLengths, if all near elements have the residual 0, and
// kMatchedLengths, if a near element is a matched value.
// spec: "Weighted values"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/binary.h"

namespace shm {

/// Number of different lengths: 0 to 64 bits, and kMatchedLength, which means that the value is the
/// matched value. Frozen: part of the format.
inline constexpr std::uint32_t kMatchedLength = 65, kLengths = 66;
/// First context of each list, and number of contexts. Frozen: part of the format.
inline constexpr std::uint32_t kPlainLengths = 0, kSomeZeroLengths = 65, kAllZeroLengths = 130,
                               kMatchedLengths = 131, kLengthContexts = 132;

/// Decodes lengths, one after another.
class LengthDecoder {
 public:
  /// Reads the tables and the coded lengths from `in`. The decoder refers to the bytes of `in`.
  /// Returns false if the data is damaged.
  [[gnu::cold]] bool begin(ByteReader& in);
  /// Returns the next length. If the data is damaged, the result is any length, and at_end() later
  /// returns false.
  std::uint32_t next(std::uint32_t context) {
    const Table& table = tables_[map_[context]];
    const auto slot = static_cast<std::uint32_t>(state_) & (kScale - 1);
    const std::uint8_t length = table.length_at[slot];
    const Range range = table.ranges[length];
    state_ = range.frequency * (state_ >> kScaleBits) + slot - range.first;
    if (state_ < kLow) refill();
    return length;
  }
  /// Returns true if exactly the coded lengths have been decoded, without damage.
  bool at_end() const { return state_ == kLow && next_ == words_.size() && !is_short_; }

  static constexpr std::uint32_t kScaleBits = 12, kScale = 1u << kScaleBits;
  static constexpr std::uint64_t kLow = std::uint64_t{1} << 31;

 private:
  struct Range {
    std::uint16_t frequency = 0, first = 0;
  };
  struct Table {
    std::array<Range, kLengths> ranges{};
    std::array<std::uint8_t, kScale> length_at{};
  };
  void refill();

  std::vector<Table> tables_;
  std::array<std::uint8_t, kLengthContexts> map_{};
  std::span<const std::byte> words_;
  std::size_t next_ = 0;
  std::uint64_t state_ = kLow;
  bool is_short_ = false;
};

/// Reads numbers of 0 to 64 bits, low bits first.
class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> bytes = {}) : bytes_(bytes) {}
  /// Returns the next `count` bits, 0 to 64. Bits after the end are 0.
  std::uint64_t get(std::uint32_t count) {
    if (count > 56) {
      const std::uint64_t low = get(32);
      return low | get(count - 32) << 32;
    }
    const std::uint64_t value = peek() & ((std::uint64_t{1} << count) - 1);
    position_ += count;
    return value;
  }
  /// Returns true if all bytes have been read, and none after them. The unused bits of the last
  /// byte are 0.
  bool at_end() const {
    const std::uint64_t whole = std::uint64_t{bytes_.size()} * 8;
    if (position_ > whole || position_ + 8 <= whole) return false;
    return position_ == whole ||
           std::to_integer<unsigned>(bytes_.back()) >> (8 - (whole - position_)) == 0;
  }

 private:
  std::uint64_t peek() const {
    const std::uint64_t at = position_ / 8;
    std::uint64_t value = 0;
    if (at + 8 <= bytes_.size()) {
      copy_little_endian(reinterpret_cast<std::byte*>(&value), bytes_.data() + at, 1, 8);
    } else {
      for (std::uint64_t b = at; b < bytes_.size(); ++b)
        value |= std::to_integer<std::uint64_t>(bytes_[static_cast<std::size_t>(b)])
                 << 8 * (b - at);
    }
    return value >> position_ % 8;
  }
  std::span<const std::byte> bytes_;
  std::uint64_t position_ = 0;  // in bits
};

}  // namespace shm
