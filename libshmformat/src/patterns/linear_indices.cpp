#include "patterns/linear_indices.h"

#include <bit>
#include <cstddef>
#include <type_traits>

namespace shm {
namespace {

double power_of_two(std::int32_t exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
}

/// With powers that are normal numbers, and products that are.
bool is_usual_binary(const ValueDomain& domain) {
  return domain.kind == DomainKind::binary && domain.exponent >= -900 && domain.exponent <= 900;
}

/// `unit(d)` is the value of index d; scale(value) is near the index.
template <class Bits, class Scale, class Unit>
bool indices_as(std::span<const std::uint64_t> bits, std::span<std::int64_t> indices,
                const Scale& scale, const Unit& unit) {
  using Float = std::conditional_t<sizeof(Bits) == 4, float, double>;
  constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: sums with it are whole
  constexpr double kMost = 1125899906842624.0;   // 2^50
  bool good = true;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    const auto value = std::bit_cast<Float>(static_cast<Bits>(bits[i]));
    const double scaled = scale(static_cast<double>(value));
    const bool within = scaled < kMost && scaled > -kMost;
    const double whole = within ? scaled + kRound - kRound : 0.0;
    good = good && within &&
           std::bit_cast<Bits>(static_cast<Float>(unit(whole))) == static_cast<Bits>(bits[i]);
    indices[i] = static_cast<std::int64_t>(whole);
  }
  return good;
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

template <class Unit>
void values_as(ScalarType type, std::span<std::uint64_t> words, const Unit& unit) {
  const auto value = [&](std::uint64_t word) {
    return unit(static_cast<double>(static_cast<std::int64_t>(word)));
  };
  if (type == ScalarType::float32) {
    for (std::uint64_t& it : words)
      it = std::bit_cast<std::uint32_t>(static_cast<float>(value(it)));
  } else {
    for (std::uint64_t& it : words) it = std::bit_cast<std::uint64_t>(value(it));
  }
}

}  // namespace

bool linear_indices(ScalarType type, std::span<const std::uint64_t> bits, const ValueDomain& domain,
                    std::span<std::int64_t> indices) {
  return type == ScalarType::float32 ? indices_as<std::uint32_t>(bits, domain, indices)
                                     : indices_as<std::uint64_t>(bits, domain, indices);
}

bool linear_values(ScalarType type, const ValueDomain& domain, std::span<std::uint64_t> words) {
  if (is_usual_binary(domain))
    values_as(type, words, [by = power_of_two(-domain.exponent)](double d) { return d * by; });
  else if (domain.kind == DomainKind::decimal && domain.exponent >= 0)
    values_as(type, words,
              [ten = kPowersOfTen[static_cast<std::size_t>(domain.exponent)]](double d) {
                return d / ten;
              });
  else
    return false;
  return true;
}

}  // namespace shm
