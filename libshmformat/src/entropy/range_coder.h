// Binary range coder: turns decisions with known odds into bytes and back.
//
// The encoder keeps an interval [low, low + range) inside 32 bits and narrows it by each
// decision; bytes leave at the top when they can no longer change. `low` may overflow into a
// carry, so the last byte that is not yet certain is held back together with the run of 0xFF
// bytes behind it (the scheme of LZMA). The decoder follows with `code = bytes - low`.
//
// What surprises: (1) the very first byte of the carry scheme is always zero and is not stored;
// (2) the end is not marked: the encoder drops trailing zero bytes and the decoder reads zeros
// past the end, as many as it likes; counts are known from elsewhere;
// (3) encoder and decoder have the same calls, `bit(model, value)` and `raw(value, count)`, where
// the decoder ignores what it is given: a coder written once as a template runs both ways, so the
// two directions cannot drift apart.
// spec: "Range coder"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "entropy/adaptive_bit.h"

namespace shm {

inline constexpr std::uint32_t kRangeTop = std::uint32_t{1} << 24;

class RangeEncoder {
 public:
  static constexpr bool kDecodes = false;
  static constexpr bool kMixes = false;
  using Bit = AdaptiveBit;

  bool bit(AdaptiveBit& model, bool value) {
    decide(model.probability_of_one(), value);
    model.update(value);
    return value;
  }

  /// A decision whose odds somebody else knows: `probability` of one, 1 to 65535 of 65536.
  bool decide(std::uint32_t probability, bool value) {
    const std::uint32_t bound = (range_ >> 16) * probability;
    if (value) {
      range_ = bound;
    } else {
      low_ += bound;
      range_ -= bound;
    }
    while (range_ < kRangeTop) {
      range_ <<= 8;
      shift_low();
    }
    return value;
  }

  /// The low `count` bits of value, 0..64, evenly odd; the rest must be zero.
  std::uint64_t raw(std::uint64_t value, int count) {
    while (count > 16) {
      count -= 16;
      raw_part(static_cast<std::uint32_t>(value >> count) & 0xffff, 16);
    }
    if (count > 0) raw_part(static_cast<std::uint32_t>(value) & ((1u << count) - 1), count);
    return value;
  }

  /// Ends the stream and hands it out; the encoder is ready for the next one.
  std::vector<std::byte> finish() {
    // Any number in [low, low + range) will do; range >= 2^24, so one ends in 24 zero bits.
    low_ = (low_ + kRangeTop - 1) & ~std::uint64_t{kRangeTop - 1};
    for (int i = 0; i < 5; ++i) shift_low();
    std::vector<std::byte> out = std::move(bytes_);
    while (!out.empty() && out.back() == std::byte{0}) out.pop_back();
    *this = RangeEncoder();
    return out;
  }

 private:
  void raw_part(std::uint32_t value, int count) {
    range_ >>= count;
    low_ += static_cast<std::uint64_t>(value) * range_;
    while (range_ < kRangeTop) {
      range_ <<= 8;
      shift_low();
    }
  }
  void shift_low() {
    if (low_ < 0xff000000u || low_ > 0xffffffffu) {
      const auto carry = static_cast<std::uint8_t>(low_ >> 32);
      if (!first_) bytes_.push_back(static_cast<std::byte>(held_ + carry));
      first_ = false;
      for (; pending_ > 0; --pending_) bytes_.push_back(static_cast<std::byte>(0xff + carry));
      held_ = static_cast<std::uint8_t>(low_ >> 24);
    } else {
      ++pending_;
    }
    low_ = (low_ & 0x00ffffffu) << 8;
  }

  std::vector<std::byte> bytes_;
  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xffffffffu;
  std::uint64_t pending_ = 0;  // bytes 0xFF behind held_
  std::uint8_t held_ = 0;
  bool first_ = true;
};

class RangeDecoder {
 public:
  static constexpr bool kDecodes = true;
  static constexpr bool kMixes = false;
  using Bit = AdaptiveBit;

  RangeDecoder() = default;
  /// `bytes` are borrowed.
  explicit RangeDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next_byte();
  }

  bool bit(AdaptiveBit& model, bool = false) {
    const bool value = decide(model.probability_of_one());
    model.update(value);
    return value;
  }

  bool decide(std::uint32_t probability, bool = false) {
    const std::uint32_t bound = (range_ >> 16) * probability;
    const bool value = code_ < bound;
    if (value) {
      range_ = bound;
    } else {
      code_ -= bound;
      range_ -= bound;
    }
    while (range_ < kRangeTop) {
      range_ <<= 8;
      code_ = code_ << 8 | next_byte();
    }
    return value;
  }

  std::uint64_t raw(std::uint64_t, int count) {
    std::uint64_t value = 0;
    while (count > 16) {
      count -= 16;
      value = value << 16 | raw_part(16);
    }
    return count > 0 ? value << count | raw_part(count) : value;
  }

 private:
  std::uint32_t raw_part(int count) {
    range_ >>= count;
    std::uint32_t value = code_ / range_;
    if (value >> count != 0) value = (1u << count) - 1;  // only damaged bytes get here
    code_ -= value * range_;
    while (range_ < kRangeTop) {
      range_ <<= 8;
      code_ = code_ << 8 | next_byte();
    }
    return value;
  }
  std::uint32_t next_byte() {
    return at_ < bytes_.size() ? std::to_integer<std::uint32_t>(bytes_[at_++]) : 0;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::uint32_t range_ = 0xffffffffu;
  std::uint32_t code_ = 0;
};

}  // namespace shm
