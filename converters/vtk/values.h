// Values: a column of numbers in a VTK legacy file. Binary numbers stay in the file and are
// converted to host byte order when they are read. Numbers in a text file are parsed once and
// stored in the spool.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/spool.h"
#include "base/text_input.h"
#include "shm/schema.h"

namespace shm::converters::vtk {

// Converts `count` numbers to another type. A value outside the range of the new type becomes the
// nearest value in the range.
void convert_numbers(ScalarType from, const std::byte* in, std::size_t count, ScalarType to,
                     std::byte* out);

// Reads bytes at any offset of a file. The object has no file position, so several readers can use
// it.
class RandomFile {
 public:
  explicit RandomFile(const std::string& path);
  ~RandomFile();
  RandomFile(const RandomFile&) = delete;
  RandomFile& operator=(const RandomFile&) = delete;
  void read(std::uint64_t offset, std::byte* out, std::size_t count) const;

 private:
  std::string path_;
  int descriptor_ = -1;
};

class Values {
 public:
  Values() = default;
  // Constructs a column from the next `count` numbers of `input`. In a binary file, `input` must be
  // at the first byte after the line that announces the numbers; in a text file, before the first
  // number. The constructor skips binary numbers. It parses numbers in a text file and stores them
  // in `spool`.
  Values(TextInput& input, std::shared_ptr<RandomFile> binary_file, Spool& spool, ScalarType type,
         std::uint64_t count);
  // Constructs a column from numbers that are already in a spool.
  Values(ScalarType type, PagedArray numbers)
      : type_(type), size_(numbers.size()), offset_(kNoOffset), parsed_(std::move(numbers)) {}

  ScalarType type() const { return type_; }
  std::uint64_t size() const { return size_; }
  std::uint64_t offset() const { return offset_; }  // offset of the first number in the file
  void read(std::uint64_t first, std::uint64_t count, std::byte* out);
  // Returns true if both columns have the same type and bit-identical numbers.
  bool equals(Values& other);

 private:
  ScalarType type_ = ScalarType::float64;
  std::uint64_t size_ = 0;
  std::uint64_t offset_ = 0;
  std::shared_ptr<RandomFile> file_;  // null if the numbers were parsed from text
  std::optional<PagedArray> parsed_;
};

// Iterates over a column of integers from front to back.
class IntegerCursor {
 public:
  explicit IntegerCursor(Values& values) : values_(&values) {}
  std::uint64_t left() const { return values_->size() - position_; }
  std::int64_t next();  // precondition: left() > 0
  void rewind() {
    position_ = 0;
    buffer_first_ = buffer_end_ = 0;
  }

 private:
  void fill();
  Values* values_;
  std::uint64_t position_ = 0, buffer_first_ = 0, buffer_end_ = 0;
  std::vector<std::byte> raw_;
  std::vector<std::int64_t> buffer_;
};

}  // namespace shm::converters::vtk
