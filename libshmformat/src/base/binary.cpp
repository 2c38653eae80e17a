#include "base/binary.h"

#include <xxhash.h>

#include <algorithm>

#include "shm/limits.h"

namespace shm {

ReadLimits within_sizes(ReadLimits limits) {
  if constexpr (sizeof(std::size_t) < sizeof(std::uint64_t)) {
    constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
    for (std::uint64_t* limit : {&limits.max_chunk_bytes, &limits.max_group_bytes,
                                 &limits.max_extra_bytes, &limits.max_unpacked_bytes})
      *limit = std::min(*limit, kMostBytes);
    // The decoder needs about 100 bytes per active vertex. With this limit, all active vertices
    // need at most about 1.6 GiB.
    limits.max_active_vertices =
        std::min<std::uint64_t>(limits.max_active_vertices, std::uint64_t{1} << 24);
  }
  return limits;
}

std::uint32_t checksum(std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(XXH64(bytes.data(), bytes.size(), 0));
}

}  // namespace shm
