// Whole numbers: indices and what lies between them, modulo 2^64: damaged data may lead anywhere.
#pragma once

#include <bit>
#include <cstdint>

namespace shm {

constexpr std::int64_t plus(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}
constexpr std::int64_t minus(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

/// Of the magnitude.
constexpr std::uint32_t bit_length(std::int64_t number) {
  const auto bits = static_cast<std::uint64_t>(number);
  return static_cast<std::uint32_t>(std::bit_width(number < 0 ? 0 - bits : bits));
}

}  // namespace shm
