// Sinks and sources of bytes whose code does not depend on the operating system.
#include "shm/io.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "base/threads.h"

namespace shm {

Result<void> ByteSink::copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes) {
  constexpr std::uint64_t kPiece = std::uint64_t{1} << 20;
  std::vector<std::byte> piece;
  while (bytes > 0) {
    piece.resize(static_cast<std::size_t>(std::min(kPiece, bytes)));
    if (auto status = from.read_at(offset, piece); !status) return status;
    if (auto status = write(piece); !status) return status;
    offset += piece.size();
    bytes -= piece.size();
  }
  return {};
}

Result<void> ByteSink::commit() { return {}; }
Result<void> ByteSink::flush() { return {}; }
Result<void> ByteSink::publish() { return {}; }

Result<void> MemorySink::write(std::span<const std::byte> more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
  return {};
}

Result<std::size_t> MemorySource::read(std::span<std::byte> into) {
  const std::size_t n = std::min(into.size(), left_.size());
  std::copy_n(left_.begin(), n, into.begin());
  left_ = left_.subspan(n);
  return n;
}

Result<void> NullSink::write(std::span<const std::byte> more) {
  bytes += more.size();
  return {};
}

Result<void> MemoryRandomSource::read_at(std::uint64_t offset, std::span<std::byte> into) {
  if (offset > bytes_.size() || into.size() > bytes_.size() - offset)
    return truncated("ends before it should", {}, bytes_.size());
  const auto from = bytes_.subspan(static_cast<std::size_t>(offset), into.size());
  std::copy(from.begin(), from.end(), into.begin());
  return {};
}

void RandomSource::prefetch(std::span<const ByteRange> /*ranges*/) {}

struct SharedSource::Impl {
  std::unique_ptr<RandomSource> source;
  Mutex mutex;
};

SharedSource::SharedSource(std::unique_ptr<RandomSource> source) : impl_(new Impl) {
  impl_->source = std::move(source);
}

SharedSource::~SharedSource() = default;

std::uint64_t SharedSource::size() const { return impl_->source->size(); }

Result<void> SharedSource::read_at(std::uint64_t offset, std::span<std::byte> into) {
  const std::lock_guard lock(impl_->mutex);
  return impl_->source->read_at(offset, into);
}

void SharedSource::prefetch(std::span<const ByteRange> ranges) {
  const std::lock_guard lock(impl_->mutex);
  impl_->source->prefetch(ranges);
}

void SectionSource::prefetch(std::span<const ByteRange> ranges) {
  std::vector<ByteRange> moved;
  for (const ByteRange& range : ranges)
    if (range.offset < bytes_)
      moved.push_back({offset_ + range.offset, std::min(range.bytes, bytes_ - range.offset)});
  whole_->prefetch(moved);
}

Result<void> SectionSource::read_at(std::uint64_t offset, std::span<std::byte> into) {
  if (offset > bytes_ || into.size() > bytes_ - offset)
    return truncated("ends before it should", {}, offset_ + bytes_);
  return whole_->read_at(offset_ + offset, into);
}

Result<std::size_t> SectionSource::read(std::span<std::byte> into) {
  const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(into.size(), bytes_ - at_));
  if (auto status = read_at(at_, into.first(n)); !status) return status.error();
  at_ += n;
  return n;
}

}  // namespace shm
