// IndexBuilder: the index of a file that has lost it, from chunks that are all there. Its totals
// of the mesh are what a Decoder counts that goes through all of it. In version 0 it has ranges of
// the values as they are restored: their writer's, unless they are kept within a bound.
// in:  FoundChunks     out: container::Index
// spec: "Index and trailer", "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "recovery/found_chunks.h"
#include "shm/reader.h"

namespace shm {

class IndexBuilder {
 public:
  /// All is borrowed. Must hold: `found` has a schema.
  IndexBuilder(RandomSource& source, const FoundChunks& found, const ReadLimits& limits,
               std::uint8_t version);

  /// Offsets are those of a file in which all chunks stand by their numbers. Fails where a chunk is
  /// missing or hurt, or its values cannot be decoded. Once only.
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
  std::size_t groups_ = 0, parts_ = 0;           // of found_, so far
  std::size_t pieces_ = 0, piece_of_chunk_ = 0;  // of step values
};

}  // namespace shm
