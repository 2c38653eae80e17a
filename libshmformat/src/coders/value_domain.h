// Value domains: how one scalar of an array is held, predicted and told apart from its prediction.
//   FloatDomain<T>      every bit of a float; predicted in double arithmetic
//   IntegerDomain<T>    every bit of an integer; predicted modulo 2^64
//   QuantizedDomain<T>  a float as an integer multiple of a step, or exactly where that misses
// The arithmetic uses + - * / in a fixed order only, so it gives the same bits on every machine
// (no contraction, no libm). spec: "Value domains"
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "entropy/models.h"
#include "shm/schema.h"

namespace shm {

/// How surprising recent values were: bit length of the residual, 0..64.
using Surprise = std::uint8_t;

template <class T>
class FloatDomain {
 public:
  using State = double;
  using Model = SignedModel<ResidualModel>;
  static constexpr std::size_t kBytes = sizeof(T);

  FloatDomain(const ArrayInfo&, std::size_t) {}

  /// Codes the scalar at `bytes` against `prediction`; returns its state and surprise.
  template <class Coder>
  State code(Coder& coder, Model& model, State prediction, std::byte* bytes, Surprise& surprise) {
    const Bits expected = ordered(static_cast<T>(prediction == prediction ? prediction : 0.0));
    Bits actual = 0;
    if constexpr (!Coder::kDecodes) {
      T value;
      std::memcpy(&value, bytes, sizeof value);
      actual = ordered(value);
    }
    const auto residual = static_cast<std::make_signed_t<Bits>>(actual - expected);
    const std::int64_t coded = code_signed(coder, model, residual);
    surprise = static_cast<Surprise>(std::bit_width(magnitude(coded)));
    const T value = unordered(expected + static_cast<Bits>(coded));
    if constexpr (Coder::kDecodes) std::memcpy(bytes, &value, sizeof value);
    return static_cast<double>(value);
  }

 private:
  using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  static constexpr Bits kSign = Bits{1} << (8 * sizeof(T) - 1);
  static std::uint64_t magnitude(std::int64_t v) {
    return v < 0 ? 0 - static_cast<std::uint64_t>(v) : static_cast<std::uint64_t>(v);
  }
  /// Integers in the order of the floats: negative ones flipped, positive ones above.
  static Bits ordered(T value) {
    const auto bits = std::bit_cast<Bits>(value);
    return (bits & kSign) != 0 ? static_cast<Bits>(~bits) : bits | kSign;
  }
  static T unordered(Bits bits) {
    return std::bit_cast<T>((bits & kSign) != 0 ? bits ^ kSign : static_cast<Bits>(~bits));
  }
};

template <class T>
class IntegerDomain {
 public:
  using State = std::uint64_t;
  using Model = SignedModel<NumberModel>;
  static constexpr std::size_t kBytes = sizeof(T);

  IntegerDomain(const ArrayInfo&, std::size_t) {}

  template <class Coder>
  State code(Coder& coder, Model& model, State prediction, std::byte* bytes, Surprise& surprise) {
    T value{};
    if constexpr (!Coder::kDecodes) std::memcpy(&value, bytes, sizeof value);
    // The difference in the scalar's own width, so that wrap-around stays small.
    const auto residual =
        static_cast<Signed>(static_cast<Unsigned>(static_cast<std::uint64_t>(value) - prediction));
    const std::int64_t coded = code_signed(coder, model, residual);
    surprise = static_cast<Surprise>(std::bit_width(
        coded < 0 ? 0 - static_cast<std::uint64_t>(coded) : static_cast<std::uint64_t>(coded)));
    value = static_cast<T>(static_cast<Unsigned>(prediction + static_cast<std::uint64_t>(coded)));
    if constexpr (Coder::kDecodes) std::memcpy(bytes, &value, sizeof value);
    return static_cast<std::uint64_t>(value);
  }

 private:
  using Unsigned = std::make_unsigned_t<T>;
  using Signed = std::make_signed_t<T>;
};

template <class T>
class QuantizedDomain {
 public:
  using State = double;  ///< the integer multiple, exact: below 2^53
  struct Model {
    AdaptiveBit escape;
    SignedModel<ResidualModel> residual;
  };
  static constexpr std::size_t kBytes = sizeof(T);

  QuantizedDomain(const ArrayInfo& info, std::size_t component)
      : minimum_(info.quantization.minimum[component]),
        step_(info.quantization.step()),
        max_error_(info.quantization.max_error(info.type)) {}

  template <class Coder>
  State code(Coder& coder, Model& model, State prediction, std::byte* bytes, Surprise& surprise) {
    const std::int64_t expected = to_integer(prediction);
    std::int64_t index = expected;
    bool escape = false;
    T value{};
    if constexpr (!Coder::kDecodes) {
      std::memcpy(&value, bytes, sizeof value);
      escape = !quantize(value, index);
    }
    if (coder.bit(model.escape, escape)) {
      using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
      const auto bits = static_cast<Bits>(coder.raw(std::bit_cast<Bits>(value), 8 * sizeof(T)));
      if constexpr (Coder::kDecodes) std::memcpy(bytes, &bits, sizeof bits);
      surprise = 0;
      return static_cast<double>(expected);
    }
    const std::int64_t coded = code_signed(coder, model.residual, index - expected);
    surprise = static_cast<Surprise>(std::bit_width(
        coded < 0 ? 0 - static_cast<std::uint64_t>(coded) : static_cast<std::uint64_t>(coded)));
    index = clamp(static_cast<std::int64_t>(static_cast<std::uint64_t>(expected) +
                                            static_cast<std::uint64_t>(coded)));
    if constexpr (Coder::kDecodes) {
      value = restore(index);
      std::memcpy(bytes, &value, sizeof value);
    }
    return static_cast<double>(index);
  }

 private:
  static constexpr std::int64_t kLargest = std::int64_t{1} << 53;

  static std::int64_t clamp(std::int64_t v) { return std::clamp(v, -kLargest, kLargest); }
  /// Nearest integer, halves up, within +-2^53; 0 for NaN.
  static std::int64_t to_integer(double v) {
    if (!(v > -9.0e15)) return v == v ? -kLargest : 0;
    if (v > 9.0e15) return kLargest;
    const double shifted = v + 0.5;
    auto down = static_cast<std::int64_t>(shifted);
    if (static_cast<double>(down) > shifted) --down;
    return down;
  }
  T restore(std::int64_t index) const {
    return static_cast<T>(minimum_ + static_cast<double>(index) * step_);
  }
  /// False where the value is not finite or would come back outside the promise.
  bool quantize(T value, std::int64_t& index) const {
    const auto wide = static_cast<double>(value);
    if (!(std::fabs(wide) <= std::numeric_limits<double>::max())) return false;
    const double scaled = (wide - minimum_) / step_;
    if (!(std::fabs(scaled) < 4.0e15)) return false;
    index = to_integer(scaled);
    return std::fabs(static_cast<double>(restore(index)) - wide) <= max_error_;
  }

  double minimum_, step_, max_error_;
};

}  // namespace shm
