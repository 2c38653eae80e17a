// AdaptiveBit: how likely a yes/no decision is, learnt from its past.
// 22 bits of probability and 10 bits of count in one word. The first decisions move it fast
// (2/3, 2/5, ...), later ones by about 1/kLimit, so small meshes learn quickly and long ones forget
// slowly. Integers only: the same on every machine. spec: "Adaptive bit"
#pragma once

#include <array>
#include <cstdint>

namespace shm {

class AdaptiveBit {
 public:
  static constexpr std::uint32_t kLimit = 160;  // frozen: part of the format

  /// Of 65536, never 0 and never all.
  std::uint32_t probability_of_one() const {
    const std::uint32_t p = state_ >> 16;
    return p == 0 ? 1 : p;  // at most 65535 by construction
  }
  /// Decisions seen, up to the limit.
  std::uint32_t count() const { return state_ & 0x3ff; }
  /// `limit`: at most kLimit; a smaller one forgets faster.
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

}  // namespace shm
