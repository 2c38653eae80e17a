#include "bytes/checksum.h"

#include <xxhash.h>

namespace shm {

std::uint32_t checksum(std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(XXH64(bytes.data(), bytes.size(), 0));
}

}  // namespace shm
