#include "base/stored_value.h"

#include <cmath>
#include <limits>

namespace shm::converters {
namespace {

// Calls visit(value), where `value` has the C++ type that corresponds to `type`.
template <class Visit>
auto with_value(const std::byte* value, ScalarType type, Visit&& visit) {
  return with_scalar(type, [&](auto zero) { return visit(load<decltype(zero)>(value)); });
}

template <class Real, class Bits>
std::string nan_text(const std::byte* from) {
  char text[32];
  return "nan (0x" + std::string(text, std::to_chars(text, text + 32, load<Bits>(from), 16).ptr) +
         ")";
}

// An integer of any type, represented by its sign and its magnitude.
struct Whole {
  bool negative;
  std::uint64_t magnitude;
  bool operator==(const Whole&) const = default;
};

std::optional<Whole> whole(const std::byte* value, ScalarType type) {
  return with_value(value, type, [](auto number) -> std::optional<Whole> {
    if constexpr (std::is_floating_point_v<decltype(number)>) {
      constexpr double kBeyond = 0x1p64;
      const auto wide = static_cast<double>(number);
      if (!(std::fabs(wide) < kBeyond) || std::trunc(wide) != wide) return std::nullopt;
      return Whole{wide < 0, static_cast<std::uint64_t>(std::fabs(wide))};
    } else {
      const auto bits = static_cast<std::uint64_t>(number);
      return number < 0 ? Whole{true, 0 - bits} : Whole{false, bits};
    }
  });
}

bool same_number(const std::byte* a, ScalarType type_a, const std::byte* b, ScalarType type_b) {
  if (is_float(type_a) && is_float(type_b)) {
    const double x = as_double(a, type_a), y = as_double(b, type_b);
    return x == y || (std::isnan(x) && std::isnan(y));
  }
  const auto x = whole(a, type_a), y = whole(b, type_b);
  return x && y && *x == *y;
}

double distance(const std::byte* a, ScalarType type_a, const std::byte* b, ScalarType type_b) {
  if (!is_float(type_a) && !is_float(type_b)) {
    const auto x = whole(a, type_a), y = whole(b, type_b);
    // Subtract the magnitudes, because a double may be unable to represent the integers exactly.
    if (x->negative == y->negative)
      return static_cast<double>(x->magnitude > y->magnitude ? x->magnitude - y->magnitude
                                                             : y->magnitude - x->magnitude);
  }
  const double apart = std::fabs(as_double(a, type_a) - as_double(b, type_b));
  return std::isnan(apart) ? std::numeric_limits<double>::infinity() : apart;
}

}  // namespace

std::string value_text(const std::byte* value, ScalarType type) {
  return with_value(value, type, [&](auto number) {
    if constexpr (std::is_same_v<decltype(number), float>) {
      if (std::isnan(number)) return nan_text<float, std::uint32_t>(value);
    } else if constexpr (std::is_same_v<decltype(number), double>) {
      if (std::isnan(number)) return nan_text<double, std::uint64_t>(value);
    }
    return number_text(number);
  });
}

double as_double(const std::byte* value, ScalarType type) {
  return with_value(value, type, [](auto number) { return static_cast<double>(number); });
}

std::optional<double> distance_of_unlike(const std::byte* a, ScalarType type_a, const std::byte* b,
                                         ScalarType type_b, const Likeness& likeness) {
  if (type_a == type_b && std::memcmp(a, b, scalar_bytes(type_a)) == 0) return std::nullopt;
  const bool bits_count = type_a == type_b && !likeness.tolerant;
  if (same_number(a, type_a, b, type_b)) {
    if (bits_count) return 0;
    return std::nullopt;
  }
  const double apart = distance(a, type_a, b, type_b);
  const bool rounded = is_float(type_a) || is_float(type_b);
  if (likeness.tolerant && rounded && apart <= likeness.bound) return std::nullopt;
  return apart;
}

}  // namespace shm::converters
