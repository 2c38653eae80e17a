// Differences: predicts a value from earlier elements whose numbers are smaller by fixed amounts
// (lags). This suits meshes whose numbers run in rows and layers. The prediction continues a
// polynomial along each of up to three lags.
//   Factor        a lag and an order: the order-th difference along the lag is expected to be 0
//   Tap           the weight of one earlier value in the prediction, and its distance
//   KnownNumbers  a ring of the numbers of known elements
// spec: "Values as differences"
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "codecs/shared/value_domain.h"

namespace shm {

// Largest number of factors, and largest order of a factor. Frozen: part of the format.
inline constexpr std::uint32_t kMostFactors = 3, kMostOrder = 3;
/// Largest number of places in the ring of known elements. An element is known until another
/// element has the same number modulo the number of places.
inline constexpr std::uint64_t kMostPlaces = std::uint64_t{1} << 17;
/// Largest number of places per element of the first group. It limits the number of places, a power
/// of two, so that clearing the places takes time in proportion to the data.
inline constexpr std::uint64_t kPlacesForEach = 64;
constexpr std::uint64_t places_for(std::uint64_t count) {
  return std::bit_floor(std::min(kMostPlaces, kPlacesForEach * std::max<std::uint64_t>(count, 1)));
}
/// Largest number of components of all columns that use differences, together. Each component needs
/// up to 1 MB; three components of one column need 4 MB.
inline constexpr std::uint32_t kMostDifferenceRings = 32;

struct Factor {
  std::uint32_t lag = 1;
  std::uint32_t order = 1;
  bool operator==(const Factor&) const = default;
};
struct Tap {
  std::uint64_t back = 0;
  std::int64_t count = 0;
};
/// Returns the taps for these factors: the terms of 1 - the product of all (1 - x^lag)^order, by
/// descending power, without zero terms. The farthest element comes first, so that the sum needs
/// the value of the previous element only at the end.
std::vector<Tap> taps_of(std::span<const Factor> factors);

class KnownNumbers {
 public:
  std::size_t place(std::uint64_t number) const { return static_cast<std::size_t>(number & mask_); }
  std::size_t places() const { return numbers_.size(); }
  bool has(std::uint64_t number) const { return numbers_[place(number)] == number; }
  void add(std::uint64_t number) { numbers_[place(number)] = number; }
  /// Removes all numbers and sets the number of places. Call it before all other functions. Must
  /// hold: `places` is a power of two, at least 2.
  void clear(std::uint64_t places) {
    mask_ = places - 1;
    numbers_.resize(static_cast<std::size_t>(places));
    // A number that belongs to another place marks a place without a known number.
    for (std::size_t i = 0; i < numbers_.size(); ++i) numbers_[i] = i ^ 1;
  }

 private:
  std::vector<std::uint64_t> numbers_;  // by place: the last number
  std::uint64_t mask_ = 0;
};

// The following classes define how a prediction is computed from the states of one component, and
// how a value is coded relative to the prediction. The state of a value is one word.

/// Differences of integers, modulo 2^64 or within the integer type of the values. This class is
/// used for domains whose values are evenly spaced.
struct WholeDifferences {
  int unused = 0;  // number of high bits that the type does not use
  bool has_sign = true;

  static WholeDifferences of(ScalarType integers) {
    return {static_cast<int>(64 - 8 * scalar_bytes(integers)), is_signed_integer(integers)};
  }
  /// Returns the index wrapped to the range of the type.
  std::int64_t within(std::uint64_t index) const {
    const std::uint64_t high = index << unused;
    return has_sign ? static_cast<std::int64_t>(high) >> unused
                    : static_cast<std::int64_t>(high >> unused);
  }
  static std::uint64_t remember(std::int64_t index) { return static_cast<std::uint64_t>(index); }
  using Sum = std::uint64_t;
  static Sum weight(std::int64_t count) { return static_cast<Sum>(count); }
  static Sum add(Sum sum, Sum weight, std::uint64_t remembered) {
    return sum + weight * remembered;
  }
  /// Returns half of the sum, rounded down.
  static Sum half(Sum sum) { return static_cast<Sum>(static_cast<std::int64_t>(sum) >> 1); }
  /// Returns the index that a sum predicts, or the index of a state.
  static std::int64_t index(Sum sum) { return static_cast<std::int64_t>(sum); }
  static Sum sum_of(std::uint64_t remembered) { return remembered; }
  std::uint64_t residual(std::int64_t value, std::int64_t predicted) const {
    const std::uint64_t high =
        (static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(predicted)) << unused;
    const auto r = static_cast<std::uint64_t>(static_cast<std::int64_t>(high) >> unused);
    return r << 1 ^ (0 - (r >> 63));
  }
  std::int64_t value(std::uint64_t residual, std::int64_t predicted) const {
    const std::uint64_t r = residual >> 1 ^ (0 - (residual & 1));
    return within(static_cast<std::uint64_t>(predicted) + r);
  }
};

/// Differences of floating-point numbers. Values are predicted in float64, and coded as indices
/// among all numbers of type T.
template <class T>
struct FloatDifferences {
  using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  static constexpr int kTop = 8 * sizeof(T) - 1;

  static std::uint64_t remember(std::int64_t index) {
    return std::bit_cast<std::uint64_t>(FloatSpace<T>::state(index));
  }
  using Sum = double;
  static Sum weight(std::int64_t count) { return static_cast<Sum>(count); }
  static Sum add(Sum sum, Sum weight, std::uint64_t remembered) {
    return sum + weight * std::bit_cast<double>(remembered);
  }
  static Sum half(Sum sum) { return sum * 0.5; }
  static std::int64_t index(Sum sum) { return FloatSpace<T>::index(sum); }
  static Sum sum_of(std::uint64_t remembered) { return std::bit_cast<double>(remembered); }
  static std::uint64_t residual(std::int64_t value, std::int64_t predicted) {
    const auto r = static_cast<Bits>(static_cast<Bits>(value) - static_cast<Bits>(predicted));
    return static_cast<Bits>(static_cast<Bits>(r << 1) ^ static_cast<Bits>(0 - (r >> kTop)));
  }
  static std::int64_t value(std::uint64_t residual, std::int64_t predicted) {
    const auto z = static_cast<Bits>(residual);
    const auto r = static_cast<Bits>((z >> 1) ^ static_cast<Bits>(0 - (z & 1)));
    const auto index = static_cast<Bits>(static_cast<Bits>(predicted) + r);
    return static_cast<std::int64_t>(static_cast<std::make_signed_t<Bits>>(index));
  }
};

/// Calls `work` with the class of differences that suits the domain.
template <class Work>
decltype(auto) with_differences(ScalarType type, DomainKind kind, Work&& work) {
  if (kind == DomainKind::narrow || (kind == DomainKind::floats && type == ScalarType::float32))
    return work(FloatDifferences<float>());
  if (kind == DomainKind::floats) return work(FloatDifferences<double>());
  return work(kind == DomainKind::integers ? WholeDifferences::of(type) : WholeDifferences());
}

}  // namespace shm
