#include "base/text_input.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>

#include "base/failure.h"

namespace shm::converters {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;
// Maximum length of a line in bytes. No valid text file has longer lines.
constexpr std::size_t kLongestLine = std::size_t{1} << 26;

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

}  // namespace

TextInput::TextInput(const std::string& path) : path_(path), buffer_(kBufferBytes) {
  file_ = std::fopen(path.c_str(), "rb");
  struct stat status {};
  if (file_ == nullptr && errno == ENOMEM) throw std::bad_alloc();
  if (file_ == nullptr || ::fstat(::fileno(file_), &status) != 0)
    throw Failure(ErrorCode::io, std::string("cannot open: ") + std::strerror(errno), path);
  if (!S_ISREG(status.st_mode)) {
    std::fclose(file_);
    throw Failure(ErrorCode::io, "is not a regular file", path);
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

TextInput::~TextInput() {
  if (file_ != nullptr) std::fclose(file_);
}

bool TextInput::fill() {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    base_ += begin_;
    end_ -= begin_;
    begin_ = 0;
  }
  if (end_ == buffer_.size()) {
    if (buffer_.size() >= kLongestLine) fail(ErrorCode::corrupt, "a line or word is too long");
    buffer_.resize(buffer_.size() * 2);
  }
  const std::size_t n = std::fread(buffer_.data() + end_, 1, buffer_.size() - end_, file_);
  if (n == 0 && std::ferror(file_) != 0)
    fail(ErrorCode::io, std::string("cannot read: ") + std::strerror(errno));
  end_ += n;
  return n > 0;
}

bool TextInput::at_end() { return begin_ == end_ && !fill(); }

std::string TextInput::line() {
  std::size_t scanned = 0;
  while (true) {
    const char* start = buffer_.data() + begin_;
    const auto* stop =
        static_cast<const char*>(std::memchr(start + scanned, '\n', end_ - begin_ - scanned));
    if (stop != nullptr) {
      std::string text(start, stop);
      begin_ += text.size() + 1;
      if (!text.empty() && text.back() == '\r') text.pop_back();
      return text;
    }
    scanned = end_ - begin_;
    if (!fill()) break;
  }
  if (begin_ == end_) fail(ErrorCode::truncated, "the file ends here");
  std::string text(buffer_.data() + begin_, buffer_.data() + end_);
  begin_ = end_;
  if (!text.empty() && text.back() == '\r') text.pop_back();
  return text;
}

void TextInput::skip_space() {
  while (true) {
    while (begin_ < end_ && is_space(buffer_[begin_])) ++begin_;
    if (begin_ < end_ || !fill()) return;
  }
}

std::string_view TextInput::peek_word() {
  skip_space();
  std::size_t length = 0;
  while (true) {
    while (begin_ + length < end_ && !is_space(buffer_[begin_ + length])) ++length;
    if (begin_ + length < end_ || !fill()) break;
  }
  return {buffer_.data() + begin_, length};
}

std::string_view TextInput::word_or_end() {
  const std::string_view text = peek_word();
  begin_ += text.size();
  return text;
}

std::string_view TextInput::word() {
  const std::string_view text = word_or_end();
  if (text.empty()) fail(ErrorCode::truncated, "the file ends where a value is expected");
  return text;
}

void TextInput::skip_line() {
  while (true) {
    const auto* stop =
        static_cast<const char*>(std::memchr(buffer_.data() + begin_, '\n', end_ - begin_));
    if (stop != nullptr) {
      begin_ = static_cast<std::size_t>(stop - buffer_.data()) + 1;
      return;
    }
    begin_ = end_;
    if (!fill()) return;
  }
}

void TextInput::bytes(std::byte* out, std::size_t count) {
  if (count > left()) fail(ErrorCode::truncated, "the file ends within binary data");
  while (count > 0) {
    if (begin_ == end_ && !fill()) fail(ErrorCode::truncated, "the file ends within binary data");
    const std::size_t n = std::min(count, end_ - begin_);
    std::memcpy(out, buffer_.data() + begin_, n);
    begin_ += n;
    out += n;
    count -= n;
  }
}

void TextInput::seek(std::uint64_t offset) {
  if (offset > size_) fail(ErrorCode::truncated, "the file ends before its data does");
  if (::fseeko(file_, static_cast<off_t>(offset), SEEK_SET) != 0)
    fail(ErrorCode::io, std::string("cannot seek: ") + std::strerror(errno));
  begin_ = end_ = 0;
  base_ = offset;
}

void TextInput::skip_bytes(std::uint64_t count) {
  if (count <= end_ - begin_) {
    begin_ += count;
    return;
  }
  if (count > left()) fail(ErrorCode::truncated, "the file ends within binary data");
  seek(offset() + count);
}

void TextInput::fail(ErrorCode code, const std::string& detail) const {
  throw Failure(Error{code, detail, section_, offset(), path_});
}

void TextInput::fail_number(std::string_view text) const {
  fail(ErrorCode::corrupt,
       "'" + std::string(text.substr(0, 40)) + "' is not a number of the expected type");
}

void TextInput::expect_room(std::uint64_t count, std::uint64_t bytes_each, const char* what) const {
  if (bytes_each != 0 && count > left() / bytes_each)
    fail(ErrorCode::corrupt, "states " + std::to_string(count) + " " + what + ", more than the " +
                                 std::to_string(left()) + " bytes left can hold");
}

bool TextInput::parse_slow(std::string_view text, double& value) {
  std::string copy(text);
  for (char& c : copy)
    if (c == 'd' || c == 'D') c = 'e';
  const auto [end, error] = std::from_chars(copy.data(), copy.data() + copy.size(), value);
  if (copy.empty() || end != copy.data() + copy.size()) return false;
  if (error == std::errc()) return true;
  if (error != std::errc::result_out_of_range) return false;
  // As with strtod, a number that is too large becomes infinity, and a number that is too small
  // becomes zero.
  const bool negative = copy.front() == '-';
  const std::size_t e = copy.find_first_of("eE");
  const bool tiny = e != std::string::npos && e + 1 < copy.size() && copy[e + 1] == '-';
  value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
  if (negative) value = -value;
  return true;
}

bool TextInput::parse_slow(std::string_view text, float& value) {
  double wide = 0;
  if (!parse(text, wide)) return false;
  value = static_cast<float>(wide);
  return true;
}

}  // namespace shm::converters
