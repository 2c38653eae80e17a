#include "codecs/shared/value_domain.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

namespace shm {
namespace {

constexpr std::int32_t kMostBinary = 1074, kLeastBinary = -971;
constexpr std::int32_t kMostDecimal = 22;

/// Returns 2^-exponent. The exponent must be allowed in a domain. The result is denormal if the
/// exponent is 1023 or more.
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
    fills_ = info.fills;
    if (info.quantization.bits == Quantization::kRelative) {
      spacing_ = static_cast<std::uint64_t>(info.quantization.spacing);
      max_error_ = info.quantization.max_rel;
      return;
    }
    minimum_ = info.quantization.minimum[component];
    step_ = info.quantization.step();
    max_error_ = info.quantization.max_error(info.type);
  } else if (domain.kind == DomainKind::binary) {
    step_ = binary_step(domain.exponent);
  }
}

/// Returns the bits of the value with this index for a relative error bound. Damaged data may
/// contain any index, so the product may exceed the range of the type.
std::uint64_t ValueTranslator::relative_bits(std::int64_t index) const {
  const std::uint64_t sign = negative_zero(type_);
  const auto size = static_cast<std::uint64_t>(index < 0 ? minus(0, index) : index);
  return (size * spacing_ & (sign - 1)) | (index < 0 ? sign : 0);
}
std::int64_t ValueTranslator::relative_index(std::uint64_t bits_in) const {
  const std::uint64_t sign = negative_zero(type_);
  const auto size = static_cast<std::int64_t>(((bits_in & (sign - 1)) + spacing_ / 2) / spacing_);
  return (bits_in & sign) != 0 ? -size : size;
}

bool ValueTranslator::is_within_bound(double value, double restored) const {
  const double error = std::fabs(restored - value);
  return error <= (spacing_ > 0 ? max_error_ * std::fabs(value) : max_error_);
}

double ValueTranslator::linear_value(std::int64_t index) const {
  if (spacing_ > 0) return scalar_as_double(type_, relative_bits(index));
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
  if (spacing_ > 0) return relative_bits(index);
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
      if (std::find(fills_.begin(), fills_.end(), value) != fills_.end()) return std::nullopt;
      if (spacing_ > 0) {
        found = relative_index(bits_in);
        const double restored = scalar_as_double(type_, relative_bits(found));
        return is_within_bound(value, restored) ? std::optional(found) : std::nullopt;
      }
      const double scaled = (value - minimum_) / step_;
      if (!(std::fabs(scaled) < 4.0e15)) return std::nullopt;
      found = nearest_integer(scaled);
      const double restored = scalar_as_double(type_, bits(found));
      return is_within_bound(value, restored) ? std::optional(found) : std::nullopt;
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
  if (spacing_ > 0) {
    if (!(value == value)) return 0.0;
    return static_cast<double>(relative_index(
        type_ == ScalarType::float32 ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                                     : std::bit_cast<std::uint64_t>(value)));
  }
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

// --- encoder

namespace {

/// A domain is accepted if it contains nearly all values: at most n / 200 + 2 of n values may be
/// outside the domain.
constexpr std::size_t kMostEscapeShare = 200;
constexpr std::size_t kSampled = 256;
/// Index lengths in bits above which a domain saves little: kLongIndex for float64 values,
/// kLongNarrowIndex for float32 values.
constexpr int kLongIndex = 40, kLongNarrowIndex = 24;

/// Returns sample number `i` of `parts` samples that are evenly spread over `bits`. Uses 64-bit
/// numbers, since the product of `i` and the number of values may exceed 32 bits.
std::uint64_t at_part(std::span<const std::uint64_t> bits, std::size_t i, std::size_t parts) {
  return bits[static_cast<std::size_t>(std::uint64_t{i} * bits.size() / parts)];
}

/// Digit counts of the shortest decimal number that converts back to a given floating-point number.
struct Decimal {
  std::int32_t digits = 0;  ///< number of significant digits

  /// Number of digits after the decimal point. If it is negative, its magnitude is the number of
  /// trailing zeros before the point
  std::int32_t decimals = 0;
};
Decimal shortest(ScalarType type, std::uint64_t bits) {
  char text[64];
  const auto end = type == ScalarType::float32
                       ? std::to_chars(text, text + sizeof text,
                                       std::bit_cast<float>(static_cast<std::uint32_t>(bits)),
                                       std::chars_format::scientific)
                             .ptr
                       : std::to_chars(text, text + sizeof text, std::bit_cast<double>(bits),
                                       std::chars_format::scientific)
                             .ptr;
  Decimal decimal;
  const char* position = text;
  for (; position < end && *position != 'e'; ++position)
    decimal.digits += *position >= '0' && *position <= '9' ? 1 : 0;
  int exponent = 0;
  if (position < end) {
    ++position;
    if (position < end && *position == '+') ++position;
    std::from_chars(position, end, exponent);
  }
  decimal.decimals = decimal.digits - 1 - exponent;
  return decimal;
}

/// Result of testing a domain.
struct DomainTest {
  bool good = false;
  int length = 0;  // length of the longest index, in bits
};
DomainTest try_domain(const ArrayInfo& info, std::size_t component,
                      std::span<const std::uint64_t> bits, ValueDomain& domain) {
  if (!domain.fits(info)) return {};
  const ValueTranslator translator(info, component, domain);
  const std::uint64_t zero = negative_zero(info.type);
  std::size_t escapes = 0, negative = 0;
  std::uint64_t longest = 0;
  for (std::uint64_t value : bits) {
    if (is_float(info.type) && value == zero) {
      ++negative;
      continue;
    }
    const auto index = translator.index(value);
    if (!index) {
      if (++escapes > bits.size() / kMostEscapeShare + 2) return {};
      continue;
    }
    const auto same = static_cast<std::uint64_t>(*index);
    longest = std::max(longest, *index < 0 ? 0 - same : same);
  }
  const bool signs = domain.kind == DomainKind::binary || domain.kind == DomainKind::decimal ||
                     domain.kind == DomainKind::digits;
  domain.negative_zero = signs && negative > 0;
  domain.escapes = escapes > 0 || (!signs && negative > 0 && domain.kind == DomainKind::quantized);
  return {true, static_cast<int>(std::bit_width(longest))};
}

/// Returns the exponent e for which 2^-e is the largest power of two that divides all finite
/// values.
std::int32_t binary_exponent(ScalarType type, std::span<const std::uint64_t> bits) {
  std::int32_t finest = -971;
  for (std::uint64_t value_bits : bits) {
    const double value = scalar_as_double(type, value_bits);
    if (value == 0.0 || !is_finite(value)) continue;
    const auto raw = std::bit_cast<std::uint64_t>(value);
    const std::uint64_t mantissa = raw & ((std::uint64_t{1} << 52) - 1);
    const auto biased = static_cast<std::int32_t>(raw >> 52 & 0x7ff);
    const std::int32_t zeros = mantissa == 0 ? 52 : std::countr_zero(mantissa);
    finest = std::max(finest, biased == 0 ? 1074 : 1075 - biased - zeros);
  }
  return finest;
}

/// Lengths of the decimal notation of values, measured on a sample.
struct Shapes {
  // Largest number of decimals, and largest number of digits, among the sampled values with a short
  // decimal notation
  std::int32_t decimals = -22, digits = 1;
  bool are_short = true;  // true if nearly all values have a short decimal notation
};
Shapes shapes_of(const ArrayInfo& info, std::span<const std::uint64_t> bits) {
  Shapes shapes;
  const std::int32_t most_digits = info.type == ScalarType::float32 ? 7 : 15;
  std::size_t all = 0, long_ones = 0;
  const std::size_t looked = std::min(bits.size(), kSampled);
  for (std::size_t i = 0; i < looked; ++i) {
    const std::uint64_t value_bits = at_part(bits, i, looked);
    const double value = scalar_as_double(info.type, value_bits);
    if (value == 0.0 || !is_finite(value)) continue;
    ++all;
    const Decimal shape = shortest(info.type, value_bits);
    if (shape.digits > most_digits) {
      ++long_ones;
      continue;
    }
    shapes.decimals = std::max(shapes.decimals, shape.decimals);
    shapes.digits = std::max(shapes.digits, shape.digits);
  }
  shapes.are_short = long_ones <= all / 100;
  return shapes;
}

/// The domain with the shortest indices among the domains of multiples of a power of ten or two,
/// and the length of these indices in bits. If no domain is suitable, `length` is 64.
struct LinearCandidate {
  ValueDomain domain;
  int length = 64;
};
LinearCandidate linear_domain(const ArrayInfo& info, std::size_t component,
                              std::span<const std::uint64_t> bits, const Shapes& shapes) {
  LinearCandidate best;
  if (shapes.are_short && shapes.decimals <= 22) {
    ValueDomain decimal{DomainKind::decimal, shapes.decimals, false, false};
    if (const DomainTest test = try_domain(info, component, bits, decimal); test.good)
      best = {decimal, test.length};
  }
  ValueDomain binary{DomainKind::binary, binary_exponent(info.type, bits), false, false};
  if (const DomainTest test = try_domain(info, component, bits, binary);
      test.good && test.length < best.length)
    best = {binary, test.length};
  return best;
}

/// Returns true if enough values repeat that a table of values may reduce the size. Examines a
/// sample.
bool repeats_often(std::span<const std::uint64_t> bits) {
  constexpr std::size_t kSample = 1024;
  if (bits.size() < 4 * kSample) return true;
  std::vector<std::uint64_t> sample;
  for (std::size_t i = 0; i < kSample; ++i) sample.push_back(at_part(bits, i, kSample));
  std::sort(sample.begin(), sample.end());
  const auto distinct = std::unique(sample.begin(), sample.end()) - sample.begin();
  return static_cast<std::size_t>(distinct) < kSample - kSample / 64;
}

/// Returns a table of the distinct indices in the group, in ascending order. Returns an empty table
/// if a table would not reduce the size because there are too many distinct indices.
std::vector<std::int64_t> table_of(const ArrayInfo& info, std::size_t component,
                                   std::span<const std::uint64_t> bits, const ValueDomain& domain) {
  std::vector<std::int64_t> table;
  if (!repeats_often(bits)) return table;
  const ValueTranslator translator(info, component, domain);
  table.reserve(bits.size());
  for (std::uint64_t value : bits)
    if (const auto index = translator.index(value)) table.push_back(*index);
  std::sort(table.begin(), table.end());
  table.erase(std::unique(table.begin(), table.end()), table.end());
  if (table.size() > bits.size() / 2 || table.size() > (std::size_t{1} << 19)) table.clear();
  return table;
}

}  // namespace

void round_quantized(const ArrayInfo& info, std::size_t component, std::span<std::uint64_t> words) {
  const ValueTranslator translator(info, component, {DomainKind::quantized});
  for (std::uint64_t& word : words)
    if (const auto index = translator.index(word)) word = translator.bits(*index);
}

std::vector<std::byte> restored_values(const ArrayInfo& info, const std::byte* values,
                                       std::size_t stride, std::size_t count) {
  const std::size_t width = scalar_bytes(info.type), packed = width * info.components;
  std::vector<std::byte> restored(count * packed);
  for (std::size_t i = 0; i < count; ++i)
    std::memcpy(restored.data() + i * packed, values + i * stride, packed);
  if (!info.quantization.lossy()) return restored;
  std::vector<std::uint64_t> words(count);
  for (std::size_t c = 0; c < info.components; ++c) {
    for (std::size_t i = 0; i < count; ++i)
      words[i] = load_scalar(restored.data() + i * packed + c * width, width);
    round_quantized(info, c, words);
    for (std::size_t i = 0; i < count; ++i)
      store_scalar(restored.data() + i * packed + c * width, words[i], width);
  }
  return restored;
}

bool still_fits(const ArrayInfo& info, std::size_t component, const ValueDomain& domain,
                std::span<const std::uint64_t> bits) {
  ValueDomain now = domain;
  return try_domain(info, component, bits, now).good && now.escapes <= domain.escapes &&
         now.negative_zero <= domain.negative_zero;
}

ValueDomain evenly_spaced_domain(const ArrayInfo& info, std::size_t component,
                                 std::span<const std::uint64_t> bits) {
  const auto fits_all = [&](ValueDomain domain) {
    return still_fits(info, component, domain, bits);
  };
  if (!is_float(info.type)) return {DomainKind::integers};
  if (info.quantization.bits > 0) {  // quantization may change -0.0 to 0.0
    const ValueTranslator translator(info, component, {DomainKind::quantized});
    const bool all = std::all_of(bits.begin(), bits.end(), [&](std::uint64_t value) {
      return translator.index(value).has_value();
    });
    return all ? ValueDomain{DomainKind::quantized} : ValueDomain();
  }
  const int longest = info.type == ScalarType::float32 ? kLongNarrowIndex : kLongIndex;
  // Examine a sample first. If decimal and binary domains do not suit the array, the sample is
  // usually enough to show it.
  std::vector<std::uint64_t> sample;
  for (std::size_t i = 0; i < kSampled; ++i) sample.push_back(at_part(bits, i, kSampled));
  const Shapes shapes = shapes_of(info, bits);
  if (linear_domain(info, component, sample, shapes).length <= longest)
    if (const LinearCandidate fit = linear_domain(info, component, bits, shapes);
        fit.length <= longest && fits_all({fit.domain.kind, fit.domain.exponent}))
      return {fit.domain.kind, fit.domain.exponent};
  if (info.type == ScalarType::float64 && fits_all({DomainKind::narrow}))
    return {DomainKind::narrow};
  return {};
}

std::vector<DomainAndTable> domain_candidates(const ArrayInfo& info, std::size_t component,
                                              std::span<const std::uint64_t> bits) {
  std::vector<DomainAndTable> candidates;
  const auto add = [&](const ValueDomain& domain) { candidates.push_back({domain, {}}); };
  if (!is_float(info.type) || info.quantization.bits > 0) {
    ValueDomain domain{is_float(info.type) ? DomainKind::quantized : DomainKind::integers, 0, false,
                       false};
    const DomainTest test = try_domain(info, component, bits, domain);
    if (!test.good) domain.escapes = true;
    add(domain);
    if (!is_float(info.type))
      if (auto table = table_of(info, component, bits, domain);
          !table.empty() && table.size() <= bits.size() / 8)
        candidates.push_back({domain, std::move(table)});
    return candidates;
  }

  const Shapes shapes = shapes_of(info, bits);
  const auto [linear, length] = linear_domain(info, component, bits, shapes);
  if (length < 53) add(linear);
  if (shapes.are_short && (length > shapes.digits * 10 / 3 + 6)) {
    ValueDomain significant{DomainKind::digits, shapes.digits, false, false};
    if (try_domain(info, component, bits, significant).good) add(significant);
  }
  if (candidates.empty() || length > kLongNarrowIndex) {
    ValueDomain narrow{DomainKind::narrow, 0, false, false};
    if (info.type == ScalarType::float64 && try_domain(info, component, bits, narrow).good)
      add(narrow);
    else if (candidates.empty() || info.type == ScalarType::float32 || length > kLongIndex)
      add(ValueDomain());
  }
  if (auto table = table_of(info, component, bits, candidates[0].domain); !table.empty())
    candidates.push_back({candidates[0].domain, std::move(table)});
  return candidates;
}

}  // namespace shm
