#include "format/chunk_scan.h"

#include <algorithm>
#include <string_view>

#include "base/binary.h"
#include "format/random_chunks.h"

namespace shm::container {
namespace {

constexpr std::string_view kMarks = "SHM";  // common prefix of both sync marks, "SHMc" and "SHMC"
constexpr std::uint64_t kWindowBytes = std::uint64_t{1} << 20;
/// Work limit. Bytes may look like a chunk header by accident. If no other chunk follows such a
/// chunk, the scan reads its payload to verify the checksum. These reads are limited to this
/// multiple of the size of the file.
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
  Result<std::optional<ChunkHeader>> header_at(std::uint64_t offset) {
    return container::header_at(*source_, offset, size_, "chunk header");
  }
  /// Returns true if the trailer at `position` is valid and points to the chunk at `index_offset`.
  Result<bool> is_trailer(std::uint64_t position, std::uint64_t index_offset);
  /// Returns true if this chunk is directly followed by another chunk, or by a trailer that points
  /// to this chunk.
  Result<bool> is_followed(const FoundChunk& chunk);
  /// Returns true if the file has more chunks after this index: the chunk with the next number
  /// follows directly, or the trailer at the end of the source points to a later index.
  Result<bool> goes_on_after(const FoundChunk& index);
  Result<bool> is_whole(const FoundChunk& chunk);
  /// Records the chunk at `position`. Returns the position at which the search continues.
  Result<std::uint64_t> take(std::uint64_t position, const ChunkHeader& header);
  /// Returns the position of the first valid chunk header at or after `position`, or the end of the
  /// file if none exists.
  Result<std::uint64_t> next_mark(std::uint64_t position);
  Result<std::span<const std::byte>> window_at(std::uint64_t position);

  RandomSource* source_;
  std::uint64_t size_, max_chunk_bytes_, looks_left_;
  bool ended_ = false;
  std::vector<std::byte> window_;
  std::uint64_t window_begin_ = 0;
  ChunkScan scan_;
};

Result<ChunkScan> Scanner::run() {
  if (auto status = read_start(); !status) return status.error();
  if (auto status = read_end(); !status) return status.error();
  scan_.end = size_;
  std::uint64_t position = std::min<std::uint64_t>(size_, kFileStartBytes);
  while (!ended_ && position < size_) {
    const auto header = header_at(position);
    if (!header) return header.error();
    const auto next = *header ? take(position, **header) : next_mark(position + 1);
    if (!next) return next.error();
    position = *next;
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
  if (auto status = source_->read_at(0, bytes); !status) return status;
  ByteReader in(bytes);
  FileStart start;
  if (get(in, start)) scan_.start = start;
  return {};
}

Result<void> Scanner::read_end() {
  std::vector<std::byte> bytes(kTrailerBytes);
  if (size_ < bytes.size()) return {};
  if (auto status = source_->read_at(size_ - bytes.size(), bytes); !status) return status;
  ByteReader in(bytes);
  std::uint64_t offset = 0;
  if (get_trailer(in, offset) && offset < size_) scan_.index_offset = offset;
  return {};
}

Result<bool> Scanner::is_trailer(std::uint64_t position, std::uint64_t index_offset) {
  if (position > size_ || size_ - position < kTrailerBytes) return false;
  std::vector<std::byte> bytes(kTrailerBytes);
  if (auto status = source_->read_at(position, bytes); !status) return status.error();
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

Result<bool> Scanner::goes_on_after(const FoundChunk& index) {
  const auto next = header_at(index.offset + index.bytes());
  if (!next) return next.error();
  if (*next && (*next)->sequence == index.header.sequence + 1) return true;
  if (scan_.index_offset.value_or(0) <= index.offset) return false;
  const auto last = header_at(*scan_.index_offset);
  if (!last) return last.error();
  return *last && (*last)->kind == index.header.kind && (*last)->sequence >= index.header.sequence;
}

Result<bool> Scanner::is_whole(const FoundChunk& chunk) {
  if (chunk.header.payload_bytes > max_chunk_bytes_) return false;
  std::vector<std::byte> payload(static_cast<std::size_t>(chunk.header.payload_bytes));
  if (auto status = source_->read_at(chunk.offset + chunk.header.bytes(), payload); !status)
    return status.error();
  return checksum(payload) == chunk.header.payload_checksum;
}

Result<std::uint64_t> Scanner::take(std::uint64_t position, const ChunkHeader& header) {
  FoundChunk chunk{position, header, false, 0};
  const std::uint64_t after_header = position + header.bytes();
  const bool fits = header.payload_bytes <= size_ - after_header;
  bool followed = false;
  if (fits) {
    const auto result = is_followed(chunk);
    if (!result) return result.error();
    followed = *result;
    if (followed || header.payload_bytes <= looks_left_) {
      if (!followed) looks_left_ -= header.payload_bytes;
      const auto whole = is_whole(chunk);
      if (!whole) return whole.error();
      chunk.whole = *whole;
    }
  }
  scan_.chunks.push_back(chunk);
  // If the chunk is damaged and nothing valid follows it, the length in its header cannot be
  // trusted. The search then continues within the chunk.
  if (!chunk.whole && !followed) return next_mark(after_header);
  const std::uint64_t end = position + chunk.bytes();
  const bool is_index = chunk.is(ChunkKind::index) && is_known(header);
  if (!chunk.whole || !(is_index || chunk.is(ChunkKind::members))) return end;
  const bool inside = is_index && has_trailer_inside(header.version);
  const auto trailer = inside ? Result<bool>(true) : is_trailer(end, position);
  if (!trailer) return trailer.error();
  const auto goes_on = inside ? goes_on_after(chunk) : Result<bool>(false);
  if (!goes_on) return goes_on.error();
  // If no trailer follows the index, and the trailer at the end of the source points to a later
  // index, this index is a stray copy in the middle of the file.
  if (*goes_on || (!*trailer && scan_.index_offset.value_or(0) > position)) return end;
  scan_.trailer = *trailer;
  scan_.end = std::min(size_, inside ? end : end + kTrailerBytes);
  ended_ = true;
  return end;
}

/// Returns the bytes from `position` on: at least the length of a long header, or all bytes up to
/// the end of the file. Reuses the bytes of the previous read if they suffice.
Result<std::span<const std::byte>> Scanner::window_at(std::uint64_t position) {
  const std::uint64_t least = std::min<std::uint64_t>(kLongHeaderBytes, size_ - position);
  const bool there = position >= window_begin_ && position - window_begin_ < window_.size() &&
                     window_.size() - (position - window_begin_) >= least;
  if (!there) {
    window_begin_ = position;
    window_.resize(static_cast<std::size_t>(std::min(kWindowBytes, size_ - position)));
    if (auto status = source_->read_at(position, window_); !status) return status.error();
  }
  return std::span<const std::byte>(window_).subspan(
      static_cast<std::size_t>(position - window_begin_));
}

Result<std::uint64_t> Scanner::next_mark(std::uint64_t position) {
  while (position < size_ && size_ - position >= kShortHeaderBytes) {
    const auto window = window_at(position);
    if (!window) return window.error();
    const std::string_view text(reinterpret_cast<const char*>(window->data()), window->size());
    for (auto found = text.find(kMarks); found != text.npos; found = text.find(kMarks, found + 1)) {
      if (window->size() - found < kShortHeaderBytes) break;
      ByteReader in(window->subspan(found));
      ChunkHeader header;
      if (get(in, header) == HeaderState::good) return position + found;
    }
    // Consecutive windows overlap, since a header may extend past the end of a window.
    const bool to_the_end = position + window->size() == size_;
    position += to_the_end ? window->size() : window->size() - (kLongHeaderBytes - 1);
  }
  return size_;
}

}  // namespace

Result<ChunkScan> scan_chunks(RandomSource& source, std::uint64_t max_chunk_bytes) {
  return Scanner(source, max_chunk_bytes).run();
}

}  // namespace shm::container
