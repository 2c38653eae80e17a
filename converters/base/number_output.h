// NumberOutput: a file being written front to back: text, or numbers as text or big-endian bytes.
// Buffered; every refusal of the operating system is thrown as Failure (output).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

class NumberOutput {
 public:
  NumberOutput(const std::string& path, bool binary);
  ~NumberOutput();
  NumberOutput(const NumberOutput&) = delete;
  NumberOutput& operator=(const NumberOutput&) = delete;

  bool binary() const { return binary_; }
  void text(std::string_view text);
  void line(std::string_view words) {
    text(words);
    text("\n");
  }
  // `count` values in host order. As text: separated by blanks, `per_line` to a line.
  void numbers(ScalarType type, const std::byte* values, std::size_t count, std::size_t per_line);
  // Ends the last line of a column of numbers.
  void end_column() {
    if (binary_ || in_line_ > 0) text("\n");
    in_line_ = 0;
  }
  // Bytes so far, and others over what stands at `offset`, all of them before position().
  std::uint64_t position() const { return flushed_ + buffer_.size(); }
  void patch(std::uint64_t offset, std::string_view text);
  // Hands everything to the operating system. The file is good only if this returns.
  void finish();

 private:
  template <class T>
  void number_text(const T* values, std::size_t count, std::size_t per_line);
  void flush();
  [[noreturn]] void fail(const char* what) const;

  std::string path_;
  bool binary_;
  int descriptor_ = -1;
  std::size_t in_line_ = 0;  // numbers in the current line
  std::uint64_t flushed_ = 0;
  std::vector<char> buffer_;
  std::vector<std::byte> swapped_;
};

}  // namespace shm::converters
