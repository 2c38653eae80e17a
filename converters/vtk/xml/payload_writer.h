// PayloadWriter: writes the numbers of one VTU array as text, base64 or raw bytes. The bytes may be
// compressed block by block. PayloadReader is the counterpart for reading.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/output_file.h"
#include "shm/schema.h"
#include "vtk/xml/codec.h"
#include "vtk/xml/payload.h"

namespace shm::converters::vtu {

class PayloadWriter {
 public:
  PayloadWriter(NumberOutput& out, ByteForm form) : out_(out), form_(form) {}

  struct Head {
    std::string array;  // name of the array in error messages
    Style style = Style::raw;
    ScalarType type = ScalarType::float64;
    bool bits = false;        // true: the values 0 and 1 are passed as uint8 and written as bits
    std::uint64_t count = 0;  // number of values of the array
    std::uint64_t block_bytes = kUsualBlockBytes;
  };
  // To write an array, call begin(), then numbers() until all `count` numbers have been passed in
  // host byte order, then end().
  void begin(const Head& head);
  void numbers(const std::byte* values, std::size_t count);
  void end();

 private:
  [[noreturn]] void fail(std::string detail) const;
  std::uint64_t word(std::uint64_t value) const;
  void push(const std::byte* bytes, std::size_t count);
  void push_bits(const std::byte* values, std::size_t count);
  void emit(const std::byte* bytes, std::size_t count);
  void end_emit();
  void flush_block();
  void patch_header();

  NumberOutput& out_;
  ByteForm form_;
  Head head_;
  std::uint64_t seen_ = 0, header_at_ = 0;
  std::vector<std::byte> swapped_, block_, bits_;
  std::vector<std::uint64_t> block_sizes_;
  std::array<std::byte, 3> group_{};  // bytes of an incomplete base64 group
  std::size_t grouped_ = 0;
  std::uint8_t group_bits_ = 0;  // bits of an incomplete byte of a bit array
  unsigned bit_count_ = 0;
  std::uint64_t last_block_ = 0;
  std::string text_;
};

}  // namespace shm::converters::vtu
