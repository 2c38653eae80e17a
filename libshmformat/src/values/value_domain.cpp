#include "values/value_domain.h"

#include <bit>
#include <cmath>

namespace shm {
namespace {

constexpr std::int32_t kMostBinary = 1074, kLeastBinary = -971;
constexpr std::int32_t kMostDecimal = 22;

/// 2^-exponent, for the exponents that a domain may have; denormal from 1023 on.
double binary_step(std::int32_t exponent) {
  return std::bit_cast<double>(exponent <= 1022 ? static_cast<std::uint64_t>(1023 - exponent) << 52
                                                : std::uint64_t{1} << (1074 - exponent));
}

}  // namespace

double scalar_as_double(ScalarType type, std::uint64_t bits) {
  switch (type) {
    case ScalarType::int8: return static_cast<double>(static_cast<std::int8_t>(bits));
    case ScalarType::uint8: return static_cast<double>(static_cast<std::uint8_t>(bits));
    case ScalarType::int16: return static_cast<double>(static_cast<std::int16_t>(bits));
    case ScalarType::uint16: return static_cast<double>(static_cast<std::uint16_t>(bits));
    case ScalarType::int32: return static_cast<double>(static_cast<std::int32_t>(bits));
    case ScalarType::uint32: return static_cast<double>(static_cast<std::uint32_t>(bits));
    case ScalarType::int64: return static_cast<double>(static_cast<std::int64_t>(bits));
    case ScalarType::uint64: return static_cast<double>(bits);
    case ScalarType::float32:
      return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    case ScalarType::float64: return std::bit_cast<double>(bits);
  }
  return 0.0;
}

bool ValueDomain::fits(const ArrayInfo& info) const {
  const bool quantized = info.quantization.bits > 0;
  switch (kind) {
    case DomainKind::floats: return is_float(info.type) && !quantized && exponent == 0;
    case DomainKind::narrow: return info.type == ScalarType::float64 && !quantized && exponent == 0;
    case DomainKind::binary:
      return is_float(info.type) && !quantized && exponent >= kLeastBinary &&
             exponent <= kMostBinary;
    case DomainKind::decimal:
      return is_float(info.type) && !quantized && exponent >= -kMostDecimal &&
             exponent <= kMostDecimal;
    case DomainKind::digits:
      return is_float(info.type) && !quantized && exponent >= 1 && exponent <= 15;
    case DomainKind::integers: return !is_float(info.type) && exponent == 0;
    case DomainKind::quantized: return quantized && exponent == 0;
  }
  return false;
}

ValueTranslator::ValueTranslator(const ArrayInfo& info, std::size_t component,
                                 const ValueDomain& domain)
    : type_(info.type), domain_(domain) {
  if (domain.kind == DomainKind::quantized) {
    minimum_ = info.quantization.minimum[component];
    step_ = info.quantization.step();
    max_error_ = info.quantization.max_error(info.type);
  } else if (domain.kind == DomainKind::binary) {
    step_ = binary_step(domain.exponent);
  }
}

double ValueTranslator::linear_value(std::int64_t index) const {
  const auto d = static_cast<double>(index);
  switch (domain_.kind) {
    case DomainKind::binary: return d * step_;
    case DomainKind::quantized: return minimum_ + d * step_;
    case DomainKind::decimal:
      return domain_.exponent >= 0 ? d / kPowersOfTen[static_cast<std::size_t>(domain_.exponent)]
                                   : d * kPowersOfTen[static_cast<std::size_t>(-domain_.exponent)];
    default: return d;
  }
}

std::uint64_t ValueTranslator::bits(std::int64_t index) const {
  const auto stored = [&](double value) -> std::uint64_t {
    return type_ == ScalarType::float32 ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                                        : std::bit_cast<std::uint64_t>(value);
  };
  switch (domain_.kind) {
    case DomainKind::floats:
      return type_ == ScalarType::float32 ? ordered_bits<std::uint32_t>(index)
                                          : ordered_bits<std::uint64_t>(index);
    case DomainKind::narrow: return stored(static_cast<double>(ordered_value<float>(index)));
    case DomainKind::digits: return stored(DecimalSpace{domain_.exponent}.state(index));
    case DomainKind::integers: return static_cast<std::uint64_t>(index);
    default: return stored(linear_value(index));
  }
}

std::optional<std::int64_t> ValueTranslator::index(std::uint64_t bits_in) const {
  if (domain_.kind == DomainKind::floats)
    return type_ == ScalarType::float32 ? ordered_index_of(static_cast<std::uint32_t>(bits_in))
                                        : ordered_index_of(bits_in);
  if (domain_.kind == DomainKind::integers) {
    if (type_ == ScalarType::uint64 && bits_in > static_cast<std::uint64_t>(kLargestIndex))
      return std::nullopt;
    std::int64_t value = static_cast<std::int64_t>(bits_in);
    const auto unused = static_cast<int>(64 - 8 * scalar_bytes(type_));
    if (is_signed_integer(type_)) value = static_cast<std::int64_t>(bits_in << unused) >> unused;
    if (value > kLargestIndex || value < -kLargestIndex) return std::nullopt;
    return value;
  }
  const double value = scalar_as_double(type_, bits_in);
  if (!is_finite(value)) return std::nullopt;
  std::int64_t found = 0;
  switch (domain_.kind) {
    case DomainKind::narrow: {
      const auto narrow = static_cast<float>(value);
      if (std::bit_cast<std::uint64_t>(static_cast<double>(narrow)) != bits_in) return std::nullopt;
      return ordered_index(narrow);
    }
    case DomainKind::quantized: {
      const double scaled = (value - minimum_) / step_;
      if (!(std::fabs(scaled) < 4.0e15)) return std::nullopt;
      found = nearest_integer(scaled);
      const double restored = scalar_as_double(type_, bits(found));
      if (!(std::fabs(restored - value) <= max_error_)) return std::nullopt;
      return found;
    }
    case DomainKind::binary: {
      const double scaled = value / step_;
      if (!(std::fabs(scaled) <= 9.0e15)) return std::nullopt;
      found = nearest_integer(scaled);
      break;
    }
    case DomainKind::decimal: {
      const double scaled = domain_.exponent >= 0
                                ? value * kPowersOfTen[static_cast<std::size_t>(domain_.exponent)]
                                : value / kPowersOfTen[static_cast<std::size_t>(-domain_.exponent)];
      if (!(std::fabs(scaled) <= 9.0e15)) return std::nullopt;
      found = nearest_integer(scaled);
      break;
    }
    default: found = DecimalSpace{domain_.exponent}.index(value); break;
  }
  if (bits(found) == bits_in) return found;
  if (found == 0 && domain_.negative_zero && bits_in == negative_zero(type_)) return 0;
  return std::nullopt;
}

double ValueTranslator::as_value(double state) const {
  return domain_.is_linear() ? linear_value(nearest_integer(state)) : state;
}

double ValueTranslator::from_value(double value) const {
  switch (domain_.kind) {
    case DomainKind::binary: return static_cast<double>(nearest_integer(value / step_));
    case DomainKind::decimal:
      return static_cast<double>(
          nearest_integer(domain_.exponent >= 0
                              ? value * kPowersOfTen[static_cast<std::size_t>(domain_.exponent)]
                              : value / kPowersOfTen[static_cast<std::size_t>(-domain_.exponent)]));
    case DomainKind::quantized:
      return static_cast<double>(nearest_integer((value - minimum_) / step_));
    default: return value;
  }
}

}  // namespace shm
