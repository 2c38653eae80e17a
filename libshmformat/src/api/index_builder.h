// IndexBuilder: rebuilds a lost index from FoundChunks, which must contain all chunks of the file.
// A Decoder decodes the whole file and counts the totals of the mesh. In version 0, the index also
// contains ranges of the decoded values. These ranges equal the ranges that the writer stored,
// unless values are quantized.
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
  /// Creates a builder. All references are borrowed. Precondition: `found` has a schema.
  IndexBuilder(RandomSource& source, const FoundChunks& found, const ReadLimits& limits,
               std::uint8_t version);

  /// Returns the index. The offsets in the index are those of a file that contains all chunks in
  /// the order of their numbers. Fails if a chunk is missing or damaged, or if values cannot be
  /// decoded. May be called only once.
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
  // Number of groups and number of parts of found_ that have been processed.
  std::size_t groups_ = 0, parts_ = 0;
  // Number of decoded pieces of step values, in total and in the current chunk.
  std::size_t pieces_ = 0, piece_of_chunk_ = 0;
};

}  // namespace shm
