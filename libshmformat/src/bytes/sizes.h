// Sizes: counts of the format have 64 bits, sizes in memory on some machines 32. Whatever a file
// says passes the limits of its reader before it becomes a size, and these are kept within what
// sizes can say.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "shm/reader.h"

namespace shm {

/// The number as a size, or the largest size where it is larger than any.
inline std::size_t to_size(std::uint64_t number) {
  return static_cast<std::size_t>(
      std::min<std::uint64_t>(number, std::numeric_limits<std::size_t>::max()));
}

/// The same limits where sizes have 64 bits. Where they have 32, at most 1 GiB each: what asks for
/// more is over_limit, however much its caller allows.
inline ReadLimits within_sizes(ReadLimits limits) {
  if constexpr (sizeof(std::size_t) < sizeof(std::uint64_t)) {
    constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
    for (std::uint64_t* it :
         {&limits.max_chunk_bytes, &limits.max_group_bytes, &limits.max_extra_bytes})
      *it = std::min(*it, kMostBytes);
    // Some 100 bytes are kept of each.
    limits.max_active_vertices =
        std::min<std::uint64_t>(limits.max_active_vertices, std::uint64_t{1} << 24);
  }
  return limits;
}

}  // namespace shm
