// One scalar of any type as a double, for ranges and boxes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "shm/schema.h"

namespace shm {

template <class T>
double scalar_as_double(const std::byte* values, std::size_t index) {
  T value;
  std::memcpy(&value, values + index * sizeof(T), sizeof(T));
  return static_cast<double>(value);
}

/// The `index`-th scalar of packed values in host order.
inline double scalar_value(ScalarType type, const std::byte* values, std::size_t index) {
  switch (type) {
    case ScalarType::int8: return scalar_as_double<std::int8_t>(values, index);
    case ScalarType::uint8: return scalar_as_double<std::uint8_t>(values, index);
    case ScalarType::int16: return scalar_as_double<std::int16_t>(values, index);
    case ScalarType::uint16: return scalar_as_double<std::uint16_t>(values, index);
    case ScalarType::int32: return scalar_as_double<std::int32_t>(values, index);
    case ScalarType::uint32: return scalar_as_double<std::uint32_t>(values, index);
    case ScalarType::int64: return scalar_as_double<std::int64_t>(values, index);
    case ScalarType::uint64: return scalar_as_double<std::uint64_t>(values, index);
    case ScalarType::float32: return scalar_as_double<float>(values, index);
    case ScalarType::float64: return scalar_as_double<double>(values, index);
  }
  return 0;
}

}  // namespace shm
