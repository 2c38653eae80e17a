// IndexMaker: the index of a file that has lost it, from chunks that are all there. What it tells
// of the mesh is what a Decoder counts that goes through all of it; ranges are those of the values
// as they are restored, which are their writer's unless they are kept within a bound.
// in:  KnownChunks     out: container::Index
// spec: "Index and trailer", "Recovery"
#pragma once

#include <cstddef>
#include <span>

#include "recovery/known_chunks.h"
#include "shm/reader.h"

namespace shm {

class IndexMaker {
 public:
  /// All is borrowed. Must hold: `known` has a schema.
  IndexMaker(RandomSource& source, const KnownChunks& known, const ReadLimits& limits);

  /// Offsets are those of a file in which all chunks stand by their numbers. Fails where a chunk is
  /// missing or hurt, or its values cannot be decoded. Once only.
  Result<container::Index> make();

 private:
  Result<void> add(const container::FoundChunk& chunk);
  Result<container::IndexEntry> entry_of(const container::FoundChunk& chunk);
  Result<void> decode(std::span<const std::byte> bytes);
  void take(const MeshBlock& block);

  RandomSource* source_;
  const KnownChunks* known_;
  Decoder decoder_;
  container::Index index_;
  std::size_t groups_ = 0, steps_ = 0;  // of known_, so far
  std::size_t pieces_ = 0;              // of step values
};

}  // namespace shm
