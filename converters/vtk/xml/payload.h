// PayloadReader: reads the numbers of VTU arrays from front to back. It supports all encodings:
// text or base64 within the XML, and raw or base64 appended data, with or without compression.
// Memory is bounded: the reader processes one piece of 256 KiB or one compressed block at a time.
// It allocates memory only for bytes that are present, never for a size that the file merely
// states.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "shm/schema.h"
#include "vtk/values.h"
#include "vtk/xml/codec.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtu {

enum class Style : std::uint8_t { ascii, base64, raw };

struct PayloadPlace {
  std::string array;  // name of the array in error messages
  Style style = Style::raw;
  std::uint64_t begin = 0, end = 0;  // byte range in the file
};

class PayloadReader {
 public:
  // `path` is used in error messages. `file_bytes` is the size of the file in bytes. The total
  // number of bytes read and unpacked for all arrays is limited in proportion to the size of the
  // file; if the limit is exceeded, read() throws Failure (over_limit). The limit is needed because
  // many arrays may refer to the same bytes, and compressed data may expand by a large factor.
  PayloadReader(std::shared_ptr<vtk::RandomFile> file, std::string path, ByteForm form,
                std::uint64_t file_bytes);

  // Reads at most `most` numbers and passes them to take(values) in pieces, in host byte order.
  // Returns the count of numbers that were read. If `bits` is true, the array consists of bits;
  // each bit is passed as a uint8 with the value 0 or 1, and `type` must be uint8. Throws Failure.
  using Take = std::function<void(std::span<const std::byte>)>;
  std::uint64_t read(const PayloadPlace& place, ScalarType type, bool bits, std::uint64_t most,
                     const Take& take);
  // Returns the block size in bytes of the array that was read most recently, or 0 if this array
  // was not compressed.
  std::uint64_t block_bytes() const { return block_bytes_; }

 private:
  class Bytes;
  using TakeBytes =
      std::function<bool(std::span<const std::byte>)>;  // returning false stops the decoding
  [[noreturn]] void fail(ErrorCode code, const PayloadPlace& place, std::string detail) const;
  void spend(const PayloadPlace& place, std::uint64_t bytes);
  void decode(const PayloadPlace& place, const TakeBytes& take);
  void decode_plain(const PayloadPlace& place, Bytes& bytes, const TakeBytes& take);
  void decode_blocks(const PayloadPlace& place, Bytes& bytes, const TakeBytes& take);
  std::uint64_t read_binary(const PayloadPlace& place, ScalarType type, std::uint64_t most,
                            const Take& take);
  std::uint64_t read_bits(const PayloadPlace& place, std::uint64_t most, const Take& take);
  std::uint64_t read_text(const PayloadPlace& place, ScalarType type, std::uint64_t most,
                          const Take& take);

  std::shared_ptr<vtk::RandomFile> file_;
  std::string path_;
  ByteForm form_;
  std::uint64_t file_bytes_, room_;  // room_: number of bytes that may still be read and unpacked
  std::uint64_t block_bytes_ = 0;
};

}  // namespace shm::converters::vtu
