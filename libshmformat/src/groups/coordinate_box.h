// The ranges of coordinates, as the header of a group has them.
// spec: "Group"
#pragma once

#include <array>
#include <cstddef>

#include "model/schema.h"

namespace shm {

/// By axis, of `count` points, `stride` bytes apart: what range_of() says of each, in one pass.
std::array<ValueRange, 3> box_of(ScalarType type, const std::byte* points, std::size_t count,
                                 std::size_t stride);

}  // namespace shm
