// Damage behind right checksums: takes a .shm file apart, damages chunks, group headers, bitstreams
// or packed blobs, and makes lengths, numbers and checksums anew, so that what lies behind them is
// reached. For the target that includes it, once. An input is one byte, which is the target's, and
// a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "../tests/file_surgery.h"
#include "packing.h"
#include "shm/reader.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace shm_fuzz {

using Bytes = std::vector<std::byte>;
using Random = std::minstd_rand;

/// What hostile files may ask for here.
inline shm::ReadLimits small_limits() {
  shm::ReadLimits limits;
  limits.max_active_vertices = 1 << 16;
  limits.max_chunk_bytes = limits.max_extra_bytes = 1 << 22;
  limits.max_group_bytes = 1 << 22;
  limits.max_arrays = limits.max_blocks = 256;
  return limits;
}

inline void mutate(Bytes& bytes, std::size_t room) {
  const std::size_t size = bytes.size();
  bytes.resize(size + std::min<std::size_t>(room, 64));
  if (bytes.empty()) return;
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), size, bytes.size()));
}

/// Damages what a packed blob holds, not its packing.
inline void mutate_packed(Bytes& payload, std::size_t head, std::size_t room) {
  if (payload.size() < head) return;
  shm::ByteReader in(std::span<const std::byte>(payload).subspan(head));
  auto blob = shm::get_packed(in, 1 << 20);
  if (!blob) return mutate(payload, room);
  mutate(*blob, room);
  shm::ByteWriter out;
  out.put_bytes(std::span<const std::byte>(payload).first(head));
  out.put_u8(0);
  out.put_varint(blob->size());
  out.put_bytes(*blob);
  payload = std::move(out.bytes);
}

inline void mutate_group(Bytes& payload, Random& random, std::size_t room) {
  auto group = shm::take_group_apart(payload);
  if (!group) return mutate(payload, room);
  auto& header = group->header;
  const std::size_t streams = group->streams.size();
  switch (random() % 8) {
    case 0: header.cells += static_cast<std::uint32_t>(random() % 5) - 2; break;
    case 1: header.vertices += random() % 5 - 2; break;
    case 2: header.loose_vertices += random() % 3 - 1; break;
    case 3: header.max_active_vertices = header.max_active_vertices * 2 + random() % 3; break;
    case 4:
      if (streams > 0) {
        const std::size_t s = random() % streams;
        header.streams.erase(header.streams.begin() + static_cast<std::ptrdiff_t>(s));
        group->streams.erase(group->streams.begin() + static_cast<std::ptrdiff_t>(s));
      }
      break;
    default:
      if (streams > 0) mutate(group->streams[random() % streams], room);
      // Room for what the damage makes.
      if (random() % 2 == 0) {
        header.decoded_bytes = 1 << 22;
        header.vertices = header.vertices * 2 + 8;
        header.max_active_vertices = 1 << 16;
      }
  }
  payload = shm::put_group_together(std::move(*group));
}

inline void mutate_chunk(shm::Chunk& chunk, Random& random, std::size_t room) {
  using shm::container::ChunkKind;
  if (random() % 32 == 0) {
    chunk.header.kind = static_cast<std::uint8_t>(random() % 8);
    chunk.header.flags = static_cast<std::uint8_t>(random() % 2);
    return;
  }
  if (chunk.is(ChunkKind::group)) return mutate_group(chunk.payload, random, room);
  if (chunk.is(ChunkKind::schema)) return mutate_packed(chunk.payload, 8, room);
  if (chunk.is(ChunkKind::extra) || chunk.is(ChunkKind::step_times))
    return mutate_packed(chunk.payload, 0, room);
  mutate(chunk.payload, room);
}

inline void mutate_file(shm::FileParts& parts, Random& random, std::size_t room) {
  auto& chunks = parts.chunks;
  const std::size_t at = random() % chunks.size();
  const auto place = chunks.begin() + static_cast<std::ptrdiff_t>(at);
  switch (random() % 16) {
    case 0: chunks.erase(place); break;
    case 1:
      if (chunks[at].payload.size() + shm::container::kChunkHeaderBytes < room)
        chunks.insert(place, shm::Chunk(*place));
      break;
    case 2: std::swap(chunks[at], chunks[random() % chunks.size()]); break;
    default: mutate_chunk(chunks[at], random, room);
  }
}

}  // namespace shm_fuzz

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned int seed) {
  using namespace shm_fuzz;
  Random random(seed);
  auto parts = shm::take_apart(std::as_bytes(std::span(data, size)).subspan(size > 0 ? 1 : 0));
  if (size < 2 || parts.chunks.empty() || random() % 32 == 0)
    return LLVMFuzzerMutate(data, size, max_size);
  for (std::size_t n = random() % 3 + 1; n > 0 && !parts.chunks.empty(); --n)
    mutate_file(parts, random, max_size > size ? max_size - size : 0);
  const Bytes bytes = shm::put_together(std::move(parts));
  if (bytes.size() + 1 > max_size) return LLVMFuzzerMutate(data, size, max_size);
  if (random() % 8 == 0) data[0] = static_cast<std::uint8_t>(random());
  std::memcpy(data + 1, bytes.data(), bytes.size());
  return bytes.size() + 1;
}
