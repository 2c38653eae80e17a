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
