// ChunkWriter: chunks front to back into a sink, numbered, checksummed and remembered for the
// index. spec: "Container"
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "container/format.h"
#include "shm/io.h"

namespace shm::container {

class ChunkWriter {
 public:
  /// `sink` is borrowed.
  explicit ChunkWriter(ByteSink& sink) : sink_(&sink) {}

  Result<void> start(const FileStart& start);
  /// Writes one chunk; `entry` is its line in the index (kind, offset, bytes are filled in).
  Result<void> write(ChunkKind kind, std::span<const std::byte> payload, IndexEntry entry = {},
                     std::uint8_t version = 0);
  /// Writes `index` (entries are filled in) and the trailer, and commits the sink.
  Result<void> finish(Index index);

  std::uint64_t offset() const { return offset_; }
  /// Chunks so far.
  std::uint32_t count() const { return sequence_; }
  /// Chunks that stand in the file already, behind those that were written: `bytes` bytes, with
  /// offsets from where they begin. Corrupt where they do not lie there one behind the other.
  Result<void> adopt(std::span<const IndexEntry> entries, std::uint64_t bytes);
  /// Lines of the index of the chunks since the beginning or the last call, with offsets from
  /// there; it forgets them, and where they are.
  std::vector<IndexEntry> take_entries();

  /// How far a file has come.
  struct State {
    std::uint64_t offset = 0;
    std::uint32_t sequence = 0;
    std::vector<IndexEntry> entries;
  };
  /// Writes behind chunks that stand in the sink, in a file of that version.
  void go_on(State state, const FileStart& start) {
    start_ = start;
    offset_ = state.offset;
    sequence_ = state.sequence;
    entries_ = std::move(state.entries);
  }

 private:
  Result<void> put(std::span<const std::byte> bytes);

  ByteSink* sink_;
  FileStart start_;
  std::uint64_t offset_ = 0;
  std::uint32_t sequence_ = 0;
  std::vector<IndexEntry> entries_;
};

}  // namespace shm::container
