// Components of an array that have equal values, for example the components xy and yx of a
// symmetric tensor. Such a component is stored as a copy of an earlier component.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "shm/schema.h"

namespace shm {

/// Returns the first component before `component` that has the same bits in all elements and is
/// rounded in the same way. Returns nothing if no component does. `stride`: number of bytes from an
/// element to the next.
std::optional<std::size_t> equal_component(const ArrayInfo& info, const std::byte* values,
                                           std::size_t stride, std::size_t count,
                                           std::size_t component);

}  // namespace shm
