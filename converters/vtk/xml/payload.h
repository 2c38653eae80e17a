// The numbers of one array of a VTU file, read front to back wherever and however they stand:
// text or base64 within the XML, raw or base64 appended bytes, compressed or not. Bounded memory:
// pieces of 256 KiB, or one compressed block; no stated size counts before its bytes are there.
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
  std::string array;  // what errors name
  Style style = Style::raw;
  std::uint64_t begin = 0, end = 0;  // in the file
};

class PayloadReader {
 public:
  // `path`: the file of `file_bytes`, for errors. What all arrays together take is limited by
  // its size: they may share their bytes, and bytes may unpack to very many (over_limit).
  PayloadReader(std::shared_ptr<vtk::RandomFile> file, std::string path, ByteForm form,
                std::uint64_t file_bytes);

  // Calls take(values) with at most `most` numbers in host order, in pieces; returns how many
  // there were. Bits (`bits`, with type uint8) come as 0 and 1. Throws Failure.
  using Take = std::function<void(std::span<const std::byte>)>;
  std::uint64_t read(const PayloadPlace& place, ScalarType type, bool bits, std::uint64_t most,
                     const Take& take);
  // Bytes of a block of the payload read last; 0 when it was not compressed.
  std::uint64_t block_bytes() const { return block_bytes_; }

 private:
  class Bytes;
  using TakeBytes = std::function<bool(std::span<const std::byte>)>;  // false: enough
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
  std::uint64_t file_bytes_, room_;  // bytes that may still be read and unpacked
  std::uint64_t block_bytes_ = 0;
};

}  // namespace shm::converters::vtu
