// Asking files: small files that try to make a reader allocate much memory. Each file has correct
// checksums and a large count in one field. There is one file for each field that contains a count.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "support/feature_files.h"
#include "support/file_surgery.h"
#include "support/stepped_mesh.h"
#include "support/test_mesh.h"

namespace shm {

/// Assembles the file from `parts`. Recomputes the list of chunks in the index and the length of
/// each chunk, so that the index agrees with the changed chunks. Precondition: the index is the
/// last chunk and has version 1.
inline std::vector<std::byte> put_together_with_index(FileParts parts) {
  Chunk& last = parts.chunks.back();
  ByteReader in(last.payload);
  container::Index index;
  container::get(in, index, last.header.version, parts.chunks.size());
  std::vector<container::IndexEntry> groups;
  for (const auto& entry : index.entries)
    if (entry.is(container::ChunkKind::group)) groups.push_back(entry);
  std::vector<container::IndexEntry> entries;
  for (Chunk& chunk : parts.chunks) {
    if (&chunk == &last) break;
    container::IndexEntry entry;
    if (chunk.is(container::ChunkKind::group)) {
      entry = groups.at(0);
      groups.erase(groups.begin());
      const auto group = take_group_apart(chunk);
      ByteWriter header;
      container::put(header, group->header);
      entry.header_bytes = header.bytes.size();
    }
    chunk.header.payload_bytes = chunk.payload.size();
    chunk.header.is_long |= container::has_long_header(chunk.header, parts.start);
    entry.kind = chunk.header.kind;
    entry.bytes = chunk.header.bytes() + chunk.payload.size();
    entries.push_back(std::move(entry));
  }
  index.entries = std::move(entries);
  ByteWriter out;
  container::put(out, index);
  last.payload = std::move(out.bytes);
  return put_together(std::move(parts));
}

/// Returns a file of a small cube of hexahedra, with the given chunks inserted before the index.
inline std::vector<std::byte> asking_mesh(
    const std::vector<std::pair<container::ChunkKind, std::vector<std::byte>>>& chunks,
    std::uint8_t version_of_extras = 1) {
  MemorySink sink;
  const auto report = write_mesh(grid(2, 2, 2), sink, without_digests());
  EXPECT_TRUE(report);
  FileParts parts = take_apart(sink.bytes);
  for (const auto& [kind, payload] : chunks) {
    Chunk chunk;
    chunk.header.kind = static_cast<std::uint8_t>(kind);
    chunk.header.version = kind == container::ChunkKind::extra
                               ? version_of_extras
                               : container::version_of_chunk(kind, parts.start);
    chunk.payload = payload;
    parts.chunks.insert(parts.chunks.end() - 1, std::move(chunk));
  }
  return put_together_with_index(std::move(parts));
}

/// Returns such a mesh with another schema.
inline std::vector<std::byte> asking_schema(std::span<const std::byte> packed) {
  MemorySink sink;
  EXPECT_TRUE(write_mesh(grid(2, 2, 2), sink, without_digests()));
  FileParts parts = take_apart(sink.bytes);
  ByteWriter payload;
  container::put_version(payload, parts.start);
  payload.put_bytes(packed);
  parts.chunks[0].payload = std::move(payload.bytes);
  return put_together_with_index(std::move(parts));
}
/// Returns the beginning of an encoded schema: all fields before the list of blocks.
inline ByteWriter schema_head() {
  ByteWriter head;
  Schema schema;
  put(head, schema);
  head.bytes.resize(head.bytes.size() - 2);  // no blocks, no arrays
  return head;
}

/// Returns a file of two layers of hexahedra. A reader must keep all vertices between the two
/// layers in memory at the same time. The file declares an array but contains no stream for it, so
/// a reader returns zeros for all of its values.
inline std::vector<std::byte> asking_columns(std::uint32_t side, Location location,
                                             std::uint32_t components) {
  TestMesh mesh = grid(side, side, 2);
  MemorySink sink;
  WriteOptions options = without_digests();
  options.connectivity = ConnectivityCodec::rows;
  // A group has so few cells that a reader returns it as one tile, even with the array that is
  // added below.
  options.group_cells = 400;
  EXPECT_TRUE(write_mesh(mesh, sink, options));
  FileParts parts = take_apart(sink.bytes);
  mesh.schema.arrays.push_back(array_of("zeros", location, ScalarType::uint8, components));
  ByteWriter blob, payload;
  put(blob, mesh.schema);
  container::put_version(payload, parts.start);
  put_packed(payload, blob.bytes);
  parts.chunks[0].payload = std::move(payload.bytes);
  for (Chunk& chunk : parts.chunks) {
    if (!chunk.is(container::ChunkKind::group)) continue;
    auto group = take_group_apart(chunk);
    group->header.decoded_bytes +=
        components * (location == Location::point ? group->header.vertices : group->header.cells);
    chunk.payload = put_group_together(*group);
  }
  return put_together_with_index(std::move(parts));
}

/// Returns a file of two layers of hexahedra. A reader must keep all vertices between the two
/// layers in memory at the same time. If `components` is not 0, the file also has step values,
/// which are predicted from neighbouring vertices.
inline Bytes asking_sheet(std::uint32_t side, ConnectivityCodec codec,
                          std::uint32_t components = 0) {
  Stepped stepped;
  stepped.mesh = grid(side, side, 2);
  stepped.options.connectivity = codec;
  if (components > 0) {
    const auto array =
        add_stepped(stepped.mesh, array_of("u", Location::point, ScalarType::uint8, components));
    Bytes values;
    for (std::uint64_t v = 0; v < stepped.mesh.vertices; ++v)
      for (std::uint64_t c = 1; c <= components; ++c)
        values.push_back(static_cast<std::byte>((v % (side + 1) + v / (side + 1)) * c));
    for (const std::uint64_t step : {0, 1, 2}) stepped.values[{array, step}] = values;
  }
  return written(stepped);
}

struct AskingFile {
  std::string name;
  std::vector<std::byte> bytes;
};

/// Writes the beginning of an extra (a typed value with a key). The key is empty and the values
/// have type uint8. The extra does not refer to mesh elements, and its values are not coded as
/// differences.
inline void put_unnamed(ByteWriter& blob) {
  blob.put_text("");
  blob.put_u8(static_cast<std::uint8_t>(ScalarType::uint8));
  blob.put_u8(0);
  blob.put_varint(0);
}

/// Returns a file with as many pairs of an array and a step in bundles as any file may have. All
/// values are zero.
inline Bytes asking_bundles() {
  Stepped stepped;
  stepped.mesh = grid(2, 2, 2);
  stepped.options = {};
  const auto array =
      add_stepped(stepped.mesh, array_of("zeros", Location::cell, ScalarType::uint8));
  for (std::uint64_t step = 0; step < container::most_bundle_pairs(0); ++step)
    stepped.values[{array, step}] = Bytes(8);
  return written(stepped);
}

/// Returns this file with a damaged byte in each chunk of step values.
inline Bytes asking_damaged_bundles() {
  Bytes bytes = asking_bundles();
  std::size_t end = container::kFileStartBytes;
  for (const Chunk& chunk : take_apart(bytes).chunks) {
    end += chunk.bytes();
    if (chunk.is(container::ChunkKind::step_values)) bytes[end - 1] ^= std::byte{1};
  }
  return bytes;
}

inline std::vector<AskingFile> asking_files() {
  using container::ChunkKind;
  constexpr std::uint64_t kMany = std::uint64_t{500} << 20;
  const auto extra_head = [](std::uint8_t version, std::uint64_t values) {
    ByteWriter head;
    if (version > 0) head.put_varint(1);
    head.put_text("test/zeros");
    head.put_u8(static_cast<std::uint8_t>(ScalarType::uint8));
    head.put_u8(0);
    if (version > 0) head.put_varint(0);
    head.put_varint(1);
    head.put_varint(values);
    return head.bytes;
  };
  std::vector<AskingFile> files;
  for (const std::uint8_t version : {std::uint8_t{0}, std::uint8_t{1}}) {
    const auto payload = packed_zeros(extra_head(version, kMany), kMany);
    files.push_back({"extras of version " + std::to_string(version),
                     asking_mesh({8, {ChunkKind::extra, payload}}, version)});
    const auto small = packed_zeros(extra_head(version, 1 << 20), 1 << 20);
    files.push_back({"small extras of version " + std::to_string(version),
                     asking_mesh({2000, {ChunkKind::extra, small}}, version)});
  }
  {  // values are stored as differences of one byte each, but need eight bytes each in memory
    constexpr std::uint64_t kValues = std::uint64_t{60} << 20;
    ByteWriter head;
    head.put_varint(1);
    head.put_text("test/map");
    head.put_u8(static_cast<std::uint8_t>(ScalarType::int64));
    head.put_u8(0);
    head.put_varint(1);
    head.put_varint(1);
    head.put_varint(kValues);
    files.push_back({"differences of extras",
                     asking_mesh({4, {ChunkKind::extra, packed_zeros(head.bytes, kValues)}})});
  }
  {  // each extra has an empty key, shape and value, and needs only five bytes in the file
    ByteWriter blob, payload;
    blob.put_varint(kMostExtras);
    for (std::size_t i = 0; i < kMostExtras; ++i) {
      put_unnamed(blob);
      blob.put_u8(1);
      blob.put_u8(0);
    }
    put_packed(payload, blob.bytes);
    files.push_back({"empty extras", asking_mesh({500, {ChunkKind::extra, payload.bytes}})});
  }
  {  // the maximum number of sides
    ByteWriter blob, payload;
    constexpr std::size_t kExtras = 20000;
    blob.put_varint(kExtras);
    for (std::size_t i = 0; i < kExtras; ++i) {
      put_unnamed(blob);
      blob.put_varint(255);
      blob.bytes.resize(blob.bytes.size() + 255);
    }
    put_packed(payload, blob.bytes);
    files.push_back({"shapes of extras", asking_mesh({50, {ChunkKind::extra, payload.bytes}})});
  }
  files.push_back({"step times", asking_mesh({{ChunkKind::step_times,
                                               packed_zeros({}, std::uint64_t{800} << 20)}})});
  {
    ByteWriter head = schema_head();
    head.bytes.pop_back();  // the length of source_format
    head.put_varint(std::uint64_t{900} << 20);
    files.push_back(
        {"source format", asking_schema(packed_zeros(head.bytes, (std::uint64_t{900} << 20) + 2))});
  }
  for (const std::uint64_t blocks : {std::uint64_t{1} << 20, std::uint64_t{500000}}) {
    ByteWriter head = schema_head();
    head.put_varint(blocks);
    files.push_back({std::to_string(blocks) + " blocks",
                     asking_schema(packed_zeros(head.bytes, 4 * blocks + 1))});
  }
  for (const bool ranges : {false, true}) {  // many components, or many blocks
    ByteWriter head = schema_head();
    head.put_varint(0);
    head.put_varint(1);
    head.put_u8(0);
    head.put_u8(static_cast<std::uint8_t>(Location::cell));
    head.put_u8(static_cast<std::uint8_t>(ScalarType::float32));
    head.put_varint(65535);
    head.put_u8(1);
    constexpr std::uint64_t kCount = std::uint64_t{100} << 20;
    head.put_varint(ranges ? 0 : kCount);
    files.push_back({ranges ? "ranges" : "blocks of an array",
                     asking_schema(packed_zeros(head.bytes, 2 * kCount))});
  }
  {
    Schema schema = grid(2, 2, 2).schema;
    schema.arrays.assign(65536, array_of("", Location::cell, ScalarType::float64, 65535));
    for (ArrayInfo& array : schema.arrays) array.per_step = true;
    ByteWriter blob, packed;
    put(blob, schema);
    put_packed(packed, blob.bytes);
    files.push_back({"stepped arrays", asking_schema(packed.bytes)});
  }
  files.push_back({"bundles", asking_bundles()});
  files.push_back({"damaged bundles", asking_damaged_bundles()});
  files.push_back({"components of vertices", asking_columns(66, Location::point, 4096)});
  files.push_back({"components of cells", asking_columns(66, Location::cell, 4096)});
  return files;
}

/// Returns pairs of a name and a function that creates a larger file. In most of these files, the
/// number of active vertices is close to the reader's limit or exceeds it. One file has step values
/// with many components. Each function takes several seconds.
inline std::vector<std::pair<std::string, std::function<Bytes()>>> asking_sheets() {
  using enum ConnectivityCodec;
  return {{"sheet in paper", [] { return asking_sheet(480, paper); }},
          {"larger sheet in mixed", [] { return asking_sheet(560, mixed); }},
          {"sheet in patterns", [] { return asking_sheet(1000, patterns); }},
          {"larger sheet in patterns", [] { return asking_sheet(1100, patterns); }},
          {"stepped components of a sheet", [] { return asking_sheet(240, rows, 256); }}};
}

}  // namespace shm
