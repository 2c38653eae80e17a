// MatchTables: what a component was when it stood among the same values: in a part of the mesh that
// is a copy, mirrored or not. Magnitudes are compared, but for their last bits; the sign follows.
// spec: "Matches"
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

namespace shm {

/// The ways to ask: by what stands near, by the two elements before, by the other components.
inline constexpr std::uint32_t kMatchKinds = 3;

class MatchTables {
 public:
  /// Where a table has the answer, and the sign of what was asked with.
  struct Place {
    std::uint32_t at = 0;
    bool negative = false;
  };
  using Places = std::array<Place, kMatchKinds>;

  /// Magnitudes to ask with, in any number; their order does not matter.
  class Key {
   public:
    void add(double value) {
      const std::uint64_t size =
          (std::bit_cast<std::uint64_t>(value) & ~(std::uint64_t{1} << 63)) + (1u << 11);
      std::uint64_t mixed = (size >> 12) * 0x9e3779b97f4a7c15u;
      mixed ^= mixed >> 29;
      hash_ += mixed * 0xbf58476d1ce4e5b9u;
      if (!std::exchange(any_, true)) negative_ = value < 0;
    }
    Place place() const {
      return {static_cast<std::uint32_t>(hash_ * 0xbf58476d1ce4e5b9u >> (64 - kMostBits)),
              negative_};
    }

   private:
    std::uint64_t hash_ = 0;
    bool any_ = false, negative_ = false;
  };

  /// Makes room for so many more values. Where the tables grow they forget.
  void expect(std::size_t values) {
    values_ += values;
    const int wanted = std::clamp<int>(static_cast<int>(std::bit_width(8 * values_)), 8, kMostBits);
    if (bits_ == wanted) return;
    bits_ = wanted;
    for (auto& table : tables_) table.assign(std::size_t{1} << bits_, 0.0);
  }
  // Must hold: expect() came before.
  double find(std::uint32_t kind, const Place& place) const {
    const double value = tables_[kind][place.at >> (kMostBits - bits_)];
    return place.negative ? -value : value;
  }
  void remember(const Places& places, double value) {
    for (std::uint32_t kind = 0; kind < kMatchKinds; ++kind)
      tables_[kind][places[kind].at >> (kMostBits - bits_)] =
          places[kind].negative ? -value : value;
  }

 private:
  static constexpr int kMostBits = 15;
  std::size_t values_ = 0;
  int bits_ = 0;
  std::array<std::vector<double>, kMatchKinds> tables_;  // values as after a positive key
};

}  // namespace shm
