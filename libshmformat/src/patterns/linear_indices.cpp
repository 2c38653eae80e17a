#include "patterns/linear_indices.h"

#include <bit>
#include <cstddef>
#include <type_traits>

namespace shm {
namespace {

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
  if (domain.kind != DomainKind::binary || domain.exponent < -900 || domain.exponent > 900)
    return false;
  const auto power = [](std::int32_t of) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + of) << 52);
  };
  return indices_as<Bits>(
      bits, indices, [by = power(domain.exponent)](double v) { return v * by; },
      [by = power(-domain.exponent)](double d) { return d * by; });
}

template <class Bits>
void decimals_as(double ten, std::span<std::uint64_t> words) {
  using Float = std::conditional_t<sizeof(Bits) == 4, float, double>;
  for (std::uint64_t& it : words)
    it = std::bit_cast<Bits>(
        static_cast<Float>(static_cast<double>(static_cast<std::int64_t>(it)) / ten));
}

}  // namespace

bool linear_indices(ScalarType type, std::span<const std::uint64_t> bits, const ValueDomain& domain,
                    std::span<std::int64_t> indices) {
  return type == ScalarType::float32 ? indices_as<std::uint32_t>(bits, domain, indices)
                                     : indices_as<std::uint64_t>(bits, domain, indices);
}

bool linear_values(ScalarType type, const ValueDomain& domain, std::span<std::uint64_t> words) {
  if (domain.kind != DomainKind::decimal || domain.exponent < 0) return false;
  const double ten = kPowersOfTen[static_cast<std::size_t>(domain.exponent)];
  if (type == ScalarType::float32)
    decimals_as<std::uint32_t>(ten, words);
  else
    decimals_as<std::uint64_t>(ten, words);
  return true;
}

}  // namespace shm
