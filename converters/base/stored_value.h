// Converts stored scalar values of any type to text, and computes the distance between two values.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>

#include "shm/schema.h"

namespace shm::converters {

template <class T>
T load(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

// Returns the shortest decimal that reads back as the same number.
template <class T>
std::string number_text(T value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// Returns true if `value` is one of the fill values `fills`.
inline bool is_fill_value(std::span<const double> fills, double value) {
  return std::find(fills.begin(), fills.end(), value) != fills.end();
}

// Returns the same text as number_text(), but adds the bits of a NaN, e.g. "nan (0x7fc00000)".
std::string value_text(const std::byte* value, ScalarType type);

// Calls body(T{}), where T is the C++ type that corresponds to `type`, and returns its result.
template <class Body>
decltype(auto) with_scalar(ScalarType type, Body&& body) {
  switch (type) {
    case ScalarType::int8: return body(std::int8_t{});
    case ScalarType::uint8: return body(std::uint8_t{});
    case ScalarType::int16: return body(std::int16_t{});
    case ScalarType::uint16: return body(std::uint16_t{});
    case ScalarType::int32: return body(std::int32_t{});
    case ScalarType::uint32: return body(std::uint32_t{});
    case ScalarType::int64: return body(std::int64_t{});
    case ScalarType::uint64: return body(std::uint64_t{});
    case ScalarType::float32: return body(float{});
    case ScalarType::float64: break;
  }
  return body(double{});
}

double as_double(const std::byte* value, ScalarType type);

// Rule by which two numbers are compared.
// - Exact: the bits must be equal; numbers of two different types must have the same value.
// - Tolerant: the values must be equal (NaN equals NaN, -0.0 equals 0.0), or at least one of the
// types is floating-point and the values differ by at most `bound`.
struct Likeness {
  bool tolerant = false;
  double bound = 0;
};

// Returns nothing if the two numbers are equal according to `likeness`. Otherwise returns their
// distance. The distance is 0 if the values are equal but their bits differ, and infinity if at
// least one number is not finite.
std::optional<double> distance_of_unlike(const std::byte* a, ScalarType type_a, const std::byte* b,
                                         ScalarType type_b, const Likeness& likeness);

}  // namespace shm::converters
