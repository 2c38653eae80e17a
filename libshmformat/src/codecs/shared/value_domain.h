// ValueDomain: the set of numbers that a component of an array uses in one group. The encoder finds
// the domain and writes it to the stream. In a domain, each value has an index. Indices are
// integers in the order of the values. A residual is a difference of indices. Predictions are
// computed from *states*. A value space converts between indices and states:
//   LinearSpace   The state equals the index. The values are integers or multiples of a step.
//   FloatSpace    The state is the value. The index is the value's position among all
//                 floating-point numbers.
//   DecimalSpace  The state is the value. The index is the value's position among the numbers with
//                 N significant digits.
//   RankSpace     The index is the value's position in a sorted table of the values that occur. The
//                 state is the value's state in one of the other spaces.
// All spaces use only + - * / in a fixed order, so that results have the same bits on every
// machine.
// spec: "Value domains"
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cfloat>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "shm/schema.h"

namespace shm {

// Predictions are part of the format, so all machines must compute the same results: each operation
// must round exactly once, to the type of its operands. On 32-bit x86 this requires -msse2
// -mfpmath=sse.
static_assert(FLT_EVAL_METHOD == 0 && std::numeric_limits<double>::is_iec559 &&
                  std::numeric_limits<float>::is_iec559,
              "needs IEEE arithmetic without excess precision");

// Indices and their differences are computed modulo 2^64, because damaged data may contain any
// index.
constexpr std::int64_t plus(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}
constexpr std::int64_t minus(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

/// Returns the number of bits of the absolute value of `number`.
constexpr std::uint32_t bit_length(std::int64_t number) {
  const auto bits = static_cast<std::uint64_t>(number);
  return static_cast<std::uint32_t>(std::bit_width(number < 0 ? 0 - bits : bits));
}

/// Largest magnitude of an index in LinearSpace.
inline constexpr std::int64_t kLargestIndex = std::int64_t{1} << 53;

/// 10^n for n = 0..22, exact.
inline constexpr std::array<double, 23> kPowersOfTen = {
    1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

inline bool is_finite(double v) {
  constexpr double kMost = std::numeric_limits<double>::max();
  return v >= -kMost && v <= kMost;
}

/// Returns the nearest integer, limited to +-2^53. Halves are rounded up. Returns 0 for NaN.
inline std::int64_t nearest_integer(double v) {
  constexpr auto kMost = static_cast<double>(kLargestIndex);
  if (!(v > -kMost)) return v == v ? -kLargestIndex : 0;
  if (v >= kMost) return kLargestIndex;
  // The usual formula floor(v + 0.5) would be wrong for the number just below 0.5 and for numbers
  // from 2^52 on, since v + 0.5 would be rounded.
  auto down = static_cast<std::int64_t>(v);
  if (static_cast<double>(down) > v) --down;
  return v - static_cast<double>(down) >= 0.5 ? down + 1 : down;
}

/// Returns the index of a float or double: a signed integer that sorts in the same order as the
/// values; -1 for -0.0. The parameter is the bits of the value and not the value itself, since the
/// bits of a NaN must not change: on 32-bit x86, returning a float from a function sets the quiet
/// bit of a NaN.
template <class Bits>
std::int64_t ordered_index_of(Bits of) {
  using Signed = std::make_signed_t<Bits>;
  constexpr int kTop = 8 * sizeof(Bits) - 1;
  constexpr auto kMagnitude = static_cast<Signed>(~(Bits{1} << kTop));
  const auto bits = static_cast<Signed>(of);
  // Branch-free, because signs of field values alternate.
  return static_cast<Signed>(bits ^ (bits >> kTop & kMagnitude));
}
template <class Unsigned>
Unsigned ordered_bits(std::int64_t index) {
  using Signed = std::make_signed_t<Unsigned>;
  constexpr int kTop = 8 * sizeof(Unsigned) - 1;
  constexpr auto kMagnitude = static_cast<Signed>(~(Unsigned{1} << kTop));
  const auto narrow = static_cast<Signed>(static_cast<Unsigned>(index));
  return static_cast<Unsigned>(narrow ^ (narrow >> kTop & kMagnitude));
}
/// Returns the same as ordered_index_of() for the bits of `value`, except that the payload of a NaN
/// may be lost.
template <class T>
std::int64_t ordered_index(T value) {
  using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  return ordered_index_of(std::bit_cast<Bits>(value));
}
template <class T>
T ordered_value(std::int64_t index) {
  using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  return std::bit_cast<T>(ordered_bits<Bits>(index));
}

struct LinearSpace {
  static std::int64_t index(double prediction) { return nearest_integer(prediction); }
  static double state(std::int64_t index) { return static_cast<double>(index); }
  /// Returns a number of bits that depends on the magnitude of a value. The caller subtracts it
  /// from the length of a residual, which makes the residuals of small and large values comparable.
  /// In this space, the result is always 0.
  static std::int32_t scale(double) { return 0; }
};

template <class T>
struct FloatSpace {
  static std::int64_t index(double prediction) {
    return ordered_index(static_cast<T>(prediction == prediction ? prediction : 0.0));
  }
  static double state(std::int64_t index) { return static_cast<double>(ordered_value<T>(index)); }
  /// Returns the biased binary exponent.
  static std::int32_t scale(double prediction) {
    return static_cast<std::int32_t>(std::bit_cast<std::uint64_t>(prediction) >> 52 & 0x7ff);
  }
};

/// Space of the numbers m * 10^k with `digits` significant digits: 10^(digits-1) <= m < 10^digits,
/// |k| <= 22.
struct DecimalSpace {
  static constexpr std::int32_t kMostPower = 22;
  std::int32_t digits = 1;  ///< number of significant digits, 1 to 15

  std::int64_t index(double prediction) const {
    if (!(prediction == prediction)) return 0;
    const double size = prediction < 0 ? -prediction : prediction;
    const double low = kPowersOfTen[static_cast<std::size_t>(digits) - 1], high = low * 10.0;
    std::int32_t k = -kMostPower;
    // Find k by binary search: the smallest exponent for which the mantissa has at most `digits`
    // digits.
    std::int32_t above = kMostPower;
    while (k < above) {
      const std::int32_t middle = k + (above - k) / 2;
      if (mantissa(size, middle) < high - 0.5)
        above = middle;
      else
        k = middle + 1;
    }
    double m = mantissa(size, k);
    if (m < low - 0.5) return 0;  // the magnitude is below the smallest number with `digits` digits
    if (!(m < high - 0.5)) m = high - 1.0;
    const std::int64_t whole = std::clamp(nearest_integer(m), static_cast<std::int64_t>(low),
                                          static_cast<std::int64_t>(high) - 1);
    const std::int64_t place =
        (k + kMostPower) * span() + (whole - static_cast<std::int64_t>(low)) + 1;
    return prediction < 0 ? -place : place;
  }
  double state(std::int64_t index) const {
    if (index == 0) return 0.0;
    const std::int64_t most = (2 * kMostPower + 1) * span();
    const std::int64_t within = std::clamp(index, -most, most);
    const std::int64_t place = (within < 0 ? -within : within) - 1;
    const auto k = static_cast<std::int32_t>(place / span()) - kMostPower;
    const double m =
        static_cast<double>(place % span()) + kPowersOfTen[static_cast<std::size_t>(digits) - 1];
    const double size = k >= 0 ? m * kPowersOfTen[static_cast<std::size_t>(k)]
                               : m / kPowersOfTen[static_cast<std::size_t>(-k)];
    return index < 0 ? -size : size;
  }
  static std::int32_t scale(double) { return 0; }

 private:
  std::int64_t span() const {
    return 9 * static_cast<std::int64_t>(kPowersOfTen[static_cast<std::size_t>(digits) - 1]);
  }
  static double mantissa(double size, std::int32_t k) {
    return k >= 0 ? size / kPowersOfTen[static_cast<std::size_t>(k)]
                  : size * kPowersOfTen[static_cast<std::size_t>(-k)];
  }
};

/// Space in which an index is the rank of a value in a sorted table. Precondition: `table` is in
/// ascending order and not empty. `base` is the space of the entries.
struct RankSpace {
  std::variant<LinearSpace, DecimalSpace, FloatSpace<float>, FloatSpace<double>> base;
  std::span<const std::int64_t> table;

  std::int64_t index(double prediction) const {
    const std::int64_t wanted =
        std::visit([&](const auto& space) { return space.index(prediction); }, base);
    const auto next = std::lower_bound(table.begin(), table.end(), wanted);
    if (next == table.begin()) return 0;
    auto rank = next - table.begin();
    if (next == table.end() || distance(wanted, next[-1]) <= distance(*next, wanted)) --rank;
    return rank;
  }
  double state(std::int64_t index) const {
    const auto last = static_cast<std::int64_t>(table.size()) - 1;
    const std::int64_t entry =
        table[static_cast<std::size_t>(std::clamp<std::int64_t>(index, 0, last))];
    return std::visit([&](const auto& space) { return space.state(entry); }, base);
  }
  std::int32_t scale(double) const { return 0; }

 private:
  static std::uint64_t distance(std::int64_t high, std::int64_t low) {
    return static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low);
  }
};

enum class DomainKind : std::uint8_t {
  floats = 0,    ///< every bit pattern of the stored type
  narrow = 1,    ///< doubles that are exact as float32
  binary = 2,    ///< the numbers index * 2^-exponent
  decimal = 3,   ///< the numbers index / 10^exponent; for negative exponents, index * 10^-exponent
  digits = 4,    ///< numbers with `exponent` significant decimal digits
  integers = 5,  ///< integers, for arrays of integer type
  /// The values minimum + index * step; the schema contains minimum and step. With a relative error
  /// bound: the values whose bits, without the sign, are |index| * spacing.
  quantized = 6,
};
inline constexpr std::uint32_t kDomainKinds = 7;

struct ValueDomain {
  DomainKind kind = DomainKind::floats;
  std::int32_t exponent = 0;
  bool negative_zero = false;  ///< true if the group may contain -0.0 (only for the kinds binary,
                               ///< decimal, digits)

  /// True if some values may be outside the domain. Such values are stored in full
  bool escapes = false;
  // Flags that state how earlier values of the component are used
  bool recalls = false;   ///< true if some values are coded relative to an earlier value of the
                          ///< component
  bool partners = false;  ///< true if values may be coded relative to a partner (an earlier element
                          ///< whose reference value has nearly the same magnitude); only in groups
                          ///< with reference values
  bool operator==(const ValueDomain&) const = default;

  bool is_linear() const {
    return kind == DomainKind::binary || kind == DomainKind::decimal ||
           kind == DomainKind::integers || kind == DomainKind::quantized;
  }
  /// Returns true if each value has the same state in this domain as in `other`.
  bool has_states_of(const ValueDomain& other) const {
    return kind == other.kind && exponent == other.exponent;
  }
  /// Returns true if an array with the properties `info` may use this kind and exponent.
  bool fits(const ArrayInfo& info) const;
};

/// Converts the values of one component to indices and back. Values are passed as bits.
class ValueTranslator {
 public:
  ValueTranslator(const ArrayInfo& info, std::size_t component, const ValueDomain& domain);

  /// Returns the index of the value whose bits are the low bytes of `bits`. Returns nothing if the
  /// domain does not contain the value. If negative_zero is set, 0.0 and -0.0 have the same index.
  std::optional<std::int64_t> index(std::uint64_t bits) const;
  /// Returns the bits of the value that has this index.
  std::uint64_t bits(std::int64_t index) const;

  /// To convert a state of one domain to a state of another domain, call as_value() of the first
  /// domain, then from_value() of the other domain. Both functions accept any number and return the
  /// same result on all machines.
  double as_value(double state) const;    ///< converts a state of this domain to a value
  double from_value(double value) const;  ///< converts a value to a state of this domain

 private:
  double linear_value(std::int64_t index) const;
  std::uint64_t relative_bits(std::int64_t index) const;
  std::int64_t relative_index(std::uint64_t bits) const;
  /// Returns true if a restored value is within the error bound of the array.
  bool is_within_bound(double value, double restored) const;

  ScalarType type_;
  ValueDomain domain_;
  double minimum_ = 0, step_ = 1, max_error_ = 0;
  // For a relative error bound: the distance between values with consecutive indices, counted in
  // numbers of the type; otherwise 0.
  std::uint64_t spacing_ = 0;
  std::vector<double> fills_;  // for the kind quantized: values that the domain does not contain
};

/// Replaces each value that can be quantized by the value that a reader restores. `words` contains
/// values of a component of a quantized array. Values that cannot be quantized and fill values are
/// stored exactly.
void round_quantized(const ArrayInfo& info, std::size_t component, std::span<std::uint64_t> words);
/// Returns the values that a reader restores, packed: rounded if the array is quantized. `values`:
/// `count` elements, the beginnings of which are `stride` bytes apart.
std::vector<std::byte> restored_values(const ArrayInfo& info, const std::byte* values,
                                       std::size_t stride, std::size_t count);

/// Returns the bits of the scalar at an address. `width`: size of the scalar in bytes.
inline std::uint64_t load_scalar(const std::byte* at, std::size_t width) {
  std::uint64_t bits = 0;
  if constexpr (std::endian::native == std::endian::little)
    std::memcpy(&bits, at, width);
  else
    std::memcpy(reinterpret_cast<std::byte*>(&bits) + (8 - width), at, width);
  return bits;
}
/// Stores the low `width` bytes of `bits` in host byte order.
inline void store_scalar(std::byte* at, std::uint64_t bits, std::size_t width) {
  if constexpr (std::endian::native == std::endian::little)
    std::memcpy(at, &bits, width);
  else
    std::memcpy(at, reinterpret_cast<const std::byte*>(&bits) + (8 - width), width);
}

/// Converts the value with these bits to double. The result is the same as that of
/// ValueTranslator::as_value().
double scalar_as_double(ScalarType type, std::uint64_t bits);

/// Returns the bits of -0.0.
constexpr std::uint64_t negative_zero(ScalarType type) {
  return type == ScalarType::float32 ? 0x80000000u : std::uint64_t{1} << 63;
}

/// Returns the index of the value in `space`. Returns nothing if the space does not contain the
/// value. `bits`: the bits of the value.
std::optional<std::int64_t> index_in(const auto& space, const ValueTranslator& translator,
                                     std::uint64_t bits) {
  const auto index = translator.index(bits);
  if constexpr (requires { space.table; }) {
    if (!index) return index;
    const auto found = std::lower_bound(space.table.begin(), space.table.end(), *index);
    if (found == space.table.end() || *found != *index) return std::nullopt;
    return found - space.table.begin();
  } else {
    return index;
  }
}

/// Calls visit(space) with the space of the domain. If `table` is not empty, the space is a
/// RankSpace, which refers to `table` without copying it.
template <class Visit>
auto with_space(const ArrayInfo& info, const ValueDomain& domain,
                std::span<const std::int64_t> table, Visit&& visit) {
  const auto ranked = [&](const auto& base) {
    if (table.empty()) return visit(base);
    return visit(RankSpace{base, table});
  };
  switch (domain.kind) {
    case DomainKind::floats:
      if (info.type == ScalarType::float32) return ranked(FloatSpace<float>());
      return ranked(FloatSpace<double>());
    case DomainKind::narrow: return ranked(FloatSpace<float>());
    case DomainKind::digits: return ranked(DecimalSpace{domain.exponent});
    default: return ranked(LinearSpace());
  }
}

// --- encoder: candidate domains

/// The domain in which the encoder codes one component of a group, and the table that defines
/// ranks.
struct DomainAndTable {
  ValueDomain domain;
  /// Indices that occur in the group, in ascending order. If the table is empty, indices are coded
  /// directly instead of as ranks
  std::vector<std::int64_t> table;
};

/// A domain, and the estimated size of the values if they are coded in this domain.
struct RatedDomain : DomainAndTable {
  double bits = 0;  ///< estimated size in bits of the group's values, including the table

  /// Estimated number of bits per element, measured on a sample without coding values relative to
  /// earlier values or to partners
  double sampled_bits = 0;
};

/// Returns the domains that may suit these values, the most likely domain first. `bits`: the bits
/// of the values. The result is never empty.
std::vector<DomainAndTable> domain_candidates(const ArrayInfo& info, std::size_t component,
                                              std::span<const std::uint64_t> bits);

/// Returns a domain that contains all these values and needs neither escapes nor the flag
/// negative_zero. Chooses a domain of evenly spaced values if the indices in such a domain are much
/// shorter than floating-point numbers. Precondition: `bits` is not empty.
ValueDomain evenly_spaced_domain(const ArrayInfo& info, std::size_t component,
                                 std::span<const std::uint64_t> bits);

/// Returns a domain that contains all, or nearly all, possible values of an array with the
/// properties `info`.
inline ValueDomain widest_domain(const ArrayInfo& info) {
  if (!is_float(info.type)) return {DomainKind::integers};
  return {info.quantization.bits > 0 ? DomainKind::quantized : DomainKind::floats};
}

/// Returns true if the domain contains these values. If `domain.escapes` is set, a few values may
/// be outside the domain. If `domain.negative_zero` is set, values may be -0.0.
bool still_fits(const ArrayInfo& info, std::size_t component, const ValueDomain& domain,
                std::span<const std::uint64_t> bits);

}  // namespace shm
