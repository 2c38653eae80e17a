// Split coder: a range coder for decisions with known odds, and beside it plain bits for those that
// nobody can guess, which cost next to nothing to read.
//   bytes = varint of the range coder's length, its bytes, then the plain bits, low bits of each
//           byte first; zeros past the end of either
// The same face as a RangeEncoder or RangeDecoder. spec: "Split coder"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bytes/binary.h"
#include "entropy/range_coder.h"

namespace shm {

class SplitEncoder {
 public:
  static constexpr bool kDecodes = false;
  static constexpr bool kMixes = false;
  using Bit = AdaptiveBit;

  bool bit(AdaptiveBit& model, bool value) { return range_.bit(model, value); }
  bool decide(std::uint32_t probability, bool value) { return range_.decide(probability, value); }
  /// The low `count` bits of value, 0..64; the rest must be zero.
  std::uint64_t raw(std::uint64_t value, int count) {
    if (count > 32) {
      put(value & 0xffffffffu, 32);
      put(value >> 32, count - 32);
    } else {
      put(value, count);
    }
    return value;
  }

  /// Ends the stream and hands it out; the encoder is ready for the next one.
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
  /// Hands out whole bytes, and one of up to `rest` bits less.
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
  /// `bytes` are borrowed. A length beyond their end counts as all of them.
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
  /// Must hold: count <= 32.
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
