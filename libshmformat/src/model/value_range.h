// ValueRange: smallest and largest finite value of each component of an array, as the index tells
// them. spec: "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>

#include "container/format.h"
#include "shm/schema.h"

namespace shm {

struct ValueRange {
  double minimum, maximum;  ///< infinity and its opposite where nothing is finite
};
/// Of `count` scalars, `stride` bytes apart. Integers are rounded to doubles.
ValueRange range_of(ScalarType type, const std::byte* values, std::size_t count,
                    std::size_t stride);

/// Of `count` elements of an array of the schema, `stride` bytes apart.
container::ArrayRange range_of_array(const Schema& schema, std::uint32_t array,
                                     const std::byte* values, std::size_t count,
                                     std::size_t stride);

}  // namespace shm
