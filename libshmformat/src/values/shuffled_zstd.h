// Shuffled zstd: scalars with their bytes sorted by significance, under zstd: for values that
// repeat in no order that the mesh has.
// spec: "Values in shuffled_zstd"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace shm {

/// Byte 0, the least significant one, of all scalars of `width` bytes in order, then byte 1, ...
/// `values`: in host order.
std::vector<std::byte> shuffled(std::span<const std::byte> values, std::size_t width);

/// What is shuffled: its size, then a zstd frame.
std::vector<std::byte> pack_shuffled(std::span<const std::byte> planes, int level);
/// The values in host order; nothing for damaged data, and for more than `limit` bytes.
std::optional<std::vector<std::byte>> unpack_shuffled(std::span<const std::byte> bytes,
                                                      std::size_t width, std::uint64_t limit);

}  // namespace shm
