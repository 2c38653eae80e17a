// Functions that pack raw arrays with other compressors: zstd and, if it is available, Blosc. They
// work in memory, in the calling thread.
#pragma once

#include <zstd.h>
#ifdef SHM_HAS_BLOSC
#include <blosc.h>
#endif

#include <cstddef>
#include <span>
#include <stdexcept>

namespace shm::bench {

using Bytes = std::span<const std::byte>;
using Room = std::span<std::byte>;

inline std::size_t checked(std::size_t bytes, bool good) {
  if (!good) throw std::runtime_error("a compressor failed");
  return bytes;
}

inline std::size_t zstd_pack(Bytes in, Room out, int level) {
  const auto size = ZSTD_compress(out.data(), out.size(), in.data(), in.size(), level);
  return checked(size, !ZSTD_isError(size));
}
inline std::size_t zstd_unpack(Bytes in, Room out) {
  const auto size = ZSTD_decompress(out.data(), out.size(), in.data(), in.size());
  return checked(size, !ZSTD_isError(size));
}

/// to_planes() splits numbers of `width` bytes into byte planes: first the first bytes of all
/// numbers, then the second bytes of all numbers, and so on. from_planes() restores the numbers.
inline void to_planes(Bytes in, std::size_t width, std::byte* out) {
  const std::size_t count = in.size() / width;
  for (std::size_t b = 0; b < width; ++b)
    for (std::size_t i = 0; i < count; ++i) out[b * count + i] = in[i * width + b];
}
inline void from_planes(Bytes in, std::size_t width, std::byte* out) {
  const std::size_t count = in.size() / width;
  for (std::size_t b = 0; b < width; ++b)
    for (std::size_t i = 0; i < count; ++i) out[i * width + b] = in[b * count + i];
}

#ifdef SHM_HAS_BLOSC
/// Packs with Blosc at level 5, with byte planes and zstd, in the calling thread.
inline std::size_t blosc_pack(Bytes in, std::size_t width, Room out) {
  const int size = blosc_compress_ctx(5, BLOSC_SHUFFLE, width, in.size(), in.data(), out.data(),
                                      out.size(), "zstd", 0, 1);
  return checked(static_cast<std::size_t>(size), size > 0);
}
inline std::size_t blosc_unpack(Bytes in, Room out) {
  const int size = blosc_decompress_ctx(in.data(), out.data(), out.size(), 1);
  return checked(static_cast<std::size_t>(size), size >= 0);
}
#endif

}  // namespace shm::bench
