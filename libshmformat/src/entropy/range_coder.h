// Range coder: converts yes/no decisions to bytes, and bytes back to decisions.
//   AdaptiveBit                   the probability of a decision, estimated from its past outcomes
//   RangeEncoder, RangeDecoder    code decisions with known probabilities
//   SplitEncoder, SplitDecoder    do the same, and store unpredictable data in a separate part as
//                                 plain bits, which can be read very fast
//
// Encoders and decoders have the same functions: `bit(model, value)` and `raw(value, count)`. A
// decoder ignores the argument `value`. So a function template whose parameter is the coder works
// in both directions, and encoding and decoding cannot diverge.
// spec: "Adaptive bit", "Range coder", "Split streams"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/binary.h"

namespace shm {

/// Probability of a decision (22 bits) and a count of decisions (10 bits), stored in one word of 32
/// bits. The first decisions change the probability by 2/3, 2/5, ... of its error, later decisions
/// by about 1/kLimit of its error. Probabilities therefore adapt quickly at first, which suits
/// small meshes, and become stable later, which suits large meshes. Only integers are used, so that
/// the results are the same on all machines.
class AdaptiveBit {
 public:
  static constexpr std::uint32_t kLimit = 160;  // largest count. Frozen: part of the format

  /// Returns the probability of a 1 in units of 1/65536, from 1 to 65535.
  std::uint32_t probability_of_one() const {
    const std::uint32_t p = state_ >> 16;
    return p == 0 ? 1 : p;  // p is at most 65535, since state_ has 32 bits
  }
  /// Returns the number of decisions so far. The number is limited to kLimit or to the limit passed
  /// to update().
  std::uint32_t count() const { return state_ & 0x3ff; }
  /// Moves the probability towards the decision `one`. `limit`: largest count, at most kLimit. With
  /// a smaller limit, the model forgets faster.
  void update(bool one, std::uint32_t limit = kLimit) {
    const std::uint32_t seen = count();
    const auto p = static_cast<std::int32_t>(state_ >> 10);
    const std::int32_t target = one ? kOne : 0;
    const auto moved = static_cast<std::uint32_t>(
        p + static_cast<std::int32_t>((static_cast<std::int64_t>(target - p) * kRate[seen]) >> 16));
    state_ = moved << 10 | (seen < limit ? seen + 1 : seen);
  }

 private:
  static constexpr std::int32_t kOne = (1 << 22) - 1;
  static constexpr std::array<std::int32_t, kLimit + 1> kRate = [] {
    std::array<std::int32_t, kLimit + 1> rate{};
    for (std::uint32_t n = 0; n <= kLimit; ++n)
      rate[n] = static_cast<std::int32_t>(2 * 65536 / (2 * n + 3));  // 1 / (n + 1.5)
    return rate;
  }();

  std::uint32_t state_ = (std::uint32_t{1} << 31);
};

// The encoder stores an interval [low, low + range) of 32-bit numbers. Each decision narrows the
// interval. The top byte of `low` is written as soon as it can no longer change. An addition to
// `low` may overflow, and the carry then changes earlier bytes. The encoder therefore does not
// write the last byte that may change, nor the bytes 0xFF that follow this byte (this is the scheme
// of LZMA). The decoder stores `code`: the bytes read so far, minus `low`.
//
// Two details are easily missed. (1) The first byte that this scheme produces is always zero, and
// it is not stored. (2) The end of the stream is not marked. The encoder removes trailing zero
// bytes, and the decoder reads zeros after the end, without limit. The number of decisions must be
// known from other data.

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

  /// Codes a decision. `probability`: probability that the decision is `true`, in units of 1/65536,
  /// from 1 to 65535.
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

  /// Codes the low `count` (0..64) bits of `value` without a model. Precondition: the other bits
  /// are zero.
  std::uint64_t raw(std::uint64_t value, int count) {
    while (count > 16) {
      count -= 16;
      raw_part(static_cast<std::uint32_t>(value >> count) & 0xffff, 16);
    }
    if (count > 0) raw_part(static_cast<std::uint32_t>(value) & ((1u << count) - 1), count);
    return value;
  }

  /// Returns the number of bytes written so far. A few bytes that may still change are not counted.
  std::uint64_t size() const { return bytes_.size() + pending_; }

  /// Ends the stream and returns its bytes. The encoder is then ready for the next stream.
  std::vector<std::byte> finish() {
    // Any number in [low, low + range) identifies the interval. Since range >= 2^24, the interval
    // contains a number that ends with 24 zero bits.
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
  std::uint64_t pending_ = 0;  // number of 0xFF bytes that follow held_
  std::uint8_t held_ = 0;
  bool first_ = true;
};

class RangeDecoder {
 public:
  static constexpr bool kDecodes = true;
  static constexpr bool kMixes = false;
  using Bit = AdaptiveBit;

  RangeDecoder() = default;
  /// Begins to decode `bytes`, which must stay valid while they are decoded.
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
    if (value >> count != 0)
      value =
          (1u << count) - 1;  // a value with more than `count` bits occurs only in damaged streams
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

// Format of a split stream: a varint with the size in bytes of the range coder's data, then these
// data, then the plain bits. The low bits of a byte come first. After the end of a part, a reader
// reads zeros.

class SplitEncoder {
 public:
  static constexpr bool kDecodes = false;
  static constexpr bool kMixes = false;
  using Bit = AdaptiveBit;

  bool bit(AdaptiveBit& model, bool value) { return range_.bit(model, value); }
  bool decide(std::uint32_t probability, bool value) { return range_.decide(probability, value); }
  /// Stores the low `count` (0..64) bits of `value` as plain bits. Precondition: the other bits are
  /// zero.
  std::uint64_t raw(std::uint64_t value, int count) {
    if (count > 32) {
      put(value & 0xffffffffu, 32);
      put(value >> 32, count - 32);
    } else {
      put(value, count);
    }
    return value;
  }

  /// Ends the stream and returns its bytes. The encoder is then ready for the next stream.
  std::vector<std::byte> finish() {
    if (filled_ > 0) flush(8);
    while (!plain_.empty() && plain_.back() == std::byte{0}) plain_.pop_back();
    const std::vector<std::byte> decisions = range_.finish();
    ByteWriter out;
    if (!decisions.empty() || !plain_.empty()) {
      out.put_varint(decisions.size());
      out.put_bytes(decisions);
      out.put_bytes(plain_);
    }
    plain_.clear();
    return std::move(out.bytes);
  }

 private:
  void put(std::uint64_t value, int count) {
    held_ |= value << filled_;
    filled_ += count;
    flush(0);
  }
  /// Writes all complete bytes of the plain bits. If `rest` > 0, also writes the remaining bits as
  /// one more byte.
  void flush(int rest) {
    while (filled_ >= 8 || (rest > 0 && filled_ > 0)) {
      plain_.push_back(static_cast<std::byte>(held_));
      held_ >>= 8;
      filled_ -= 8;
    }
    if (filled_ < 0) filled_ = 0;
  }

  RangeEncoder range_;
  std::vector<std::byte> plain_;
  std::uint64_t held_ = 0;
  int filled_ = 0;
};

class SplitDecoder {
 public:
  static constexpr bool kDecodes = true;
  static constexpr bool kMixes = false;
  using Bit = AdaptiveBit;

  SplitDecoder() = default;
  /// Begins to decode `bytes`. They are not copied, so they must stay valid. If the stated size of
  /// the range coder's data is too large, these data end at the end of `bytes`.
  explicit SplitDecoder(std::span<const std::byte> bytes) {
    ByteReader in(bytes);
    const std::uint64_t decisions = bytes.empty() ? 0 : in.get_varint();
    if (!in.ok()) return;
    range_ = RangeDecoder(in.get_bytes(std::min<std::uint64_t>(decisions, in.left())));
    plain_ = in.get_bytes(in.left());
  }

  bool bit(AdaptiveBit& model, bool = false) { return range_.bit(model); }
  bool decide(std::uint32_t probability, bool = false) { return range_.decide(probability); }
  std::uint64_t raw(std::uint64_t, int count) {
    if (count <= 32) return take(count);
    const std::uint64_t low = take(32);
    return low | take(count - 32) << 32;
  }

 private:
  /// Returns the next `count` plain bits. Precondition: count <= 32.
  std::uint64_t take(int count) {
    if (filled_ < count) fill();
    const std::uint64_t value = held_ & ((std::uint64_t{1} << count) - 1);
    held_ >>= count;
    filled_ -= count;
    return value;
  }
  void fill() {
    while (filled_ <= 56) {
      const std::uint64_t byte =
          at_ < plain_.size() ? std::to_integer<std::uint64_t>(plain_[at_]) : 0;
      ++at_;
      held_ |= byte << filled_;
      filled_ += 8;
    }
  }

  RangeDecoder range_;
  std::span<const std::byte> plain_;
  std::size_t at_ = 0;
  std::uint64_t held_ = 0;
  int filled_ = 0;
};

}  // namespace shm
