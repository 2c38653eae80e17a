#include "codecs/patterns/linear_indices.h"

#include <bit>
#include <cstddef>
#include <type_traits>

namespace shm {
namespace {

double power_of_two(std::int32_t exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
}

/// Returns true if the domain is binary and its exponent is moderate, so that no power or product
/// in the conversion is a denormal number.
bool is_usual_binary(const ValueDomain& domain) {
  return domain.kind == DomainKind::binary && domain.exponent >= -900 && domain.exponent <= 900;
}

// 1.5 * 2^52. Adding this constant to a number and then subtracting it rounds the number to an
// integer.
constexpr double kRound = 6755399441055744.0;
constexpr double kMost = 1125899906842624.0;  // largest index: 2^50

// The next two functions convert between integers and doubles of magnitudes up to kMost, using bit
// operations. Unlike the conversion instructions of many processors, these functions can be
// vectorized.
constexpr auto kRoundBits = std::bit_cast<std::uint64_t>(kRound);
std::uint64_t as_integer(double whole) {
  return std::bit_cast<std::uint64_t>(whole + kRound) - kRoundBits;
}
double as_double(std::uint64_t integer) {
  return std::bit_cast<double>(integer + kRoundBits) - kRound;
}

template <class Bits>
double value_of(std::uint64_t bits) {
  using Float = std::conditional_t<sizeof(Bits) == 4, float, double>;
  return static_cast<double>(std::bit_cast<Float>(static_cast<Bits>(bits)));
}

/// For each value, stores its index in `indices`. `unit(d)` returns the value of index d.
/// `scale(value)` returns a number close to the index of the value.
template <class Bits, class Scale, class Unit>
bool indices_as(std::span<const std::uint64_t> bits, std::span<std::int64_t> indices,
                const Scale& scale, const Unit& unit) {
  using Float = std::conditional_t<sizeof(Bits) == 4, float, double>;
  bool ok = true;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    const double scaled = scale(value_of<Bits>(bits[i]));
    const bool within = scaled < kMost && scaled > -kMost;
    const double whole = within ? scaled + kRound - kRound : 0.0;
    ok = ok && within &&
         std::bit_cast<Bits>(static_cast<Float>(unit(whole))) == static_cast<Bits>(bits[i]);
    indices[i] = static_cast<std::int64_t>(whole);
  }
  return ok;
}

template <class Bits>
bool indices_as(std::span<const std::uint64_t> bits, const ValueDomain& domain,
                std::span<std::int64_t> indices) {
  if (domain.kind == DomainKind::decimal && domain.exponent >= 0) {
    const double ten = kPowersOfTen[static_cast<std::size_t>(domain.exponent)];
    return indices_as<Bits>(
        bits, indices, [ten](double v) { return v * ten; }, [ten](double d) { return d / ten; });
  }
  if (!is_usual_binary(domain)) return false;
  return indices_as<Bits>(
      bits, indices, [by = power_of_two(domain.exponent)](double v) { return v * by; },
      [by = power_of_two(-domain.exponent)](double d) { return d * by; });
}

/// For each value, stores nearest_integer(value * times) in `nearest`. Returns false if a value is
/// NaN or too large. The function compares bit patterns instead of numbers, so that the loop can be
/// vectorized.
template <class Bits>
bool nearest_as(std::span<const std::uint64_t> bits, double times,
                std::span<std::int64_t> nearest) {
  constexpr auto kMostBits = std::bit_cast<std::uint64_t>(kMost);
  constexpr auto kHalfBits = std::bit_cast<std::uint64_t>(.5);
  std::uint64_t within = ~std::uint64_t{0};  // top bit: 1 as long as all values are within kMost
  for (std::size_t i = 0; i < bits.size(); ++i) {
    const double scaled = value_of<Bits>(bits[i]) * times;
    within &= (std::bit_cast<std::uint64_t>(scaled) << 1 >> 1) - kMostBits;
    const double even = scaled + kRound - kRound;  // nearest integer; halves are rounded to even
    const std::uint64_t other = std::bit_cast<std::uint64_t>(scaled - even) ^ kHalfBits;
    nearest[i] = static_cast<std::int64_t>(as_integer(even) + 1 - ((other | (0 - other)) >> 63));
  }
  return within >> 63 != 0;
}

/// Replaces each index in `words` with the bits of its value. If an index is too large for
/// as_double(), returns false and changes nothing.
template <class Unit>
bool values_as(ScalarType type, std::span<std::uint64_t> words, const Unit& unit) {
  constexpr auto kMostIndex = static_cast<std::uint64_t>(kMost);
  std::uint64_t beyond = 0;
  for (const std::uint64_t word : words) beyond |= (word + kMostIndex) >> 51;
  if (beyond != 0) return false;
  if (type == ScalarType::float32)
    for (std::uint64_t& word : words)
      word = std::bit_cast<std::uint32_t>(static_cast<float>(unit(as_double(word))));
  else
    for (std::uint64_t& word : words) word = std::bit_cast<std::uint64_t>(unit(as_double(word)));
  return true;
}

}  // namespace

bool linear_indices(ScalarType type, std::span<const std::uint64_t> bits, const ValueDomain& domain,
                    std::span<std::int64_t> indices) {
  return type == ScalarType::float32 ? indices_as<std::uint32_t>(bits, domain, indices)
                                     : indices_as<std::uint64_t>(bits, domain, indices);
}

bool linear_references(ScalarType type, std::span<const std::uint64_t> bits,
                       const ValueDomain& domain, std::span<std::int64_t> nearest) {
  double times = 0;
  if (domain.kind == DomainKind::decimal && domain.exponent >= 0)
    times = kPowersOfTen[static_cast<std::size_t>(domain.exponent)];
  else if (is_usual_binary(domain))
    times = power_of_two(domain.exponent);
  else
    return false;
  return type == ScalarType::float32 ? nearest_as<std::uint32_t>(bits, times, nearest)
                                     : nearest_as<std::uint64_t>(bits, times, nearest);
}

bool linear_values(ScalarType type, const ValueDomain& domain, std::span<std::uint64_t> words) {
  if (is_usual_binary(domain))
    return values_as(type, words,
                     [by = power_of_two(-domain.exponent)](double d) { return d * by; });
  if (domain.kind == DomainKind::decimal && domain.exponent >= 0)
    return values_as(type, words,
                     [ten = kPowersOfTen[static_cast<std::size_t>(domain.exponent)]](double d) {
                       return d / ten;
                     });
  return false;
}

}  // namespace shm
