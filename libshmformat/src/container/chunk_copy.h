// ChunkCopy: some chunks of a file as the beginning of another one. They stand there as they are,
// but for their numbers and places.
// spec: "Container", "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "container/chunk_writer.h"
#include "shm/io.h"

namespace shm::container {

class ChunkCopy {
 public:
  /// `entries`: all chunks of `source`, as its index at `index_offset` lists them. Reads their
  /// headers, and not what they hold. Corrupt where the index does not list what is there.
  static Result<ChunkCopy> of(RandomSource& source, std::span<const IndexEntry> entries,
                              std::uint64_t index_offset,
                              const std::function<bool(const IndexEntry&)>& keep);

  Result<void> write(RandomSource& source, ByteSink& sink) const;
  /// For a ChunkWriter that writes behind them.
  const ChunkWriter::State& state() const { return state_; }
  /// Of their payloads, by entry of the state.
  const std::vector<std::uint64_t>& payload_bytes() const { return payload_bytes_; }
  /// Their bytes and then `tail`. `source` is borrowed.
  std::unique_ptr<ByteSource> read(RandomSource& source, std::vector<std::byte> tail) const;

 private:
  /// Some bytes of its own, then a run of the source.
  struct Piece {
    std::vector<std::byte> head;
    std::uint64_t offset = 0, bytes = 0;
  };
  class Source;
  void add(ChunkHeader header, const IndexEntry& entry);

  std::vector<Piece> pieces_;
  ChunkWriter::State state_;
  std::vector<std::uint64_t> payload_bytes_;
};

}  // namespace shm::container
