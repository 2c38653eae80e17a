#include "format/chunk_copy.h"

#include <algorithm>
#include <utility>

#include "format/random_chunks.h"

namespace shm::container {

Result<ChunkCopy> ChunkCopy::of(RandomSource& source, std::span<const IndexEntry> entries,
                                std::uint64_t index_offset,
                                const std::function<bool(const IndexEntry&)>& keep) {
  ChunkCopy copy;
  copy.pieces_.push_back({{}, 0, kFileStartBytes});
  copy.state_.offset = kFileStartBytes;
  const auto visit = [&](const ChunkHeader& header, const IndexEntry& entry) -> Result<void> {
    if (keep(entry)) copy.add(header, entry);
    return {};
  };
  if (auto status = for_each_chunk(source, entries, index_offset, visit); !status)
    return status.error();
  return copy;
}

void ChunkCopy::add(ChunkHeader header, const IndexEntry& entry) {
  const bool renumbered = header.sequence != state_.sequence;
  if (renumbered) {
    header.sequence = state_.sequence;
    ByteWriter out;
    put(out, header);
    pieces_.push_back({std::move(out.bytes), entry.offset + header.bytes(), header.payload_bytes});
  } else if (pieces_.back().offset + pieces_.back().bytes == entry.offset) {
    pieces_.back().bytes += entry.bytes;
  } else {
    pieces_.push_back({{}, entry.offset, entry.bytes});
  }
  payload_bytes_.push_back(header.payload_bytes);
  state_.entries.push_back(entry);
  state_.entries.back().offset = state_.offset;
  state_.offset += entry.bytes;
  ++state_.sequence;
}

Result<void> ChunkCopy::write(RandomSource& source, ByteSink& sink) const {
  for (const Piece& piece : pieces_) {
    if (!piece.head.empty())
      if (auto status = sink.write(piece.head); !status) return status;
    if (auto status = sink.copy(source, piece.offset, piece.bytes); !status) return status;
  }
  return {};
}

class ChunkCopy::Source final : public ByteSource {
 public:
  Source(RandomSource& source, std::vector<Piece> pieces)
      : source_(&source), pieces_(std::move(pieces)) {}

  Result<std::size_t> read(std::span<std::byte> into) override {
    for (; at_ < pieces_.size(); ++at_, done_ = 0) {
      const Piece& piece = pieces_[at_];
      const std::uint64_t left = piece.head.size() + piece.bytes - done_;
      if (left == 0) continue;
      if (done_ < piece.head.size()) {
        const auto head = std::span(piece.head).subspan(static_cast<std::size_t>(done_));
        const std::size_t n = std::min(into.size(), head.size());
        std::copy_n(head.begin(), n, into.begin());
        done_ += n;
        return n;
      }
      const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(into.size(), left));
      const std::uint64_t from = piece.offset + (done_ - piece.head.size());
      if (auto status = source_->read_at(from, into.first(n)); !status) return status.error();
      done_ += n;
      return n;
    }
    return std::size_t{0};
  }

 private:
  RandomSource* source_;
  std::vector<Piece> pieces_;
  std::size_t at_ = 0;
  std::uint64_t done_ = 0;  // number of bytes of the current piece that have been read
};

std::unique_ptr<ByteSource> ChunkCopy::read(RandomSource& source,
                                            std::vector<std::byte> tail) const {
  std::vector<Piece> pieces = pieces_;
  pieces.push_back({std::move(tail), 0, 0});
  return std::make_unique<Source>(source, std::move(pieces));
}

}  // namespace shm::container
