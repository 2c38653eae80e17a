#include "vtk/xml/payload_writer.h"

#include <algorithm>
#include <utility>

#include "base/byte_order.h"
#include "base/failure.h"
#include "vtk/values.h"

namespace shm::converters::vtu {
namespace {

constexpr std::size_t kNumbersPerLine = 6;

std::string_view view(const std::byte* bytes, std::size_t count) {
  return {reinterpret_cast<const char*>(bytes), count};
}

}  // namespace

void PayloadWriter::fail(std::string detail) const {
  throw Failure(
      Error{.code = ErrorCode::corrupt, .detail = std::move(detail), .section = head_.array});
}

std::uint64_t PayloadWriter::word(std::uint64_t value) const {
  if (form_.header_bytes == 4 && value > 0xffffffffU)
    throw Failure(Error{.code = ErrorCode::unsupported,
                        .detail = "the array is too large for 32-bit headers",
                        .section = head_.array});
  return value;
}

void PayloadWriter::begin(const Head& head) {
  head_ = head;
  seen_ = 0;
  grouped_ = 0;
  bit_count_ = 0;
  bits_.clear();
  block_.clear();
  block_sizes_.clear();
  if (head_.style == Style::ascii) return;
  const std::uint64_t bytes = head_.bits ? head_.count / 8 + (head_.count % 8 != 0)
                                         : head_.count * scalar_bytes(head_.type);
  std::vector<std::byte> header;
  if (form_.compressor == Compressor::none) {
    append_word(header, word(bytes), form_);
    emit(header.data(), header.size());
    return;
  }
  // Reserve space for the header, which contains the compressed size of each block. It is filled in
  // after all blocks have been compressed.
  const std::uint64_t blocks = bytes / head_.block_bytes + (bytes % head_.block_bytes != 0);
  const std::uint64_t room = (3 + blocks) * form_.header_bytes;
  header_at_ = out_.position();
  std::uint64_t left = head_.style == Style::base64 ? base64_length(room) : room;
  const std::string zeros(4096, '\0');
  for (; left > 0; left -= std::min<std::uint64_t>(left, zeros.size()))
    out_.text(std::string_view(zeros).substr(0, std::min<std::uint64_t>(left, zeros.size())));
}

void PayloadWriter::numbers(const std::byte* values, std::size_t count) {
  seen_ += count;
  if (seen_ > head_.count) fail("has more values than expected");
  if (head_.style == Style::ascii) return out_.numbers(head_.type, values, count, kNumbersPerLine);
  if (head_.bits) return push_bits(values, count);
  const std::size_t width = scalar_bytes(head_.type);
  swapped_.assign(values, values + count * width);
  swap_from_file(swapped_.data(), count, width, form_.big_endian);
  push(swapped_.data(), swapped_.size());
}

void PayloadWriter::push_bits(const std::byte* values, std::size_t count) {
  bits_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    group_bits_ = static_cast<std::uint8_t>(group_bits_ << 1 | (values[i] != std::byte{0}));
    if (++bit_count_ < 8) continue;
    bits_.push_back(static_cast<std::byte>(group_bits_));
    bit_count_ = 0;
  }
  push(bits_.data(), bits_.size());
}

void PayloadWriter::push(const std::byte* bytes, std::size_t count) {
  if (form_.compressor == Compressor::none) return emit(bytes, count);
  while (count > 0) {
    const std::size_t n = std::min<std::uint64_t>(count, head_.block_bytes - block_.size());
    block_.insert(block_.end(), bytes, bytes + n);
    bytes += n;
    count -= n;
    if (block_.size() == head_.block_bytes) flush_block();
  }
}

void PayloadWriter::flush_block() {
  if (block_.empty()) return;
  const std::vector<std::byte> packed = compress(form_.compressor, block_.data(), block_.size());
  block_sizes_.push_back(packed.size());
  last_block_ = block_.size();
  emit(packed.data(), packed.size());
  block_.clear();
}

void PayloadWriter::emit(const std::byte* bytes, std::size_t count) {
  if (head_.style == Style::raw) return out_.text(view(bytes, count));
  text_.clear();
  while (count > 0 && grouped_ > 0) {
    group_[grouped_++] = *bytes++;
    --count;
    if (grouped_ < 3) continue;
    append_base64(text_, group_.data(), 3);
    grouped_ = 0;
  }
  const std::size_t whole = count - count % 3;
  append_base64(text_, bytes, whole);
  for (std::size_t i = whole; i < count; ++i) group_[grouped_++] = bytes[i];
  out_.text(text_);
}

void PayloadWriter::end_emit() {
  text_.clear();
  append_base64(text_, group_.data(), grouped_);
  out_.text(text_);
  grouped_ = 0;
}

void PayloadWriter::end() {
  if (seen_ != head_.count) fail("has fewer values than expected");
  if (head_.style == Style::ascii) return out_.end_column();
  if (bit_count_ > 0) {
    const auto rest = static_cast<std::byte>(group_bits_ << (8 - bit_count_) & 0xff);
    push(&rest, 1);
  }
  flush_block();
  end_emit();
  if (form_.compressor != Compressor::none) patch_header();
}

void PayloadWriter::patch_header() {
  std::vector<std::byte> header;
  append_word(header, word(block_sizes_.size()), form_);
  append_word(header, word(head_.block_bytes), form_);
  const bool partial = !block_sizes_.empty() && last_block_ < head_.block_bytes;
  append_word(header, partial ? last_block_ : 0, form_);
  for (const std::uint64_t size : block_sizes_) append_word(header, word(size), form_);
  if (head_.style == Style::raw) return out_.patch(header_at_, view(header.data(), header.size()));
  text_.clear();
  append_base64(text_, header.data(), header.size());
  out_.patch(header_at_, text_);
}

}  // namespace shm::converters::vtu
