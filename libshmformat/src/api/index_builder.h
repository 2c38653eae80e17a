// IndexBuilder: rebuilds a lost index from chunks that are all present. The totals of the mesh are
// those that a Decoder counts while it decodes the whole file. In version 0 the index contains
// ranges of the decoded values; these are the ranges that the writer stored, unless values are
// quantized.
// in:  FoundChunks
// out: container::Index
// spec: "Index and trailer", "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "repair/found_chunks.h"
#include "shm/reader.h"

namespace shm {

class IndexBuilder {
 public:
  /// All arguments are borrowed. Must hold: `found` has a schema.
  IndexBuilder(RandomSource& source, const FoundChunks& found, const ReadLimits& limits,
               std::uint8_t version);

  /// Returns the index, with the offsets of a file in which all chunks are in the order of their
  /// numbers. Fails if a chunk is missing or damaged, or if values cannot be decoded. May be called
  /// only once.
  Result<container::Index> make();

 private:
  Result<void> add(const container::FoundChunk& chunk);
  Result<container::IndexEntry> entry_of(const container::FoundChunk& chunk);
  Result<void> decode(std::span<const std::byte> bytes);
  void widen_ranges(const MeshBlock& block);

  RandomSource* source_;
  const FoundChunks* found_;
  Decoder decoder_;
  container::Index index_;
  std::size_t groups_ = 0, parts_ = 0;           // of found_, processed so far
  std::size_t pieces_ = 0, piece_of_chunk_ = 0;  // step values: all, and those of the current chunk
};

}  // namespace shm
