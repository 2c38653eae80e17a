// Byte planes: a list of numbers is stored as planes. The first plane contains byte 0 (the least
// significant byte) of all numbers, the second plane contains byte 1 of all numbers, and so on. A
// plane that contains only zeros is not stored; any other plane is stored either uncompressed or
// compressed by zstd.
// spec: "Patterns"
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"

namespace shm {

/// Writes a plane: first its stored size in bytes, then the stored bytes. The stored size is 0 if
/// all bytes of the plane are zero. If the stored size equals the size of the plane, the plane is
/// uncompressed. If it has any other value, the plane is compressed as one zstd frame.
void put_plane(ByteWriter& out, std::span<const std::byte> plane, ZstdCompressor& zstd,
               int level = 1);

/// Reads a plane of `size` bytes. Returns false if the data is damaged.
bool get_plane(ByteReader& in, std::uint64_t size, std::vector<std::byte>& plane,
               ZstdDecompressor& zstd);

/// Returns the number of planes that the numbers need, which is the number of bytes of the largest
/// number.
template <class Word>
std::uint32_t plane_count(std::span<const Word> numbers) {
  Word all = 0;
  for (const Word number : numbers) all |= number;
  return static_cast<std::uint32_t>((std::bit_width(all) + 7) / 8);
}

/// Writes `planes` planes, which contain the low bytes of the numbers.
template <class Word>
void put_planes(ByteWriter& out, std::span<const Word> numbers, std::uint32_t planes,
                std::vector<std::byte>& scratch, ZstdCompressor& zstd) {
  scratch.resize(numbers.size());
  std::byte* const plane = scratch.data();
  for (std::uint32_t b = 0; b < planes; ++b) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
      plane[i] = static_cast<std::byte>(numbers[i] >> 8 * b);
    put_plane(out, scratch, zstd);
  }
}

/// Reads numbers that were stored as `planes` planes. Returns false if the data is damaged.
template <class Word>
bool get_planes(ByteReader& in, std::uint32_t planes, std::span<Word> numbers,
                std::vector<std::byte>& scratch, ZstdDecompressor& zstd) {
  if (planes == 0) std::fill(numbers.begin(), numbers.end(), Word{0});
  for (std::uint32_t b = 0; b < planes; ++b) {
    if (!get_plane(in, numbers.size(), scratch, zstd)) return false;
    const std::byte* const plane = scratch.data();
    if (b == 0)
      for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = std::to_integer<Word>(plane[i]);
    else
      for (std::size_t i = 0; i < numbers.size(); ++i)
        numbers[i] |= std::to_integer<Word>(plane[i]) << 8 * b;
  }
  return true;
}

/// Writes the number of planes, then the planes of `numbers`.
void put_numbers(ByteWriter& out, std::span<const std::uint32_t> numbers,
                 std::vector<std::byte>& scratch, ZstdCompressor& zstd);
/// Reads a list that was written by put_numbers(). The list must contain exactly `count` numbers.
/// Returns false if the data is damaged.
bool get_numbers(ByteReader& in, std::uint64_t count, std::vector<std::uint32_t>& numbers,
                 std::vector<std::byte>& scratch, ZstdDecompressor& zstd);

}  // namespace shm
