// Shuffled zstd: a codec that rearranges the bytes of all scalars by significance, and compresses
// the result by zstd. It suits values that repeat, but in a way unrelated to the mesh.
// spec: "Values in shuffled_zstd"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace shm {

/// Returns the rearranged bytes: byte 0 (the least significant byte) of all scalars, then byte 1 of
/// all scalars, and so on. `width`: number of bytes per scalar. `values` contains scalars in host
/// byte order.
std::vector<std::byte> shuffled(std::span<const std::byte> values, std::size_t width);

/// Returns the packed data: the size of `planes` in bytes, followed by a zstd frame that contains
/// `planes`.
std::vector<std::byte> pack_shuffled(std::span<const std::byte> planes, int level);
/// Returns the unpacked values in host byte order. Returns nothing if the data is damaged, or if
/// the unpacked values exceed `limit` bytes.
std::optional<std::vector<std::byte>> unpack_shuffled(std::span<const std::byte> bytes,
                                                      std::size_t width, std::uint64_t limit);

}  // namespace shm
