// Damage behind right checksums: takes a .shm file apart, damages chunks, group and step headers,
// the index, bitstreams, packed blobs or what zstd packs in them, and makes lengths, numbers and
// checksums anew, so that what lies behind them is reached. An input is one byte, which is the
// target's, a file, and as many bytes behind it as the target says (a script of calls).
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

#include "bytes/binary.h"
#include "bytes/packing.h"
#include "shm/reader.h"
#include "support/file_surgery.h"

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
/// Keeps the length.
inline void mutate_in_place(Bytes& bytes) {
  const std::size_t size = bytes.size();
  mutate(bytes, 0);
  bytes.resize(size);
}

/// A number that may stand in the place of another: near it, far from it, or a power of two.
template <class T>
void disturb(T& number, Random& random) {
  switch (random() % 6) {
    case 0: number = static_cast<T>(number + 1); break;
    case 1: number = static_cast<T>(number - 1); break;
    case 2: number = 0; break;
    case 3: number = static_cast<T>(number * 2 + random() % 3); break;
    case 4: number = static_cast<T>(std::uint64_t{1} << random() % 64); break;
    default: number = static_cast<T>(random() % 16);
  }
}

/// Damages what a packed blob holds, not its packing; packs it in one of the three ways.
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
  if (method == 2) out.put_u8(static_cast<std::uint8_t>(random() % 9));  // what planes it may be
  out.put_bytes(method == 0 ? *blob : shm::zstd_compress(*blob, 1));
  payload = std::move(out.bytes);
}

/// Damages what the last zstd frame in `bytes` holds, which ends where they end; false where there
/// is none.
inline bool mutate_frame(Bytes& bytes) {
  constexpr std::byte kMagic[] = {std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f},
                                  std::byte{0xfd}};
  const auto at = std::find_end(bytes.begin(), bytes.end(), std::begin(kMagic), std::end(kMagic));
  if (at == bytes.end()) return false;
  const std::span<const std::byte> frame(at, bytes.end());
  const auto size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (size > 1 << 16) return false;  // or not known
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

inline void mutate_header(shm::container::GroupHeader& header, Random& random) {
  switch (random() % 12) {
    case 0: header.cells += static_cast<std::uint32_t>(random() % 5) - 2; break;
    case 1: header.vertices += random() % 5 - 2; break;
    case 2: header.unused_vertices += random() % 3 - 1; break;
    case 3: header.max_active_vertices = header.max_active_vertices * 2 + random() % 3; break;
    case 4: disturb(header.first_cell, random); break;
    case 5: disturb(header.first_vertex, random); break;
    case 6: disturb(header.imported_vertices, random); break;
    case 7: disturb(header.decoded_bytes, random); break;
    case 8: header.box[random() % 6] *= random() % 2 == 0 ? -2 : 0; break;
    default:
      if (header.streams.empty()) break;
      auto& entry = header.streams[random() % header.streams.size()];
      switch (random() % 3) {
        case 0: entry.kind = static_cast<shm::container::StreamKind>(random() % 9); break;
        case 1: disturb(entry.array, random); break;
        default: entry.codec = static_cast<shm::container::Codec>(random() % 14);
      }
  }
}

inline void mutate_group(shm::Chunk& chunk, Random& random, std::size_t room) {
  Bytes& payload = chunk.payload;
  auto group = shm::take_group_apart(payload, chunk.header.version);
  if (!group) return mutate(payload, room);
  auto& header = group->header;
  const std::size_t streams = group->streams.size();
  switch (random() % 8) {
    case 0:
    case 1: mutate_header(header, random); break;
    case 2:
      if (streams > 0) {
        const std::size_t s = random() % streams;
        header.streams.erase(header.streams.begin() + static_cast<std::ptrdiff_t>(s));
        group->streams.erase(group->streams.begin() + static_cast<std::ptrdiff_t>(s));
      }
      break;
    case 3:
      if (streams > 0 && payload.size() < room) {
        const std::size_t s = random() % streams;
        header.streams.push_back(header.streams[s]);
        group->streams.push_back(group->streams[s]);
      }
      break;
    default:
      if (streams > 0) mutate_stream(group->streams[random() % streams], random, room);
      // Room for what the damage makes.
      if (random() % 2 == 0) {
        header.decoded_bytes = 1 << 22;
        header.vertices = header.vertices * 2 + 8;
        header.max_active_vertices = 1 << 16;
      }
  }
  payload = shm::put_group_together(std::move(*group));
}

inline void mutate_steps(shm::Chunk& chunk, Random& random, std::size_t room) {
  auto parts = shm::take_steps_apart(chunk);
  if (!parts) return mutate(chunk.payload, room);
  const std::size_t p = random() % parts->heads.size();
  shm::container::StepHeader& header = parts->heads[p].header;
  switch (random() % 12) {
    case 0: disturb(header.array, random); break;
    case 1: disturb(header.step, random); break;
    case 2: disturb(header.reference_step, random); break;
    case 3: header.trend = !header.trend; break;
    case 4: disturb(header.group, random); break;
    case 5: disturb(header.count, random); break;
    case 6: header.codec = static_cast<shm::container::Codec>(random() % 14); break;
    case 7:  // twice, or not at all
      if (random() % 2 == 0 && chunk.payload.size() < room / 2) {
        parts->heads.push_back(parts->heads[p]);
        parts->values.push_back(parts->values[p]);
      } else if (parts->heads.size() > 1) {
        parts->heads.erase(parts->heads.begin() + static_cast<std::ptrdiff_t>(p));
        parts->values.erase(parts->values.begin() + static_cast<std::ptrdiff_t>(p));
      }
      break;
    default: mutate_stream(parts->values[p], random, room);
  }
  chunk.payload = shm::put_steps_together(std::move(*parts), chunk.header.version);
}

inline void mutate_part(shm::container::StepEntry& part, Random& random) {
  switch (random() % 4) {
    case 0: disturb(part.array, random); break;
    case 1: disturb(random() % 2 == 0 ? part.step : part.count, random); break;
    case 2: disturb(part.group, random); break;
    default: part.reference = static_cast<shm::StepReference>(random() % 4);
  }
}

inline void mutate_entry(shm::container::IndexEntry& entry, Random& random) {
  if (!entry.parts.empty() && random() % 2 == 0) {
    if (random() % 8 == 0) entry.parts.resize(1 + random() % 4);
    return mutate_part(entry.parts[random() % entry.parts.size()], random);
  }
  switch (random() % 10) {
    case 0: entry.kind = static_cast<std::uint8_t>(random() % 8); break;
    case 1: disturb(entry.offset, random); break;
    case 2: disturb(entry.bytes, random); break;
    case 3: disturb(entry.segment, random); break;
    case 4: disturb(entry.first_cell, random); break;
    case 5: disturb(entry.cells, random); break;
    case 6: disturb(entry.first_vertex, random); break;
    case 7: disturb(entry.vertices, random); break;
    case 8: entry.box[random() % 6] *= -2; break;
    default: disturb(entry.header_bytes, random);
  }
}

inline void mutate_index(Bytes& payload, std::uint8_t version, Random& random, std::size_t room) {
  shm::ByteReader in(payload);
  shm::container::Index index;
  if (!shm::container::get(in, index, version, payload.size())) return mutate(payload, room);
  std::uint64_t* const sums[] = {
      &index.previous_index,      &index.vertices, &index.cells,    &index.hexahedra,
      &index.max_active_vertices, &index.steps,    &index.segments, &index.imported_vertices};
  auto& entries = index.entries;
  switch (random() % 8) {
    case 0: disturb(*sums[random() % std::size(sums)], random); break;
    case 1:
      if (!index.block_cells.empty())
        disturb(index.block_cells[random() % index.block_cells.size()], random);
      break;
    case 2:
      if (!index.streams.empty())
        disturb(index.streams[random() % index.streams.size()].bytes, random);
      break;
    case 3:
      if (!index.ranges.empty()) {
        auto& range = index.ranges[random() % index.ranges.size()];
        disturb(range.array, random);
      }
      break;
    case 4:
      if (!entries.empty())
        std::swap(entries[random() % entries.size()], entries[random() % entries.size()]);
      break;
    default:
      if (!entries.empty()) mutate_entry(entries[random() % entries.size()], random);
  }
  shm::ByteWriter out;
  shm::container::put(out, index);
  payload = std::move(out.bytes);
}

/// Says in the index what its chunks say now, where it has a line for each.
inline void make_index_anew(shm::FileParts& parts) {
  using shm::container::ChunkKind;
  shm::Chunk* const chunk = parts.find(ChunkKind::index);
  if (chunk == nullptr) return;
  shm::ByteReader in(chunk->payload);
  shm::container::Index index;
  if (!shm::container::get(in, index, chunk->header.version, chunk->payload.size())) return;
  const auto before = static_cast<std::size_t>(chunk - parts.chunks.data());
  index.entries.resize(before);
  std::uint64_t offset = shm::container::kFileStartBytes;
  for (std::size_t c = 0; c < before; ++c) {
    const shm::Chunk& it = parts.chunks[c];
    shm::container::IndexEntry& entry = index.entries[c];
    entry.kind = it.header.kind;
    entry.offset = offset;
    entry.bytes = it.bytes();
    entry.segment = it.header.segment;
    offset += entry.bytes;
    shm::ByteReader payload(it.payload);
    shm::container::GroupHeader group;
    entry.parts.clear();
    if (it.is(ChunkKind::group) && shm::container::get(payload, group, it.header.version)) {
      entry.first_cell = group.first_cell;
      entry.cells = group.cells;
      entry.first_vertex = group.first_vertex;
      entry.vertices = group.vertices;
      entry.box = group.box;
      entry.header_bytes = payload.position();
    } else if (it.is(ChunkKind::step_values)) {
      if (const auto steps = shm::take_steps_apart(it))
        for (const shm::container::StepPart& part : steps->heads)
          entry.parts.push_back(shm::container::entry_of(part.header));
      if (entry.parts.empty()) entry.parts.resize(1);
    }
  }
  shm::ByteWriter out;
  shm::container::put(out, index);
  chunk->payload = std::move(out.bytes);
}

/// Another schema that makes sense: what follows it does not fit.
inline void mutate_schema(Bytes& payload, Random& random, std::size_t room) {
  constexpr std::size_t kHead = 8;
  if (payload.size() < kHead || random() % 2 == 0)
    return mutate_packed(payload, kHead, random, room);
  shm::ByteReader in(std::span<const std::byte>(payload).subspan(kHead));
  const auto blob = shm::get_packed(in, 1 << 20);
  shm::Schema schema;
  if (!blob) return mutate(payload, room);
  shm::ByteReader words(*blob);
  if (!shm::get(words, schema, small_limits())) return mutate_packed(payload, kHead, random, room);
  const auto type = [&] { return static_cast<shm::ScalarType>(1 + random() % 10); };
  switch (random() % 10) {
    case 0: schema.order = static_cast<shm::Order>(random() % 3); break;
    case 1: schema.corner_order = !schema.corner_order; break;
    case 2: disturb(schema.delay, random); break;
    case 3: schema.coordinate_type = type(); break;
    case 4: schema.step_references = static_cast<shm::StepReference>(random() % 3); break;
    case 5:
      if (schema.blocks.empty()) break;
      disturb(schema.blocks[random() % schema.blocks.size()].nodes_per_cell, random);
      break;
    case 6: schema.blocks.emplace_back(); break;
    default:
      if (schema.arrays.empty()) break;
      shm::ArrayInfo& info = schema.arrays[random() % schema.arrays.size()];
      switch (random() % 5) {
        case 0: info.type = type(); break;
        case 1: disturb(info.components, random); break;
        case 2: info.per_step = !info.per_step; break;
        case 3: info.location = static_cast<shm::Location>(random() % 2); break;
        default:
          info.quantization.bits = static_cast<std::uint32_t>(random() % 65);
          info.quantization.maximum.resize(info.quantization.minimum.size());
      }
  }
  payload = shm::schema_payload(schema);
}

inline void mutate_chunk(shm::Chunk& chunk, Random& random, std::size_t room) {
  using shm::container::ChunkKind;
  if (random() % 32 == 0) {
    chunk.header.kind = static_cast<std::uint8_t>(random() % 10);
    chunk.header.flags = static_cast<std::uint8_t>(random() % 2);
    return;
  }
  if (random() % 32 == 0) return disturb(chunk.header.segment, random);
  if (chunk.is(ChunkKind::group)) return mutate_group(chunk, random, room);
  if (chunk.is(ChunkKind::schema)) return mutate_schema(chunk.payload, random, room);
  if (chunk.is(ChunkKind::step_values)) return mutate_steps(chunk, random, room);
  if (chunk.is(ChunkKind::extra) || chunk.is(ChunkKind::step_times))
    return mutate_packed(chunk.payload, 0, random, room);
  mutate(chunk.payload, room);
}

inline void mutate_file(shm::FileParts& parts, Random& random, std::size_t room) {
  auto& chunks = parts.chunks;
  const std::size_t at = random() % chunks.size();
  const auto place = chunks.begin() + static_cast<std::ptrdiff_t>(at);
  switch (random() % 16) {
    case 0: chunks.erase(place); break;
    case 3: place->header.is_long = !place->header.is_long; break;
    case 1:
      if (chunks[at].bytes() < room) chunks.insert(place, shm::Chunk(*place));
      break;
    case 2: std::swap(chunks[at], chunks[random() % chunks.size()]); break;
    default: mutate_chunk(chunks[at], random, room);
  }
}

/// Of a file; nothing where it is none.
inline Bytes mutated_file(std::span<const std::byte> file, Random& random, std::size_t room) {
  auto parts = shm::take_apart(file);
  if (parts.chunks.empty()) return {};
  for (std::size_t n = random() % 3 + 1; n > 0 && !parts.chunks.empty(); --n)
    mutate_file(parts, random, room);
  if (random() % 4 != 0) make_index_anew(parts);
  if (shm::Chunk* index = parts.find(shm::container::ChunkKind::index);
      index != nullptr && random() % 4 == 0)
    mutate_index(index->payload, index->header.version, random, room);
  return shm::put_together(std::move(parts));
}

/// A mutator for libFuzzer. `behind`: bytes behind the file.
inline std::size_t mutate_input(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                unsigned seed, std::size_t behind = 0) {
  Random random(seed);
  if (size < 2 || random() % 32 == 0) return LLVMFuzzerMutate(data, size, max_size);
  behind = std::min(behind, size - 1);
  std::uint8_t* const script = data + (size - behind);
  if (behind > 0 && random() % 2 == 0) {
    LLVMFuzzerMutate(script, behind, behind);  // where it gets shorter, what was there stays
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
