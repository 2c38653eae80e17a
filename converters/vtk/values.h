// Columns of numbers of a VTK legacy file: binary ones stay in the file and are swapped to host
// order when read; text is parsed once into the spool.
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

// `count` numbers as another type; what it cannot hold becomes the nearest value that it can.
void convert_numbers(ScalarType from, const std::byte* in, std::size_t count, ScalarType to,
                     std::byte* out);

// Reads anywhere in a file, without moving anyone's position.
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
  // Takes `count` numbers from where `input` stands: behind the line that announces them (binary)
  // or before the first one (text). Binary numbers are skipped over, text is parsed into `spool`.
  Values(TextInput& input, std::shared_ptr<RandomFile> binary_file, Spool& spool, ScalarType type,
         std::uint64_t count);
  // Takes over numbers that are in a spool.
  Values(ScalarType type, PagedArray numbers)
      : type_(type), size_(numbers.size()), offset_(kNoOffset), parsed_(std::move(numbers)) {}

  ScalarType type() const { return type_; }
  std::uint64_t size() const { return size_; }
  std::uint64_t offset() const { return offset_; }  // in the file, of the first number
  void read(std::uint64_t first, std::uint64_t count, std::byte* out);
  // Whether both have the same numbers, bit by bit, of the same type.
  bool equals(Values& other);

 private:
  ScalarType type_ = ScalarType::float64;
  std::uint64_t size_ = 0;
  std::uint64_t offset_ = 0;
  std::shared_ptr<RandomFile> file_;  // null: parsed text
  std::optional<PagedArray> parsed_;
};

// Walks an integer column from front to back.
class IntegerCursor {
 public:
  explicit IntegerCursor(Values& values) : values_(&values) {}
  std::uint64_t left() const { return values_->size() - position_; }
  std::int64_t next();  // must not be called when nothing is left
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
