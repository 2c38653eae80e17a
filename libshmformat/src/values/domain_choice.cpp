#include "values/domain_choice.h"

#include <algorithm>
#include <bit>
#include <charconv>

namespace shm {
namespace {

/// A domain may miss one value in so many.
constexpr std::size_t kMostEscapeShare = 200;
constexpr std::size_t kSampled = 256;
/// Indices longer than this are hardly better than float64 numbers, or float32.
constexpr int kLongIndex = 40, kLongNarrowIndex = 24;

/// The i-th of `parts` that are spread over all: a product that sizes of 32 bits may not hold.
std::uint64_t at_part(std::span<const std::uint64_t> bits, std::size_t i, std::size_t parts) {
  return bits[static_cast<std::size_t>(std::uint64_t{i} * bits.size() / parts)];
}

/// Shortest decimal that reads back as the same number.
struct Decimal {
  std::int32_t digits = 0;    ///< significant ones
  std::int32_t decimals = 0;  ///< behind the point; negative: zeros before it
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
  Decimal it;
  const char* at = text;
  for (; at < end && *at != 'e'; ++at) it.digits += *at >= '0' && *at <= '9' ? 1 : 0;
  int exponent = 0;
  if (at < end) {
    ++at;
    if (at < end && *at == '+') ++at;
    std::from_chars(at, end, exponent);
  }
  it.decimals = it.digits - 1 - exponent;
  return it;
}

/// How well a domain fits.
struct DomainFit {
  bool good = false;
  int length = 0;  // of the longest index, in bits
};
DomainFit try_domain(const ArrayInfo& info, std::size_t component,
                     std::span<const std::uint64_t> bits, ValueDomain& domain) {
  if (!domain.fits(info)) return {};
  const ValueTranslator translator(info, component, domain);
  const std::uint64_t zero = negative_zero(info.type);
  std::size_t escapes = 0, negative = 0;
  std::uint64_t longest = 0;
  for (std::uint64_t it : bits) {
    if (is_float(info.type) && it == zero) {
      ++negative;
      continue;
    }
    const auto index = translator.index(it);
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

/// The multiple of a power of two that all finite values are.
std::int32_t binary_exponent(ScalarType type, std::span<const std::uint64_t> bits) {
  std::int32_t finest = -971;
  for (std::uint64_t it : bits) {
    const double value = scalar_as_double(type, it);
    if (value == 0.0 || !is_finite(value)) continue;
    const auto raw = std::bit_cast<std::uint64_t>(value);
    const std::uint64_t mantissa = raw & ((std::uint64_t{1} << 52) - 1);
    const auto biased = static_cast<std::int32_t>(raw >> 52 & 0x7ff);
    const std::int32_t zeros = mantissa == 0 ? 52 : std::countr_zero(mantissa);
    finest = std::max(finest, biased == 0 ? 1074 : 1075 - biased - zeros);
  }
  return finest;
}

/// What some of the values look like as decimals.
struct Shapes {
  std::int32_t decimals = -22, digits = 1;  // most, of those that are short
  bool are_short = true;                    // nearly all
};
Shapes shapes_of(const ArrayInfo& info, std::span<const std::uint64_t> bits) {
  Shapes shapes;
  const std::int32_t most_digits = info.type == ScalarType::float32 ? 7 : 15;
  std::size_t all = 0, long_ones = 0;
  const std::size_t looked = std::min(bits.size(), kSampled);
  for (std::size_t i = 0; i < looked; ++i) {
    const std::uint64_t it = at_part(bits, i, looked);
    const double value = scalar_as_double(info.type, it);
    if (value == 0.0 || !is_finite(value)) continue;
    ++all;
    const Decimal shape = shortest(info.type, it);
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

/// As multiples of a power of ten, or of two; length 64 where they are none.
struct LinearFit {
  ValueDomain domain;
  int length = 64;
};
LinearFit linear_domain(const ArrayInfo& info, std::size_t component,
                        std::span<const std::uint64_t> bits, const Shapes& shapes) {
  LinearFit best;
  if (shapes.are_short && shapes.decimals <= 22) {
    ValueDomain decimal{DomainKind::decimal, shapes.decimals, false, false};
    if (const DomainFit fit = try_domain(info, component, bits, decimal); fit.good)
      best = {decimal, fit.length};
  }
  ValueDomain binary{DomainKind::binary, binary_exponent(info.type, bits), false, false};
  if (const DomainFit fit = try_domain(info, component, bits, binary);
      fit.good && fit.length < best.length)
    best = {binary, fit.length};
  return best;
}

/// Whether so many values occur twice that a table may pay: by a sample.
bool repeats_often(std::span<const std::uint64_t> bits) {
  constexpr std::size_t kSample = 1024;
  if (bits.size() < 4 * kSample) return true;
  std::vector<std::uint64_t> sample;
  for (std::size_t i = 0; i < kSample; ++i) sample.push_back(at_part(bits, i, kSample));
  std::sort(sample.begin(), sample.end());
  const auto distinct = std::unique(sample.begin(), sample.end()) - sample.begin();
  return static_cast<std::size_t>(distinct) < kSample - kSample / 64;
}

/// Indices that occur, ascending; empty where they are too many to be worth a table.
std::vector<std::int64_t> table_of(const ArrayInfo& info, std::size_t component,
                                   std::span<const std::uint64_t> bits, const ValueDomain& domain) {
  std::vector<std::int64_t> table;
  if (!repeats_often(bits)) return table;
  const ValueTranslator translator(info, component, domain);
  table.reserve(bits.size());
  for (std::uint64_t it : bits)
    if (const auto index = translator.index(it)) table.push_back(*index);
  std::sort(table.begin(), table.end());
  table.erase(std::unique(table.begin(), table.end()), table.end());
  if (table.size() > bits.size() / 2 || table.size() > (std::size_t{1} << 19)) table.clear();
  return table;
}

}  // namespace

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
  if (info.quantization.bits > 0) {  // the sign of a zero is not promised
    const ValueTranslator translator(info, component, {DomainKind::quantized});
    const bool all = std::all_of(bits.begin(), bits.end(), [&](std::uint64_t it) {
      return translator.index(it).has_value();
    });
    return all ? ValueDomain{DomainKind::quantized} : ValueDomain();
  }
  const int longest = info.type == ScalarType::float32 ? kLongNarrowIndex : kLongIndex;
  // A sample tells most arrays that are none.
  std::vector<std::uint64_t> sample;
  for (std::size_t i = 0; i < kSampled; ++i) sample.push_back(at_part(bits, i, kSampled));
  const Shapes shapes = shapes_of(info, bits);
  if (linear_domain(info, component, sample, shapes).length <= longest)
    if (const LinearFit fit = linear_domain(info, component, bits, shapes);
        fit.length <= longest && fits_all({fit.domain.kind, fit.domain.exponent}))
      return {fit.domain.kind, fit.domain.exponent};
  if (info.type == ScalarType::float64 && fits_all({DomainKind::narrow}))
    return {DomainKind::narrow};
  return {};
}

std::vector<DomainPlan> domain_candidates(const ArrayInfo& info, std::size_t component,
                                          std::span<const std::uint64_t> bits) {
  std::vector<DomainPlan> plans;
  const auto add = [&](const ValueDomain& domain) { plans.push_back({domain, {}}); };
  if (!is_float(info.type) || info.quantization.bits > 0) {
    ValueDomain domain{is_float(info.type) ? DomainKind::quantized : DomainKind::integers, 0, false,
                       false};
    const DomainFit fit = try_domain(info, component, bits, domain);
    if (!fit.good) domain.escapes = true;
    add(domain);
    if (!is_float(info.type))
      if (auto table = table_of(info, component, bits, domain);
          !table.empty() && table.size() <= bits.size() / 8)
        plans.push_back({domain, std::move(table)});
    return plans;
  }

  const Shapes shapes = shapes_of(info, bits);
  const auto [linear, length] = linear_domain(info, component, bits, shapes);
  if (length < 53) add(linear);
  if (shapes.are_short && (length > shapes.digits * 10 / 3 + 6)) {
    ValueDomain significant{DomainKind::digits, shapes.digits, false, false};
    if (try_domain(info, component, bits, significant).good) add(significant);
  }
  if (plans.empty() || length > kLongNarrowIndex) {
    ValueDomain narrow{DomainKind::narrow, 0, false, false};
    if (info.type == ScalarType::float64 && try_domain(info, component, bits, narrow).good)
      add(narrow);
    else if (plans.empty() || info.type == ScalarType::float32 || length > kLongIndex)
      add(ValueDomain());
  }
  if (auto table = table_of(info, component, bits, plans[0].domain); !table.empty())
    plans.push_back({plans[0].domain, std::move(table)});
  return plans;
}

}  // namespace shm
