// One number as it is stored, of any scalar type: its text, and how far it is from another one.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>

#include "shm/schema.h"

namespace shm::converters {

template <class T>
T load(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

// Shortest decimal that comes back as the same number.
template <class T>
std::string number_text(T value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// The same; of NaN also the bits, as in "nan (0x7fc00000)".
std::string value_text(const std::byte* value, ScalarType type);

// Calls `body(T{})` with the C++ type of `type`.
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

// When two numbers count as equal. Exact: the same bits; of two types, the same number. Tolerant:
// the same number (NaN is NaN, -0.0 is 0.0), or one of them is floating-point and they are at most
// `bound` apart.
struct Likeness {
  bool tolerant = false;
  double bound = 0;
};

// Nothing where the two count as equal, else how far they are apart: 0 for the same number in other
// bits, infinity where one of them is no finite number.
std::optional<double> distance_of_unlike(const std::byte* a, ScalarType type_a, const std::byte* b,
                                         ScalarType type_b, const Likeness& likeness);

}  // namespace shm::converters
