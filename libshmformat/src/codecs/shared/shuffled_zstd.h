// Shuffled zstd: a codec that sorts the bytes of all scalars by significance and compresses them by
// zstd. It suits values whose repetitions are unrelated to the mesh.
// spec: "Values in shuffled_zstd"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace shm {

/// Returns byte 0 (the least significant byte) of all scalars in order, then byte 1 of all scalars,
/// and so on. `width`: number of bytes per scalar. `values` contains scalars in host byte order.
std::vector<std::byte> shuffled(std::span<const std::byte> values, std::size_t width);

/// Returns the packed data: the size of the shuffled bytes, followed by a zstd frame with these
/// bytes.
std::vector<std::byte> pack_shuffled(std::span<const std::byte> planes, int level);
/// Returns the unpacked values in host byte order. Returns nothing if the data is damaged or the
/// values are larger than `limit` bytes.
std::optional<std::vector<std::byte>> unpack_shuffled(std::span<const std::byte> bytes,
                                                      std::size_t width, std::uint64_t limit);

}  // namespace shm
