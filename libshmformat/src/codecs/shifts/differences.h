// Differences: predicts the value of an element from earlier elements, whose element numbers are
// smaller by fixed amounts (lags). This suits meshes whose elements are numbered in rows and
// layers. Along each of up to three lags, the prediction continues a polynomial.
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

// Largest number of factors (lags) of a prediction, and largest order of a factor. Frozen: part of
// the format.
inline constexpr std::uint32_t kMostFactors = 3, kMostOrder = 3;
/// Largest number of places in the ring of known elements. The place of an element is its number
/// modulo the number of places. An element is known until a later element takes its place.
inline constexpr std::uint64_t kMostPlaces = std::uint64_t{1} << 17;
/// The number of places in the ring is at most this number times the number of elements in the
/// first group, rounded down to a power of two. The limit keeps the time for clearing the ring in
/// proportion to the size of the data.
inline constexpr std::uint64_t kPlacesForEach = 64;
constexpr std::uint64_t places_for(std::uint64_t count) {
  return std::bit_floor(std::min(kMostPlaces, kPlacesForEach * std::max<std::uint64_t>(count, 1)));
}
/// Limit on the memory of all columns that use differences. Each column counts as its number of
/// components plus 1. The values of each component need up to 1 MB. A column with three components
/// needs 4 MB, because its elements are padded to four values.
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
/// Returns the taps for these factors. They are the nonzero terms of the polynomial 1 - product of
/// all (1 - x^lag)^order, in descending order of the exponent. The term x^n represents the value n
/// elements back, so the farthest element comes first. The previous element comes last, so that its
/// value is needed only at the end of the sum.
std::vector<Tap> taps_of(std::span<const Factor> factors);

class KnownNumbers {
 public:
  std::size_t place(std::uint64_t number) const { return static_cast<std::size_t>(number & mask_); }
  std::size_t places() const { return numbers_.size(); }
  bool has(std::uint64_t number) const { return numbers_[place(number)] == number; }
  void add(std::uint64_t number) { numbers_[place(number)] = number; }
  /// Removes all numbers and sets the number of places to `places`. Call it before all other
  /// functions. Precondition: `places` is a power of two and at least 2.
  void clear(std::uint64_t places) {
    mask_ = places - 1;
    numbers_.resize(static_cast<std::size_t>(places));
    // Mark all places as empty: store the number i ^ 1 in place i. The element with number i ^ 1
    // belongs in another place, so has() never finds it in place i.
    for (std::size_t i = 0; i < numbers_.size(); ++i) numbers_[i] = i ^ 1;
  }

 private:
  std::vector<std::uint64_t> numbers_;  // for each place: the most recently added number
  std::uint64_t mask_ = 0;
};

// The following classes define how the value of a component is predicted from earlier values, and
// how its residual is computed from the prediction. Each earlier value is stored as one 64-bit
// word, its state.

/// Differences of integers. They are computed modulo 2^n, where n is 64 or the number of bits of
/// the integer type. This class is used for domains with evenly spaced values.
struct WholeDifferences {
  int unused = 0;  // number of high bits of a word that are not part of the integer type
  bool has_sign = true;

  static WholeDifferences of(ScalarType integers) {
    return {static_cast<int>(64 - 8 * scalar_bytes(integers)), is_signed_integer(integers)};
  }
  /// Returns the index reduced to the range of the integer type (modulo 2^bits).
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
  /// Converts a weighted sum of states to the predicted index. For integers, the sum is the index.
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

/// Differences of floating-point numbers. Predictions are computed in float64. The index of a value
/// is its position among all numbers of type T in ascending order.
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

/// Calls `work` with an object that computes differences in a domain of this kind: a
/// FloatDifferences or a WholeDifferences.
template <class Work>
decltype(auto) with_differences(ScalarType type, DomainKind kind, Work&& work) {
  if (kind == DomainKind::narrow || (kind == DomainKind::floats && type == ScalarType::float32))
    return work(FloatDifferences<float>());
  if (kind == DomainKind::floats) return work(FloatDifferences<double>());
  return work(kind == DomainKind::integers ? WholeDifferences::of(type) : WholeDifferences());
}

/// Returns the state that belongs to an index. Later values are predicted from states. If the state
/// would be a NaN, returns 0, since some machines do not preserve the bits of a NaN.
template <class Differences>
std::uint64_t finite_state(const Differences& differences, std::int64_t index) {
  const std::uint64_t state = differences.remember(index);
  if constexpr (std::is_same_v<decltype(differences.sum_of(0)), double>) {
    const double value = std::bit_cast<double>(state);
    if (value != value) return 0;
  }
  return state;
}

}  // namespace shm
