// Functions that damage the feature files (small files that together use every feature of the
// format). Reading a damaged file must either fail with an error code that fits the damage, or
// return exactly the original contents. It must never return other contents, crash, or use
// excessive memory.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "support/feature_files.h"
#include "support/file_surgery.h"
#include "support/item_text.h"

namespace shm {

using container::ChunkKind;
using Bytes = std::vector<std::byte>;

inline const std::vector<FeatureFile>& files() {
  static const std::vector<FeatureFile> all = feature_files();
  return all;
}
inline const Bytes& file(const std::string& name) {
  for (const FeatureFile& candidate : files())
    if (candidate.name == name) return candidate.bytes;
  ADD_FAILURE() << "no feature file " << name;
  return files().front().bytes;
}

inline std::string text_of(const Result<Decoded>& decoded) {
  return decoded ? ItemText::of(*decoded) : decoded.error().message();
}

/// Decodes the bytes, and returns the code of the resulting error. The test fails if decoding
/// succeeds.
inline ErrorCode code_of(std::span<const std::byte> bytes, const ReadLimits& limits = {}) {
  const auto decoded = decode_in_pieces(bytes, 0, limits);
  EXPECT_FALSE(decoded) << "accepted:\n" << text_of(decoded);
  if (decoded) return {};
  EXPECT_FALSE(decoded.error().detail.empty());
  return decoded.error().code;
}

/// Returns a file that consists of a file header (file_start) and chunks with the given payloads.
inline Bytes file_of(const std::vector<std::pair<ChunkKind, Bytes>>& chunks) {
  FileParts parts;
  for (const auto& [kind, payload] : chunks) {
    Chunk chunk;
    chunk.header.kind = static_cast<std::uint8_t>(kind);
    chunk.header.version = container::version_of_chunk(kind, parts.start);
    chunk.payload = payload;
    parts.chunks.push_back(std::move(chunk));
  }
  return put_together(parts);
}

/// Returns the index of the first group of the second segment. Groups are numbered from 0 across
/// the whole file.
inline std::size_t second_segment(const FileParts& parts) {
  std::size_t nth = 0;
  for (const Chunk& chunk : parts.chunks) {
    if (!chunk.is(ChunkKind::group)) continue;
    if (chunk.header.segment == 1) break;
    ++nth;
  }
  return nth;
}

/// Applies `change` to the first group of the second segment of the feature file `name`, and
/// returns the changed file.
inline Bytes shifts_with(const std::function<void(GroupParts&)>& change,
                         const char* name = "shifts") {
  FileParts parts = take_apart(file(name));
  Chunk* chunk = parts.find(ChunkKind::group, second_segment(parts));
  auto group = take_group_apart(*chunk);
  EXPECT_TRUE(group);
  if (!group) return {};
  change(*group);
  chunk->payload = put_group_together(*group);
  return put_together(parts);
}

}  // namespace shm
