// Components of an array that have equal values, for example the components xy and yx of a
// symmetric tensor. The codecs `differences`, `terms` and `weighted` store such a component as a
// copy: instead of its head, the byte kCopiedComponent and the number of an earlier component, the
// source.
// spec: "Values as differences", "Values by terms", "Weighted values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "base/binary.h"
#include "shm/schema.h"

namespace shm {

/// Frozen: part of the format. The head of a component that is not a copy never has this value.
inline constexpr std::uint8_t kCopiedComponent = 7;

/// Returns the first component before `component` that has the same bits in all elements and is
/// rounded in the same way. Returns nothing if no component does. `stride`: number of bytes from an
/// element to the next.
std::optional<std::size_t> equal_component(const ArrayInfo& info, const std::byte* values,
                                           std::size_t stride, std::size_t count,
                                           std::size_t component);

void put_copy(ByteWriter& out, std::size_t source);
/// Reads the source of a copy, after kCopiedComponent has been read. Returns nothing if the source
/// is not a component before `component`.
std::optional<std::size_t> get_source(ByteReader& in, std::size_t component);

}  // namespace shm
