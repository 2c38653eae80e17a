#include "vtk/xml/codec.h"

#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <new>

#include "base/failure.h"

namespace shm::converters::vtu {
namespace {

// Compression levels. Files do not store the level, so these are VTK's defaults. LZ4 has no level.
constexpr int kZlibLevel = 5;
constexpr std::uint32_t kLzmaPreset = 5;
// Memory limit of LZMA in bytes; the largest preset needs 65 MiB.
constexpr std::uint64_t kLzmaMemory = std::uint64_t{128} << 20;

constexpr std::string_view kBase64Digits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

bool inflate_block(const std::vector<std::byte>& block, std::byte* out, std::size_t size) {
  uLongf made = size;
  const int result = ::uncompress(reinterpret_cast<Bytef*>(out), &made,
                                  reinterpret_cast<const Bytef*>(block.data()), block.size());
  if (result == Z_MEM_ERROR) throw std::bad_alloc();
  return result == Z_OK && made == size;
}

bool lz4_block(const std::vector<std::byte>& block, std::byte* out, std::size_t size) {
  const int made = ::LZ4_decompress_safe(reinterpret_cast<const char*>(block.data()),
                                         reinterpret_cast<char*>(out),
                                         static_cast<int>(block.size()), static_cast<int>(size));
  return made >= 0 && static_cast<std::size_t>(made) == size;
}

bool lzma_block(const std::vector<std::byte>& block, std::byte* out, std::size_t size) {
  std::uint64_t memory = kLzmaMemory;
  std::size_t in_at = 0, out_at = 0;
  const lzma_ret result = ::lzma_stream_buffer_decode(
      &memory, 0, nullptr, reinterpret_cast<const std::uint8_t*>(block.data()), &in_at,
      block.size(), reinterpret_cast<std::uint8_t*>(out), &out_at, size);
  if (result == LZMA_MEM_ERROR) throw std::bad_alloc();
  return result == LZMA_OK && out_at == size;
}

[[noreturn]] void fail_compress() {
  throw Failure(ErrorCode::output, "an array cannot be compressed");
}

std::size_t deflate_block(const std::byte* values, std::size_t size, std::vector<std::byte>& out) {
  uLongf made = out.size();
  const int result = ::compress2(reinterpret_cast<Bytef*>(out.data()), &made,
                                 reinterpret_cast<const Bytef*>(values), size, kZlibLevel);
  if (result == Z_MEM_ERROR) throw std::bad_alloc();
  if (result != Z_OK) fail_compress();
  return made;
}

std::size_t make_lz4_block(const std::byte* values, std::size_t size, std::vector<std::byte>& out) {
  const int made = ::LZ4_compress_default(reinterpret_cast<const char*>(values),
                                          reinterpret_cast<char*>(out.data()),
                                          static_cast<int>(size), static_cast<int>(out.size()));
  if (made <= 0) fail_compress();
  return static_cast<std::size_t>(made);
}

// Compresses a block with LZMA. The dictionary is not much larger than the block, because preparing
// a large dictionary would slow down the encoder.
std::size_t make_lzma_block(const std::byte* values, std::size_t size,
                            std::vector<std::byte>& out) {
  lzma_options_lzma options;
  if (::lzma_lzma_preset(&options, kLzmaPreset)) fail_compress();
  while (options.dict_size > LZMA_DICT_SIZE_MIN && options.dict_size / 2 >= size)
    options.dict_size /= 2;
  lzma_filter filters[2] = {{LZMA_FILTER_LZMA2, &options}, {LZMA_VLI_UNKNOWN, nullptr}};
  std::size_t made = 0;
  const lzma_ret result = ::lzma_stream_buffer_encode(
      filters, LZMA_CHECK_CRC32, nullptr, reinterpret_cast<const std::uint8_t*>(values), size,
      reinterpret_cast<std::uint8_t*>(out.data()), &made, out.size());
  if (result == LZMA_MEM_ERROR) throw std::bad_alloc();
  if (result != LZMA_OK) fail_compress();
  return made;
}

}  // namespace

std::optional<Compressor> compressor_of_name(std::string_view name) {
  if (name.empty()) return Compressor::none;
  if (name == "vtkZLibDataCompressor") return Compressor::zlib;
  if (name == "vtkLZ4DataCompressor") return Compressor::lz4;
  if (name == "vtkLZMADataCompressor") return Compressor::lzma;
  return std::nullopt;
}

bool decompress(Compressor compressor, const std::vector<std::byte>& block, std::byte* out,
                std::size_t size) {
  switch (compressor) {
    case Compressor::zlib: return inflate_block(block, out, size);
    case Compressor::lz4: return lz4_block(block, out, size);
    case Compressor::lzma: return lzma_block(block, out, size);
    case Compressor::none: break;
  }
  return false;
}

std::vector<std::byte> compress(Compressor compressor, const std::byte* values, std::size_t size) {
  std::vector<std::byte> out(most_compressed_bytes(size));
  switch (compressor) {
    case Compressor::zlib: out.resize(deflate_block(values, size, out)); break;
    case Compressor::lz4: out.resize(make_lz4_block(values, size, out)); break;
    case Compressor::lzma: out.resize(make_lzma_block(values, size, out)); break;
    case Compressor::none: fail_compress();
  }
  return out;
}

void append_base64(std::string& text, const std::byte* bytes, std::size_t count) {
  for (std::size_t offset = 0; offset < count; offset += 3) {
    std::uint32_t three = 0;
    const std::size_t here = count - offset < 3 ? count - offset : 3;
    for (std::size_t i = 0; i < 3; ++i)
      three = three << 8 | (i < here ? static_cast<std::uint32_t>(bytes[offset + i]) : 0U);
    for (std::size_t i = 0; i < 4; ++i)
      text += i <= here ? kBase64Digits[three >> (18 - 6 * i) & 63U] : '=';
  }
}

int base64_value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

void append_word(std::vector<std::byte>& out, std::uint64_t word, const ByteForm& form) {
  for (std::size_t i = 0; i < form.header_bytes; ++i) {
    const std::size_t byte = form.big_endian ? form.header_bytes - 1 - i : i;
    out.push_back(static_cast<std::byte>(word >> (8 * byte) & 0xffU));
  }
}

std::uint64_t word_at(const std::byte* bytes, const ByteForm& form) {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < form.header_bytes; ++i) {
    const std::size_t byte = form.big_endian ? i : form.header_bytes - 1 - i;
    word = word << 8 | static_cast<std::uint64_t>(bytes[byte]);
  }
  return word;
}

}  // namespace shm::converters::vtu
