// FileSurgery: splits a .shm file into chunks, and builds a file from changed chunks. Lengths,
// sequence numbers and checksums are corrected. A reader therefore does not refuse the changed file
// because of a checksum, so that its other checks are tested.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "format/format.h"
#include "format/schema.h"
#include "shm/io.h"
#include "shm/summary.h"

namespace shm {

struct Chunk {
  container::ChunkHeader header;
  std::vector<std::byte> payload;  ///< of an index, without the trailer

  bool is(container::ChunkKind kind) const {
    return header.kind == static_cast<std::uint8_t>(kind);
  }
  bool has_trailer() const {
    return is(container::ChunkKind::index) && container::has_trailer_inside(header.version);
  }
  std::size_t bytes() const {
    return header.bytes() + payload.size() + (has_trailer() ? container::kTrailerBytes : 0);
  }
};

struct FileParts {
  container::FileStart start;
  std::vector<std::byte> members;  ///< if the file is an archive: the bytes of all members, without
                                   ///< the list of members
  std::vector<Chunk> chunks;
  /// Offset of the index that the trailer states. If it is not set, last_offset() is used.
  std::optional<std::uint64_t> index_offset{};

  /// Returns the offset of the last chunk, or 0 if the file has no chunks.
  std::uint64_t last_offset() const {
    if (chunks.empty()) return 0;
    std::uint64_t offset = container::kFileStartBytes + members.size();
    for (std::size_t c = 0; c + 1 < chunks.size(); ++c) offset += chunks[c].bytes();
    return offset;
  }

  Chunk* find(container::ChunkKind kind, std::size_t nth = 0) {
    for (Chunk& chunk : chunks)
      if (chunk.is(kind) && nth-- == 0) return &chunk;
    return nullptr;
  }
};

/// Splits a file into its chunks, as far as they can be found. Does not verify checksums, so that
/// damaged files can be split, too.
inline FileParts take_apart(std::span<const std::byte> bytes) {
  FileParts parts;
  ByteReader in(bytes);
  container::get(in, parts.start);
  if ((parts.start.needed_features & container::kArchiveFeature) != 0 &&
      in.left() >= container::kTrailerBytes) {
    ByteReader end(bytes.last(container::kTrailerBytes));
    std::uint64_t list = 0;
    if (container::get_trailer(end, list) && list >= in.position() && list <= bytes.size()) {
      const auto members = in.get_bytes(list - in.position());
      parts.members.assign(members.begin(), members.end());
    }
  }
  while (in.left() >= container::kShortHeaderBytes) {
    Chunk chunk;
    if (container::get(in, chunk.header) == container::HeaderState::bad_mark) break;
    const auto payload =
        in.get_bytes(std::min<std::uint64_t>(chunk.header.payload_bytes, in.left()));
    chunk.payload.assign(payload.begin(), payload.end());
    if (chunk.has_trailer() && chunk.payload.size() >= container::kTrailerBytes)
      chunk.payload.resize(chunk.payload.size() - container::kTrailerBytes);
    parts.chunks.push_back(std::move(chunk));
  }
  return parts;
}

enum class Numbering { anew, as_they_are };

/// Builds a file from its parts. Recomputes the lengths, the checksums and the trailer. With
/// Numbering::anew, also recomputes the sequence numbers.
inline std::vector<std::byte> put_together(FileParts parts, Numbering numbering = Numbering::anew) {
  ByteWriter out;
  container::put(out, parts.start);
  out.put_bytes(parts.members);
  std::uint32_t sequence = 0;
  for (Chunk& chunk : parts.chunks) {
    if (numbering == Numbering::anew) chunk.header.sequence = sequence++;
    if (chunk.has_trailer()) {
      ByteWriter trailer;
      const bool is_last = &chunk == &parts.chunks.back();
      container::put_trailer(
          trailer, is_last ? parts.index_offset.value_or(out.bytes.size()) : out.bytes.size());
      chunk.payload.insert(chunk.payload.end(), trailer.bytes.begin(), trailer.bytes.end());
    }
    chunk.header.payload_bytes = chunk.payload.size();
    chunk.header.payload_checksum = checksum(chunk.payload);
    chunk.header.is_long |= container::has_long_header(chunk.header, parts.start);
    container::put(out, chunk.header);
    out.put_bytes(chunk.payload);
  }
  if (parts.chunks.empty() || !parts.chunks.back().has_trailer())
    container::put_trailer(out, parts.index_offset.value_or(parts.last_offset()));
  return std::move(out.bytes);
}

/// Returns the index in version 0, converted from `index`. Precondition: `index` is the index of
/// the file `bytes`.
inline container::Index as_version_0(container::Index index, std::span<const std::byte> bytes) {
  if (index.version == 0) return index;
  index.version = 0;
  MemoryRandomSource source(bytes);
  const auto summary = read_summary(source);
  if (!summary) return index;
  for (const auto& [name, size] : summary->totals.streams)
    if (name != "container") index.streams.push_back({name, size});
  return index;
}

/// Returns a copy of the file in which `change` has changed the index and its checksum has been
/// corrected. `change` may also change the version of the index. Precondition: the file has an
/// index.
inline std::vector<std::byte> with_index(std::span<const std::byte> bytes,
                                         const std::function<void(container::Index&)>& change) {
  FileParts parts = take_apart(bytes);
  Chunk* chunk = parts.find(container::ChunkKind::index);
  ByteReader in(chunk->payload);
  container::Index index;
  container::get(in, index, chunk->header.version, parts.chunks.size());
  change(index);
  ByteWriter out;
  container::put(out, index);
  chunk->header.version = index.version;
  chunk->payload = std::move(out.bytes);
  return put_together(parts);
}
/// Returns the index entry of the n-th chunk of this kind, where n is counted from 0. Precondition:
/// the index has more than n entries of this kind.
inline container::IndexEntry& entry_of(container::Index& index, container::ChunkKind kind,
                                       std::size_t n) {
  const auto of_kind = [&](const container::IndexEntry& entry) {
    return entry.kind == static_cast<std::uint8_t>(kind) && n-- == 0;
  };
  return *std::find_if(index.entries.begin(), index.entries.end(), of_kind);
}

/// The payload of a group, split into its header and its bitstreams.
struct GroupParts {
  container::GroupHeader header;
  std::vector<std::vector<std::byte>> streams;
};

inline std::optional<GroupParts> take_group_apart(std::span<const std::byte> payload,
                                                  std::uint8_t version) {
  GroupParts parts;
  ByteReader in(payload);
  if (!container::get(in, parts.header, version)) return std::nullopt;
  for (const container::StreamEntry& entry : parts.header.streams) {
    const auto bytes = in.get_bytes(std::min<std::uint64_t>(entry.bytes, in.left()));
    parts.streams.emplace_back(bytes.begin(), bytes.end());
  }
  return parts;
}

inline std::optional<GroupParts> take_group_apart(const Chunk& chunk) {
  return take_group_apart(chunk.payload, chunk.header.version);
}

/// Builds the payload of a group. Recomputes the lengths and checksums of the bitstreams in the
/// header.
inline std::vector<std::byte> put_group_together(GroupParts parts) {
  for (std::size_t s = 0; s < parts.streams.size(); ++s) {
    parts.header.streams[s].bytes = parts.streams[s].size();
    parts.header.streams[s].checksum = checksum(parts.streams[s]);
  }
  ByteWriter out;
  container::put(out, parts.header);
  for (const auto& stream : parts.streams) out.put_bytes(stream);
  return std::move(out.bytes);
}

/// The payload of a chunk of step values, split into the headers and the bytes of its parts.
struct StepPayload {
  std::vector<container::StepPart> heads;
  std::vector<std::vector<std::byte>> values;
};

inline std::optional<StepPayload> take_steps_apart(const Chunk& chunk) {
  StepPayload parts;
  ByteReader in(chunk.payload);
  if (!container::get(in, parts.heads, chunk.header.version, chunk.payload.size()))
    return std::nullopt;
  for (const container::StepPart& head : parts.heads) {
    const auto bytes = in.get_bytes(head.bytes);
    parts.values.emplace_back(bytes.begin(), bytes.end());
  }
  return parts;
}

/// Returns the headers of all parts of step values in a file.
inline std::vector<container::StepHeader> step_headers_of(std::span<const std::byte> bytes) {
  std::vector<container::StepHeader> headers;
  for (const Chunk& chunk : take_apart(bytes).chunks) {
    if (!chunk.is(container::ChunkKind::step_values)) continue;
    const auto parts = take_steps_apart(chunk);
    if (!parts) continue;
    for (const container::StepPart& part : parts->heads) headers.push_back(part.header);
  }
  return headers;
}

/// Builds the payload of a chunk of step values. Recomputes the lengths of the parts.
inline std::vector<std::byte> put_steps_together(StepPayload parts, std::uint8_t version) {
  for (std::size_t p = 0; p < parts.heads.size(); ++p)
    parts.heads[p].bytes = parts.values[p].size();
  ByteWriter out;
  container::put(out, parts.heads, version);
  for (const auto& values : parts.values) out.put_bytes(values);
  return std::move(out.bytes);
}

/// Changes the header of the first part of a chunk. Precondition: the chunk contains step values.
inline void change_step_header(Chunk& chunk,
                               const std::function<void(container::StepHeader&)>& change) {
  auto parts = take_steps_apart(chunk);
  change(parts->heads[0].header);
  chunk.payload = put_steps_together(std::move(*parts), chunk.header.version);
}

/// Returns a packed blob of method 1 (zstd) that contains `head` followed by `zeros` zero bytes.
/// The zeros are stored as runs of 128 KB, each of which needs four bytes.
inline std::vector<std::byte> packed_zeros(std::span<const std::byte> head, std::uint64_t zeros) {
  constexpr std::uint64_t kRun = std::uint64_t{1} << 17;
  ByteWriter out;
  out.put_u8(1);
  out.put_varint(head.size() + zeros);
  out.put_u32(0xfd2fb528u);
  out.put_u8(0xc0);  // frame descriptor: an 8-byte content size, and a window byte
  out.put_u8(7 << 3);
  out.put_u64(head.size() + zeros);
  const auto put_block = [&](std::uint32_t type, std::uint64_t size, bool last) {
    const auto header = static_cast<std::uint32_t>(size << 3 | type << 1 | (last ? 1u : 0u));
    for (int i = 0; i < 3; ++i) out.put_u8(static_cast<std::uint8_t>(header >> (8 * i)));
  };
  if (!head.empty()) put_block(0, head.size(), zeros == 0);
  out.put_bytes(head);
  for (std::uint64_t left = zeros; left > 0;) {
    const std::uint64_t run = std::min(left, kRun);
    left -= run;
    put_block(1, run, left == 0);
    out.put_u8(0);
  }
  return std::move(out.bytes);
}

/// Rebuilds the list of chunks in the index chunk `c` from those chunks before it that are
/// readable.
inline void list_anew(FileParts& parts, std::size_t c) {
  ByteReader in(parts.chunks[c].payload);
  container::Index index;
  if (!container::get(in, index, parts.chunks[c].header.version,
                      parts.chunks.size() + (std::size_t{1} << 20)))
    return;
  index.previous_index = 0;
  index.entries.clear();
  std::uint64_t offset = container::kFileStartBytes, cells = 0, vertices = 0;
  container::StepEntry before;
  for (Chunk& chunk : std::span(parts.chunks).first(c)) {
    chunk.header.payload_bytes = chunk.payload.size();
    chunk.header.is_long |= container::has_long_header(chunk.header, parts.start);
    container::IndexEntry entry;
    entry.kind = chunk.header.kind;
    entry.offset = offset;
    entry.bytes = chunk.bytes();
    offset += entry.bytes;
    const auto group =
        chunk.is(container::ChunkKind::group) ? take_group_apart(chunk) : std::nullopt;
    if (group) {
      entry.segment = chunk.header.segment;
      entry.first_cell = std::exchange(cells, cells + group->header.cells);
      entry.cells = group->header.cells;
      entry.first_vertex = std::exchange(vertices, vertices + group->header.vertices);
      entry.vertices = group->header.vertices;
      entry.box = group->header.box;
      entry.header_bytes = chunk.payload.size();
      for (const auto& stream : group->streams) entry.header_bytes -= stream.size();
    }
    const auto steps =
        chunk.is(container::ChunkKind::step_values) ? take_steps_apart(chunk) : std::nullopt;
    for (std::size_t p = 0; steps && p < steps->heads.size(); ++p) {
      container::StepEntry part = container::entry_of(steps->heads[p].header);
      if (before.count > 0 && before.array == part.array && before.step == part.step)
        part.first = before.first + before.count;
      entry.parts.push_back(before = part);
    }
    if (chunk.is(container::ChunkKind::step_values) && !steps) entry.parts.resize(1);
    index.entries.push_back(std::move(entry));
  }
  ByteWriter out;
  container::put(out, index);
  parts.chunks[c].payload = std::move(out.bytes);
}

/// Rebuilds the list of chunks in each index: it then lists all chunks before it. Does not change
/// the totals (numbers of vertices, cells and so on). An index that is not readable does not
/// change.
inline void list_anew(FileParts& parts) {
  const bool is_true_offset = parts.index_offset == parts.last_offset();
  for (std::size_t c = 0; c < parts.chunks.size(); ++c)
    if (parts.chunks[c].is(container::ChunkKind::index)) list_anew(parts, c);
  if (is_true_offset) parts.index_offset = parts.last_offset();
}

/// Moves each part of step values that is not in a bundle into a separate chunk, because an index
/// of version 0 requires one part per chunk.
inline std::vector<std::byte> with_parts_apart(std::span<const std::byte> bytes) {
  FileParts parts = take_apart(bytes);
  std::vector<Chunk> chunks;
  for (Chunk& chunk : parts.chunks) {
    const auto steps =
        chunk.is(container::ChunkKind::step_values) &&
                container::without_digest(chunk.header.version) != container::kBundleVersion
            ? take_steps_apart(chunk)
            : std::nullopt;
    // A digest covers all parts of a chunk, so parts in chunks of their own have none.
    if (steps) chunk.header.version = container::without_digest(chunk.header.version);
    for (std::size_t p = 0; steps && p < steps->heads.size(); ++p) {
      chunk.payload =
          put_steps_together({{steps->heads[p]}, {steps->values[p]}}, chunk.header.version);
      chunks.push_back(chunk);
    }
    if (!steps) chunks.push_back(std::move(chunk));
  }
  parts.chunks = std::move(chunks);
  list_anew(parts);
  return put_together(std::move(parts));
}

/// Does the same as with_index(), but writes an index of version 0.
inline std::vector<std::byte> with_old_index(std::span<const std::byte> bytes,
                                             const std::function<void(container::Index&)>& change) {
  const std::vector<std::byte> apart = with_parts_apart(bytes);
  return with_index(apart, [&](container::Index& index) {
    index = as_version_0(std::move(index), apart);
    change(index);
  });
}

/// Returns the payload of a schema chunk.
inline std::vector<std::byte> schema_payload(std::span<const std::byte> blob) {
  ByteWriter payload;
  payload.put_u16(container::kMajor);
  payload.put_u16(container::kMinor);
  payload.put_u32(0);
  put_packed(payload, blob);
  return std::move(payload.bytes);
}
inline std::vector<std::byte> schema_payload(const Schema& schema) {
  ByteWriter blob;
  put(blob, schema);
  return schema_payload(blob.bytes);
}

}  // namespace shm
