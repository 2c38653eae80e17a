// Encoding of the numbers in VTU files: VTK's compressors, which compress an array block by block;
// base64; and the properties of the encoding that a file states in its VTKFile element.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shm::converters::vtu {

enum class Compressor : std::uint8_t { none, zlib, lz4, lzma };

// Returns the compressor with a name such as "vtkZLibDataCompressor". Returns nothing for unknown
// names.
std::optional<Compressor> compressor_of_name(std::string_view name);

// Properties of the encoding that are the same for all arrays of a file.
struct ByteForm {
  bool big_endian = false;
  std::size_t header_bytes = 8;  // size in bytes of a number in headers: 4 or 8
  Compressor compressor = Compressor::none;
};

// Returns an upper bound on the compressed size in bytes of a block of `size` bytes. The bound is
// valid for all compressors.
constexpr std::uint64_t most_compressed_bytes(std::uint64_t size) {
  return size + size / 8 + (std::uint64_t{1} << 16);
}

// Decompresses a block and stores the result at `out`. Returns false if the result does not have
// exactly `size` bytes. Precondition: size <= kMostBlockBytes.
bool decompress(Compressor compressor, const std::vector<std::byte>& block, std::byte* out,
                std::size_t size);
// Compresses `size` bytes and returns the result. Precondition: size > 0. Throws Failure (output)
// if memory runs out.
std::vector<std::byte> compress(Compressor compressor, const std::byte* values, std::size_t size);

// Appends the base64 form of `count` bytes to `text`: four characters for three bytes, padded with
// '=' at the end.
void append_base64(std::string& text, const std::byte* bytes, std::size_t count);
constexpr std::uint64_t base64_length(std::uint64_t bytes) { return (bytes + 2) / 3 * 4; }
// Returns the value (0 to 63) of a base64 character, or -1 for other characters.
int base64_value(char c);

// Appends a number to the header of an array, in the byte order of the file.
void append_word(std::vector<std::byte>& out, std::uint64_t word, const ByteForm& form);
std::uint64_t word_at(const std::byte* bytes, const ByteForm& form);

}  // namespace shm::converters::vtu
