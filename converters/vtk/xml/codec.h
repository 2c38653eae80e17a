// How the numbers of VTU files become bytes: the compressors that VTK knows, one block at a time,
// base64, and what the head of a file states of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shm::converters::vtu {

enum class Compressor : std::uint8_t { none, zlib, lz4, lzma };

// "vtkZLibDataCompressor", ...; nothing for other names.
std::optional<Compressor> compressor_of_name(std::string_view name);

// The same for all arrays of a file.
struct ByteForm {
  bool big_endian = false;
  std::size_t header_bytes = 8;  // of a number in headers: 4 or 8
  Compressor compressor = Compressor::none;
};

// Most bytes that a compressed block of `size` bytes may have: more than any compressor makes.
constexpr std::uint64_t most_compressed_bytes(std::uint64_t size) {
  return size + size / 8 + (std::uint64_t{1} << 16);
}

// False when the block is not exactly `size` bytes compressed, size <= kMostBlockBytes.
bool decompress(Compressor compressor, const std::vector<std::byte>& block, std::byte* out,
                std::size_t size);
// `size` > 0. Throws Failure (output) when memory is short.
std::vector<std::byte> compress(Compressor compressor, const std::byte* values, std::size_t size);

// Three bytes as four characters; fewer are padded with '='. `text` gets them appended.
void append_base64(std::string& text, const std::byte* bytes, std::size_t count);
constexpr std::uint64_t base64_length(std::uint64_t bytes) { return (bytes + 2) / 3 * 4; }
// Value of a character, 0 to 63; -1 for others.
int base64_value(char c);

// Words of headers in the byte order of the file.
void append_word(std::vector<std::byte>& out, std::uint64_t word, const ByteForm& form);
std::uint64_t word_at(const std::byte* bytes, const ByteForm& form);

}  // namespace shm::converters::vtu
