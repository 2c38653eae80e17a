// Bits that yes/no decisions take, from integers only: what an encoder decides by it is the same
// with every C library.
#pragma once

#include <bit>
#include <cstdint>

namespace shm {

/// log2(n) in steps of 2^-16, rounded down; 0 for 0.
constexpr std::uint32_t log2_steps(std::uint32_t n) {
  if (n == 0) return 0;
  const auto whole = static_cast<std::uint32_t>(std::bit_width(n)) - 1;
  std::uint64_t part = std::uint64_t{n} << (31 - whole);  // 1 <= part / 2^31 < 2
  std::uint32_t steps = whole << 16;
  for (std::uint32_t bit = 1u << 15; bit != 0; bit >>= 1) {
    part = part * part >> 31;
    if (part >> 32 == 0) continue;
    part >>= 1;
    steps |= bit;
  }
  return steps;
}

/// Bits of `taken` yes among `count` decisions. Must hold: taken <= count < 2^32.
constexpr double binary_entropy(std::uint64_t taken, std::uint64_t count) {
  const auto sum = [](std::uint64_t n) { return n * log2_steps(static_cast<std::uint32_t>(n)); };
  const std::uint64_t whole = sum(count), parts = sum(taken) + sum(count - taken);
  return whole > parts ? static_cast<double>(whole - parts) / 65536.0 : 0.0;
}

}  // namespace shm
