// Damages a .shm file but keeps its checksums valid, so that the damage reaches the code that runs
// after the checksums have been verified. Splits the file into chunks, replaces numbers and texts
// in fields (support/file_fields.h), damages bitstreams, packed blobs or the contents of zstd
// frames, and removes or repeats chunks and parts of chunks. Then updates lengths, sequence numbers
// and checksums. An input of a fuzz target consists of one byte, whose meaning depends on the
// target, a file, and for fuzz_calls a script, whose bytes choose the calls.
#pragma once

#include <zstd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "shm/reader.h"
#include "support/file_fields.h"
#include "support/file_surgery.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace shm_fuzz {

using Bytes = std::vector<std::byte>;
using Random = std::minstd_rand;

/// Returns small limits for reading hostile files.
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
/// Mutates `bytes` without changing their length.
inline void mutate_in_place(Bytes& bytes) {
  const std::size_t size = bytes.size();
  mutate(bytes, 0);
  bytes.resize(size);
}

/// Unpacks a packed blob, damages its contents, and packs them again with one of the three packing
/// methods. Only the contents are damaged, not the packing itself.
inline void mutate_packed(Bytes& payload, std::size_t head, Random& random, std::size_t room) {
  if (payload.size() < head) return;
  shm::ByteReader in(std::span<const std::byte>(payload).subspan(head));
  auto blob = shm::get_packed(in, 1 << 20);
  if (!blob) return mutate(payload, room);
  mutate(*blob, room);
  shm::ByteWriter out;
  out.put_bytes(std::span<const std::byte>(payload).first(head));
  const auto method = static_cast<std::uint8_t>(random() % 4 == 0 ? 1 + random() % 2 : 0);
  out.put_u8(method);
  out.put_varint(blob->size());
  if (method == 2) out.put_u8(static_cast<std::uint8_t>(random() % 9));  // width of a plane, 0 to 8
  out.put_bytes(method == 0 ? *blob : shm::zstd_compress(*blob, 1));
  payload = std::move(out.bytes);
}

/// If `bytes` ends with a zstd frame, damages the contents of this frame. Returns false if it does
/// not.
inline bool mutate_frame(Bytes& bytes) {
  constexpr std::byte kMagic[] = {std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f},
                                  std::byte{0xfd}};
  const auto at = std::find_end(bytes.begin(), bytes.end(), std::begin(kMagic), std::end(kMagic));
  if (at == bytes.end()) return false;
  const std::span<const std::byte> frame(at, bytes.end());
  const auto size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (size > 1 << 16) return false;  // the content size is too large or unknown
  auto plain = shm::zstd_decompress(frame, size);
  if (!plain) return false;
  mutate_in_place(*plain);
  const Bytes packed = shm::zstd_compress(*plain, 1);
  bytes.erase(at, bytes.end());
  bytes.insert(bytes.end(), packed.begin(), packed.end());
  return true;
}

inline void mutate_stream(Bytes& stream, Random& random, std::size_t room) {
  if (random() % 2 == 0 && mutate_frame(stream)) return;
  mutate(stream, room);
}

/// Replaces a number or text in a field of chunk `c`, or, if `c` equals the number of chunks, in a
/// field of the file start or the trailer. Returns false if no field can be parsed.
inline bool mutate_field(shm::FileParts& parts, std::size_t c, Random& random) {
  const auto sections = shm::sections_of(parts, c);
  std::size_t count = 0;
  for (const shm::Section& section : sections) count += section.fields.size();
  if (count == 0) return false;
  std::size_t index = random() % count;
  for (const shm::Section& section : sections) {
    if (index < section.fields.size()) {
      section.put(parts, shm::changed(section, section.fields[index], random()));
      break;
    }
    index -= section.fields.size();
  }
  return true;
}

/// Changes the data of a group: removes, repeats or damages one of its bitstreams.
inline void mutate_group(shm::Chunk& chunk, Random& random, std::size_t room) {
  auto group = shm::take_group_apart(chunk);
  if (!group || group->streams.empty()) return mutate(chunk.payload, room);
  auto& header = group->header;
  const std::size_t s = random() % group->streams.size();
  switch (random() % 8) {
    case 0:
      header.streams.erase(header.streams.begin() + static_cast<std::ptrdiff_t>(s));
      group->streams.erase(group->streams.begin() + static_cast<std::ptrdiff_t>(s));
      break;
    case 1:
      if (chunk.payload.size() >= room) break;
      header.streams.push_back(header.streams[s]);
      group->streams.push_back(group->streams[s]);
      break;
    default:
      mutate_stream(group->streams[s], random, room);
      // Raise the limits that the group header states. Otherwise, decoding of damaged data would
      // often stop at one of these limits.
      if (random() % 2 == 0) {
        header.decoded_bytes = 1 << 22;
        header.vertices = header.vertices * 2 + 8;
        header.max_active_vertices = 1 << 16;
      }
  }
  chunk.payload = shm::put_group_together(std::move(*group));
}

/// Removes, repeats or damages one part of a chunk with step values.
inline void mutate_steps(shm::Chunk& chunk, Random& random, std::size_t room) {
  auto parts = shm::take_steps_apart(chunk);
  if (!parts) return mutate(chunk.payload, room);
  const std::size_t p = random() % parts->heads.size();
  switch (random() % 8) {
    case 0:
      if (parts->heads.size() == 1) break;
      parts->heads.erase(parts->heads.begin() + static_cast<std::ptrdiff_t>(p));
      parts->values.erase(parts->values.begin() + static_cast<std::ptrdiff_t>(p));
      break;
    case 1:
      if (chunk.payload.size() >= room / 2) break;
      parts->heads.push_back(parts->heads[p]);
      parts->values.push_back(parts->values[p]);
      break;
    default: mutate_stream(parts->values[p], random, room);
  }
  chunk.payload = shm::put_steps_together(std::move(*parts), chunk.header.version);
}

inline void mutate_chunk(shm::Chunk& chunk, Random& random, std::size_t room) {
  using shm::container::ChunkKind;
  constexpr std::size_t kVersion = 8;
  if (chunk.is(ChunkKind::group)) return mutate_group(chunk, random, room);
  if (chunk.is(ChunkKind::schema)) return mutate_packed(chunk.payload, kVersion, random, room);
  if (chunk.is(ChunkKind::step_values)) return mutate_steps(chunk, random, room);
  if (chunk.is(ChunkKind::extra) || chunk.is(ChunkKind::step_times) ||
      (chunk.is(ChunkKind::index) && chunk.header.version > 0))
    return mutate_packed(chunk.payload, 0, random, room);
  mutate(chunk.payload, room);
}

inline void mutate_file(shm::FileParts& parts, Random& random, std::size_t room) {
  auto& chunks = parts.chunks;
  const std::size_t index = random() % chunks.size();
  const auto place = chunks.begin() + static_cast<std::ptrdiff_t>(index);
  switch (random() % 16) {
    case 0: chunks.erase(place); break;
    case 1:
      if (chunks[index].bytes() < room) chunks.insert(place, shm::Chunk(*place));
      break;
    case 2: std::swap(chunks[index], chunks[random() % chunks.size()]); break;
    case 3: place->header.is_long = !place->header.is_long; break;
    default:
      if (random() % 2 == 0 || !mutate_field(parts, index, random))
        mutate_chunk(chunks[index], random, room);
  }
}

/// Returns a damaged copy of `file`, or no bytes if `file` is not a .shm file.
inline Bytes mutated_file(std::span<const std::byte> file, Random& random, std::size_t room) {
  auto parts = shm::take_apart(file);
  if (parts.chunks.empty()) return {};
  for (std::size_t n = random() % 3 + 1; n > 0 && !parts.chunks.empty(); --n)
    mutate_file(parts, random, room);
  if (random() % 4 != 0) shm::list_anew(parts);
  std::uint32_t sequence = 0;
  for (shm::Chunk& chunk : parts.chunks) chunk.header.sequence = sequence++;
  // Replaces a field of the index, or a field of another chunk so that it contradicts the index.
  const std::size_t chunks = parts.chunks.size();
  if (random() % 4 == 0)
    mutate_field(parts, random() % 2 == 0 && chunks > 0 ? chunks - 1 : random() % (chunks + 1),
                 random);
  return shm::put_together(std::move(parts), shm::Numbering::as_they_are);
}

/// Mutates an input for libFuzzer. `behind` is the size in bytes of the script that follows the
/// file, or 0.
inline std::size_t mutate_input(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                unsigned seed, std::size_t behind = 0) {
  Random random(seed);
  if (size < 2 || random() % 32 == 0) return LLVMFuzzerMutate(data, size, max_size);
  behind = std::min(behind, size - 1);
  std::uint8_t* const script = data + (size - behind);
  if (behind > 0 && random() % 2 == 0) {
    LLVMFuzzerMutate(script, behind,
                     // if the mutated script is shorter, the rest of the old script remains after
                     // it
                     behind);
    if (random() % 2 == 0) return size;
  }
  const Bytes file = mutated_file(std::as_bytes(std::span(data + 1, script)), random,
                                  max_size > size ? max_size - size : 0);
  if (file.empty() || 1 + file.size() + behind > max_size)
    return LLVMFuzzerMutate(data, size, max_size);
  if (behind == 0 && random() % 8 == 0) data[0] = static_cast<std::uint8_t>(random());
  std::memmove(data + 1 + file.size(), script, behind);
  std::memcpy(data + 1, file.data(), file.size());
  return 1 + file.size() + behind;
}

}  // namespace shm_fuzz
