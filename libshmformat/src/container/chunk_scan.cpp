#include "container/chunk_scan.h"

#include <algorithm>
#include <string_view>

#include "bytes/binary.h"
#include "container/random_chunks.h"

namespace shm::container {
namespace {

constexpr std::string_view kMarks = "SHM";  // both marks begin so
constexpr std::uint64_t kWindowBytes = std::uint64_t{1} << 20;
/// A chunk that nothing follows may be no chunk: so many times the file is read to find out.
constexpr std::uint64_t kMostLooks = 4;

class Scanner {
 public:
  Scanner(RandomSource& source, std::uint64_t max_chunk_bytes)
      : source_(&source),
        size_(source.size()),
        max_chunk_bytes_(max_chunk_bytes),
        looks_left_(size_ > ~std::uint64_t{0} / kMostLooks ? size_ : kMostLooks * size_) {}

  Result<ChunkScan> run();

 private:
  Result<void> read_start();
  Result<void> read_end();
  Result<std::optional<ChunkHeader>> header_at(std::uint64_t at) {
    return container::header_at(*source_, at, size_, "chunk header");
  }
  /// Whether a trailer is at `at`, that of the chunk at `index_offset`.
  Result<bool> is_trailer(std::uint64_t at, std::uint64_t index_offset);
  /// Whether something that may follow the chunk is at its end.
  Result<bool> is_followed(const FoundChunk& chunk);
  Result<bool> is_whole(const FoundChunk& chunk);
  /// Takes the chunk at `at`; where to go on.
  Result<std::uint64_t> take(std::uint64_t at, const ChunkHeader& header);
  /// The next place from `at` on where a header is; the end of the file where there is none.
  Result<std::uint64_t> next_mark(std::uint64_t at);
  Result<std::span<const std::byte>> window_at(std::uint64_t at);

  RandomSource* source_;
  std::uint64_t size_, max_chunk_bytes_, looks_left_;
  bool ended_ = false;
  std::vector<std::byte> window_;
  std::uint64_t window_begin_ = 0;
  ChunkScan scan_;
};

Result<ChunkScan> Scanner::run() {
  if (auto good = read_start(); !good) return good.error();
  if (auto good = read_end(); !good) return good.error();
  scan_.end = size_;
  std::uint64_t at = std::min<std::uint64_t>(size_, kFileStartBytes);
  while (!ended_ && at < size_) {
    const auto header = header_at(at);
    if (!header) return header.error();
    const auto next = *header ? take(at, **header) : next_mark(at + 1);
    if (!next) return next.error();
    at = *next;
  }
  std::uint64_t end = size_;
  for (auto chunk = scan_.chunks.rbegin(); chunk != scan_.chunks.rend(); ++chunk) {
    chunk->room = end - chunk->offset;
    end = chunk->offset;
  }
  return std::move(scan_);
}

Result<void> Scanner::read_start() {
  std::vector<std::byte> bytes(kFileStartBytes);
  if (size_ < bytes.size()) return {};
  if (auto good = source_->read_at(0, bytes); !good) return good;
  ByteReader in(bytes);
  FileStart start;
  if (get(in, start)) scan_.start = start;
  return {};
}

Result<void> Scanner::read_end() {
  std::vector<std::byte> bytes(kTrailerBytes);
  if (size_ < bytes.size()) return {};
  if (auto good = source_->read_at(size_ - bytes.size(), bytes); !good) return good;
  ByteReader in(bytes);
  std::uint64_t offset = 0;
  if (get_trailer(in, offset) && offset < size_) scan_.index_offset = offset;
  return {};
}

Result<bool> Scanner::is_trailer(std::uint64_t at, std::uint64_t index_offset) {
  if (at > size_ || size_ - at < kTrailerBytes) return false;
  std::vector<std::byte> bytes(kTrailerBytes);
  if (auto good = source_->read_at(at, bytes); !good) return good.error();
  ByteReader in(bytes);
  std::uint64_t offset = 0;
  return get_trailer(in, offset) && offset == index_offset;
}

Result<bool> Scanner::is_followed(const FoundChunk& chunk) {
  const std::uint64_t end = chunk.offset + chunk.bytes();
  const auto header = header_at(end);
  if (!header) return header.error();
  if (*header) return true;
  return is_trailer(end, chunk.offset);
}

Result<bool> Scanner::is_whole(const FoundChunk& chunk) {
  if (chunk.header.payload_bytes > max_chunk_bytes_) return false;
  std::vector<std::byte> payload(static_cast<std::size_t>(chunk.header.payload_bytes));
  if (auto good = source_->read_at(chunk.offset + chunk.header.bytes(), payload); !good)
    return good.error();
  return checksum(payload) == chunk.header.payload_checksum;
}

Result<std::uint64_t> Scanner::take(std::uint64_t at, const ChunkHeader& header) {
  FoundChunk chunk{at, header, false, 0};
  const std::uint64_t behind_header = at + header.bytes();
  const bool fits = header.payload_bytes <= size_ - behind_header;
  bool followed = false;
  if (fits) {
    const auto it = is_followed(chunk);
    if (!it) return it.error();
    followed = *it;
    if (followed || header.payload_bytes <= looks_left_) {
      if (!followed) looks_left_ -= header.payload_bytes;
      const auto whole = is_whole(chunk);
      if (!whole) return whole.error();
      chunk.whole = *whole;
    }
  }
  scan_.chunks.push_back(chunk);
  // What is no chunk of its length may have others within.
  if (!chunk.whole && !followed) return next_mark(behind_header);
  const std::uint64_t end = at + chunk.bytes();
  if (chunk.whole && (chunk.is(ChunkKind::index) || chunk.is(ChunkKind::members))) {
    const auto trailer = is_trailer(end, at);
    if (!trailer) return trailer.error();
    // A copy of it in the middle: a trailer at the end of the source points to another one.
    if (!*trailer && scan_.index_offset.value_or(0) > at) return end;
    scan_.trailer = *trailer;
    scan_.end = std::min(size_, end + kTrailerBytes);
    ended_ = true;
  }
  return end;
}

/// Bytes from `at` on, at least a long header's or all there are, from what was read last where
/// they are there.
Result<std::span<const std::byte>> Scanner::window_at(std::uint64_t at) {
  const std::uint64_t least = std::min<std::uint64_t>(kLongHeaderBytes, size_ - at);
  const bool there = at >= window_begin_ && at - window_begin_ < window_.size() &&
                     window_.size() - (at - window_begin_) >= least;
  if (!there) {
    window_begin_ = at;
    window_.resize(static_cast<std::size_t>(std::min(kWindowBytes, size_ - at)));
    if (auto good = source_->read_at(at, window_); !good) return good.error();
  }
  return std::span<const std::byte>(window_).subspan(static_cast<std::size_t>(at - window_begin_));
}

Result<std::uint64_t> Scanner::next_mark(std::uint64_t at) {
  while (at < size_ && size_ - at >= kShortHeaderBytes) {
    const auto window = window_at(at);
    if (!window) return window.error();
    const std::string_view text(reinterpret_cast<const char*>(window->data()), window->size());
    for (auto found = text.find(kMarks); found != text.npos; found = text.find(kMarks, found + 1)) {
      if (window->size() - found < kShortHeaderBytes) break;
      ByteReader in(window->subspan(found));
      ChunkHeader header;
      if (get(in, header) == HeaderState::good) return at + found;
    }
    // Headers may lie across.
    const bool to_the_end = at + window->size() == size_;
    at += to_the_end ? window->size() : window->size() - (kLongHeaderBytes - 1);
  }
  return size_;
}

}  // namespace

Result<ChunkScan> scan_chunks(RandomSource& source, std::uint64_t max_chunk_bytes) {
  return Scanner(source, max_chunk_bytes).run();
}

}  // namespace shm::container
