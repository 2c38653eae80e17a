// Appends a number to packed values of any scalar type. Used by tests of columns.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "shm/schema.h"

namespace shm {

/// Appends `value` to the bytes, converted to `type`. For an unsigned type, appends the absolute
/// value.
template <class Value>
void append_value(std::vector<std::byte>& to, ScalarType type, Value value) {
  const auto put = [&](auto converted) {
    const std::size_t offset = to.size();
    to.resize(offset + sizeof converted);
    std::memcpy(to.data() + offset, &converted, sizeof converted);
  };
  switch (type) {
    case ScalarType::int8: put(static_cast<std::int8_t>(value)); break;
    case ScalarType::uint8: put(static_cast<std::uint8_t>(std::fabs(value))); break;
    case ScalarType::int16: put(static_cast<std::int16_t>(value)); break;
    case ScalarType::uint16: put(static_cast<std::uint16_t>(std::fabs(value))); break;
    case ScalarType::int32: put(static_cast<std::int32_t>(value)); break;
    case ScalarType::uint32: put(static_cast<std::uint32_t>(std::fabs(value))); break;
    case ScalarType::int64: put(static_cast<std::int64_t>(value)); break;
    case ScalarType::uint64: put(static_cast<std::uint64_t>(std::fabs(value))); break;
    case ScalarType::float32: put(static_cast<float>(value)); break;
    case ScalarType::float64: put(static_cast<double>(value)); break;
  }
}

}  // namespace shm
