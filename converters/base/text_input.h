// TextInput: reads files that mix text and raw binary data (VTK legacy, Gmsh MSH) front to back.
// Error messages state the section and the byte offset. Input is buffered; memory does not grow
// with the file.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "shm/result.h"

namespace shm::converters {

class TextInput {
 public:
  explicit TextInput(const std::string& path);  // throws Failure (io) if the file cannot be opened
  ~TextInput();
  TextInput(const TextInput&) = delete;
  TextInput& operator=(const TextInput&) = delete;

  // Sets the section that later error messages name, e.g. "CELLS" or "$Nodes".
  void enter(std::string section) { section_ = std::move(section); }

  bool at_end();  // returns true if all bytes have been read; does not skip white space

  // Returns the next line without its newline (LF or CRLF). Throws Failure (truncated) at the end
  // of the file.
  std::string line();
  // Returns the next word, delimited by white space. Throws Failure (truncated) at the end of the
  // file. The view is valid until the next call.
  std::string_view word();
  // Returns the next word like word(), but returns an empty view at the end of the file instead of
  // throwing.
  std::string_view word_or_end();
  // Returns the next word without consuming it. Returns an empty view at the end of the file.
  std::string_view peek_word();
  // Skips the rest of the current line, including its newline.
  void skip_line();

  // Reads the next word as a number of type T. A floating-point number may be "nan" or "inf", may
  // have Fortran's form 1.0D+00, and may begin with '+'.
  template <class T>
  T number() {
    const std::string_view text = word();
    T value{};
    if (!parse(text, value)) fail_number(text);
    return value;
  }
  template <class T>
  static bool parse(std::string_view text, T& value) {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc() && end == text.data() + text.size()) return true;
    return parse_slow(text, value);
  }

  // Reads exactly `count` raw bytes. Throws Failure (truncated) if the file ends before that.
  void bytes(std::byte* out, std::size_t count);
  // Moves to an absolute byte offset in the file.
  void seek(std::uint64_t offset);
  void skip_bytes(std::uint64_t count);

  std::uint64_t offset() const { return base_ + begin_; }  // offset of the next unread byte
  std::uint64_t size() const { return size_; }
  std::uint64_t left() const { return size_ - offset(); }
  const std::string& path() const { return path_; }

  [[noreturn]] void fail(ErrorCode code, const std::string& detail) const;
  // Throws Failure (corrupt) unless `count` items of at least `bytes_each` bytes fit into the rest
  // of the file. Call it before allocating memory for a count that the file states.
  void expect_room(std::uint64_t count, std::uint64_t bytes_each, const char* what) const;

 private:
  bool fill();  // reads more bytes and appends them to the buffer; returns false at the end
  void skip_space();
  [[noreturn]] void fail_number(std::string_view text) const;
  static bool parse_slow(std::string_view text, double& value);
  static bool parse_slow(std::string_view text, float& value);
  template <class T>
  static bool parse_slow(std::string_view, T&) {
    return false;
  }

  std::string path_, section_;
  std::FILE* file_ = nullptr;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;  // unread part of buffer_
  std::uint64_t base_ = 0;           // offset in the file of buffer_[0]
  std::uint64_t size_ = 0;
};

}  // namespace shm::converters
