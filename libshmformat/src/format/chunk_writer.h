// ChunkWriter: writes chunks to a sink from front to back, with sequence numbers and checksums, and
// collects their entries for the index.
// spec: "Container"
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "format/format.h"
#include "shm/io.h"

namespace shm::container {

class ChunkWriter {
 public:
  /// Creates a writer for `sink`, which is borrowed.
  explicit ChunkWriter(ByteSink& sink) : sink_(&sink) {}

  Result<void> start(const FileStart& start);
  /// Writes one chunk. `entry` is the chunk's entry for the index; write() sets its kind, offset
  /// and bytes.
  Result<void> write(ChunkKind kind, std::span<const std::byte> payload, IndexEntry entry = {},
                     std::uint8_t version = 0);
  /// Adds the collected entries to `index`, writes the index with the trailer, then commits the
  /// sink.
  Result<void> finish(Index index);
  /// Writes an index with the trailer, so that the bytes so far are a whole file. More chunks may
  /// follow. The index lists the chunks since an earlier index and refers to that index. It repeats
  /// the entries of earlier indexes that have fewer than twice as many entries as itself. A reader
  /// then follows at most log2(chunks) + 1 indexes.
  /// Flushes the sink before the trailer, and publishes it after the trailer. Does nothing if no
  /// chunk was written since the previous commit.
  /// spec: "Commits"
  Result<void> commit(Index index);
  /// Commits the sink. Precondition: everything written has been committed.
  Result<void> end() { return sink_->commit(); }

  std::uint64_t offset() const { return offset_; }
  /// Returns the number of chunks written so far.
  std::uint32_t count() const { return sequence_; }
  /// Adds the entries of chunks that another writer has appended to the sink, directly after the
  /// chunks written here. `bytes` is the total size of these chunks. The offsets in `entries` are
  /// relative to the first of these chunks. Fails with ErrorCode::corrupt if the chunks are not
  /// contiguous.
  Result<void> adopt(std::span<const IndexEntry> entries, std::uint64_t bytes);
  /// Returns the index entries of all chunks written since the start or the previous call. Then
  /// resets the offset and the sequence number to 0.
  std::vector<IndexEntry> take_entries();

  /// Index chunk that the next index can refer to, with the range of entries that it lists.
  struct Listed {
    std::size_t begin = 0, end = 0;  ///< entries[end] is the index chunk itself
  };
  /// State of a file to which some chunks have been written.
  struct State {
    std::uint64_t offset = 0;
    std::uint32_t sequence = 0;
    std::vector<IndexEntry> entries;
    /// Index chunks to which the next index can refer; empty if the file has no index.
    std::vector<Listed> indexes{};
  };
  /// Continues a file after chunks that the sink already contains. `start` states the version of
  /// the file.
  void go_on(State state, const FileStart& start) {
    start_ = start;
    offset_ = state.offset;
    sequence_ = state.sequence;
    entries_ = std::move(state.entries);
    indexes_ = std::move(state.indexes);
  }

 private:
  Result<void> put(std::span<const std::byte> bytes);
  Result<void> begin(ChunkKind kind, std::span<const std::byte> payload, IndexEntry entry,
                     std::uint8_t version);
  Result<void> write_index(Index index, std::size_t first_entry);

  ByteSink* sink_;
  FileStart start_;
  std::uint64_t offset_ = 0;
  std::uint32_t sequence_ = 0;
  std::vector<IndexEntry> entries_;
  std::vector<Listed> indexes_;  // index chunks that together list all chunks before the last one
};

}  // namespace shm::container
