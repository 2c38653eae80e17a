// Byte planes: the first plane contains byte 0 (the least significant byte) of all numbers, the
// next plane byte 1 of all numbers, and so on. A plane of zeros is left out; any other plane is
// stored either uncompressed or compressed by zstd.
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

/// Writes a plane: the stored size in bytes, followed by the stored bytes. A stored size of 0 means
/// that all bytes of the plane are zero. If the stored size equals the size of the plane, the plane
/// is uncompressed; any other size belongs to one zstd frame.
void put_plane(ByteWriter& out, std::span<const std::byte> plane, ZstdCompressor& zstd);

/// Reads a plane of `size` bytes. Returns false if the data is damaged.
bool get_plane(ByteReader& in, std::uint64_t size, std::vector<std::byte>& plane,
               ZstdDecompressor& zstd);

/// Returns the size in bytes of the largest number, which is the number of planes.
template <class Word>
std::uint32_t plane_count(std::span<const Word> numbers) {
  Word all = 0;
  for (const Word number : numbers) all |= number;
  return static_cast<std::uint32_t>((std::bit_width(all) + 7) / 8);
}

/// Writes the `planes` low bytes of each number as planes.
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

/// Reads numbers of `planes` bytes each. Returns false if the data is damaged.
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
/// Reads the list that put_numbers() writes for exactly `count` numbers. Returns false if the data
/// is damaged.
bool get_numbers(ByteReader& in, std::uint64_t count, std::vector<std::uint32_t>& numbers,
                 std::vector<std::byte>& scratch, ZstdDecompressor& zstd);

}  // namespace shm
