// The checksum of chunk headers, payloads and bitstreams: low 32 bits of XXH64 with seed 0.
// spec: "Checksums"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace shm {

std::uint32_t checksum(std::span<const std::byte> bytes);

}  // namespace shm
