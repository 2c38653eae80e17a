// GmshOutput: writes an MSH file through a buffer, with numbers as text or in binary form.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "gmsh/scan.h"

namespace shm::converters {

class GmshOutput {
 public:
  GmshOutput(const std::string& path, GmshEncoding encoding);
  ~GmshOutput();
  GmshOutput(const GmshOutput&) = delete;
  GmshOutput& operator=(const GmshOutput&) = delete;

  void text(std::string_view content);  // writes text verbatim, even if the file is binary

  // If `yes` is true, all following numbers are written as text, even if the file is binary. Some
  // sections of binary files need this, because they are text.
  void write_numbers_as_text(bool yes) { numbers_as_text_ = yes; }
  // The next functions write one number. In text files, numbers on the same line are separated by a
  // space.
  void integer32(std::int64_t value);
  void integer64(std::int64_t value);
  void tag(std::int64_t value, bool wide) { wide ? integer64(value) : integer32(value); }
  void count(std::uint64_t value) { integer64(static_cast<std::int64_t>(value)); }
  void count(std::uint64_t value, bool wide) { tag(static_cast<std::int64_t>(value), wide); }
  void real(double value);
  void end_line();     // ends a line of numbers; does nothing in binary files
  void end_of_data();  // must be called before an end marker; begins a new line if necessary
  void close();        // throws Failure if not all data could be written

 private:
  template <class T>
  void put(T value);
  void flush();
  [[noreturn]] void fail(const char* what) const;

  std::string path_;
  GmshEncoding encoding_;
  std::FILE* file_ = nullptr;
  std::string buffer_;
  bool binary() const { return encoding_.binary && !numbers_as_text_; }

  bool line_begun_ = false, numbers_as_text_ = false;
};

}  // namespace shm::converters
