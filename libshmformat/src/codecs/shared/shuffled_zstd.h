// Shuffled zstd: the bytes of all scalars, sorted by significance and compressed with zstd. For
// values that repeat in ways unrelated to the mesh.
// spec: "Values in shuffled_zstd"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace shm {

/// Returns byte 0 (the least significant) of all scalars of `width` bytes in order, then byte 1,
/// and so on. `values`: in host byte order.
std::vector<std::byte> shuffled(std::span<const std::byte> values, std::size_t width);

/// Returns the size of the shuffled bytes, followed by a zstd frame of them.
std::vector<std::byte> pack_shuffled(std::span<const std::byte> planes, int level);
/// Returns the values in host byte order; nothing if the data is damaged or larger than `limit`
/// bytes.
std::optional<std::vector<std::byte>> unpack_shuffled(std::span<const std::byte> bytes,
                                                      std::size_t width, std::uint64_t limit);

}  // namespace shm
