// Scatter: where in a table a number is put. Numbers come from files, and whoever makes a file
// could choose them so that all fall on one place; so the places depend on where the table lies in
// memory, too, which a file cannot know. What is coded never depends on places.
#pragma once

#include <cstdint>

namespace shm {

class Scatter {
 public:
  Scatter() : seed_(static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(this)) * kOdd) {}

  /// Bits as good as any others, from the lowest on.
  std::uint64_t operator()(std::uint64_t number) const {
    std::uint64_t x = (number ^ seed_) * kOdd;
    x = (x ^ x >> 32) * kOther;
    return x >> 32;
  }

 private:
  static constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15u, kOther = 0xd6e8feb86659fd93u;
  std::uint64_t seed_;
};

}  // namespace shm
