// Classes that read the numbers of an MSH file. A section has the same layout in ASCII and in
// binary files, so the same code reads both.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "base/text_input.h"

namespace shm::converters {

template <class T>
T swap_bytes(T value) {
  std::byte bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

struct GmshEncoding {
  bool binary = false;
  bool swapped = false;  // true if the bytes of binary numbers must be swapped
};

// Reads numbers directly from the file. Throws Failure if the file does not continue with a valid
// number.
class GmshScan {
 public:
  explicit GmshScan(TextInput& input) : input_(&input) {}
  GmshEncoding encoding;

  std::int64_t integer32() { return encoding.binary ? raw<std::int32_t>() : text32(); }
  std::int64_t integer64() {
    if (!encoding.binary) return input_->number<std::int64_t>();
    return raw<std::int64_t>();
  }
  // Reads a tag, which has 64 bits in version 4.1 and 32 bits in earlier versions.
  std::int64_t tag(bool wide) { return wide ? integer64() : integer32(); }
  std::uint64_t count() {
    const std::int64_t value = integer64();
    if (value < 0) input_->fail(ErrorCode::corrupt, "a count is negative");
    return static_cast<std::uint64_t>(value);
  }
  std::uint64_t text_count() {
    const auto value = input_->number<std::int64_t>();
    if (value < 0) input_->fail(ErrorCode::corrupt, "a count is negative");
    return static_cast<std::uint64_t>(value);
  }
  double real() { return encoding.binary ? raw<double>() : input_->number<double>(); }
  void reals(std::span<double> out) {
    for (double& value : out) value = real();
  }

 private:
  template <class T>
  T raw() {
    T value;
    input_->bytes(reinterpret_cast<std::byte*>(&value), sizeof(T));
    return encoding.swapped ? swap_bytes(value) : value;
  }
  std::int64_t text32() {
    const auto value = input_->number<std::int64_t>();
    if (value < std::numeric_limits<std::int32_t>::min() ||
        value > std::numeric_limits<std::int32_t>::max())
      input_->fail(ErrorCode::corrupt,
                   "the number " + std::to_string(value) + " does not fit 32 bits");
    return value;
  }
  TextInput* input_;
};

// Reads numbers of a section that is in memory. Does not throw: from the first invalid number on,
// good() returns false, and every number is read as 0.
class GmshMemoryScan {
 public:
  GmshMemoryScan(std::string_view content, GmshEncoding encoding)
      : left_(content), encoding_(encoding) {}

  bool good() const { return good_; }
  std::size_t left() const { return left_.size(); }
  std::int64_t integer32() { return encoding_.binary ? raw<std::int32_t>() : text<std::int64_t>(); }
  std::int64_t integer64() { return encoding_.binary ? raw<std::int64_t>() : text<std::int64_t>(); }
  double real() { return encoding_.binary ? raw<double>() : text<double>(); }
  // Reads a count of items. If the count exceeds the number of bytes left in the section, returns
  // 0, and good() becomes false.
  std::uint64_t count() {
    const std::int64_t value = integer64();
    if (value < 0 || static_cast<std::uint64_t>(value) > left_.size()) good_ = false;
    return good_ ? static_cast<std::uint64_t>(value) : 0;
  }
  // Reads a count of 64 bits if `wide` is true. Otherwise reads a count of 32 bits, as some
  // sections of MSH 4.0 use.
  std::uint64_t count(bool wide) {
    if (wide) return count();
    const std::int64_t value = integer32();
    if (value < 0 || static_cast<std::uint64_t>(value) > left_.size()) good_ = false;
    return good_ ? static_cast<std::uint64_t>(value) : 0;
  }
  std::int64_t tag(bool wide) { return wide ? integer64() : integer32(); }
  bool binary() const { return encoding_.binary; }
  std::string_view word() {
    skip_space();
    const std::size_t length = std::min(left_.find_first_of(" \t\r\n"), left_.size());
    const std::string_view found = left_.substr(0, length);
    left_.remove_prefix(length);
    if (found.empty()) good_ = false;
    return found;
  }
  std::string_view peek_word() {
    const GmshMemoryScan saved = *this;
    const std::string_view found = word();
    *this = saved;
    return found;
  }
  std::string_view rest_of_line() {
    const std::size_t length = std::min(left_.find('\n'), left_.size());
    const std::string_view found = left_.substr(0, length);
    left_.remove_prefix(std::min(length + 1, left_.size()));
    return found;
  }
  bool only_space_left() {
    skip_space();
    return left_.empty();
  }

 private:
  void skip_space() {
    left_.remove_prefix(std::min(left_.find_first_not_of(" \t\r\n"), left_.size()));
  }
  template <class T>
  T raw() {
    T value{};
    if (left_.size() < sizeof(T)) good_ = false;
    if (!good_) return value;
    std::memcpy(&value, left_.data(), sizeof(T));
    left_.remove_prefix(sizeof(T));
    return encoding_.swapped ? swap_bytes(value) : value;
  }
  template <class T>
  T text() {
    T value{};
    if (!good_ || !TextInput::parse(word(), value)) good_ = false;
    return good_ ? value : T{};
  }

  std::string_view left_;
  GmshEncoding encoding_;
  bool good_ = true;
};

}  // namespace shm::converters
