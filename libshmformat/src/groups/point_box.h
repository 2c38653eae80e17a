// The box of points: of all vertices that come and go.
// spec: "Groups"
#pragma once

#include <array>
#include <cstddef>

#include "model/schema.h"

namespace shm {

/// The smallest and the largest finite coordinate of `count` points, `stride` bytes apart, by axis.
std::array<ValueRange, 3> box_of(ScalarType type, const std::byte* points, std::size_t count,
                                 std::size_t stride);

}  // namespace shm
