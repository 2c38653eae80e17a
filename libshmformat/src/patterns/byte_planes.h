// Numbers as byte planes: byte 0, the least significant, of all of them, then byte 1. Each plane
// for itself: nothing where it is zero, as it stands, or under zstd. spec: "Patterns"
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bytes/binary.h"
#include "bytes/packing.h"

namespace shm {

/// A plane: how many bytes it takes, then these. 0: it is zero; as many as it has: as it stands;
/// else one zstd frame.
void put_plane(ByteWriter& out, std::span<const std::byte> plane, ZstdCompressor& zstd);

/// A plane of `size` bytes; false for damaged data.
bool get_plane(ByteReader& in, std::uint64_t size, std::vector<std::byte>& plane,
               ZstdDecompressor& zstd);

/// Bytes of the largest number.
template <class Word>
std::uint32_t plane_count(std::span<const Word> numbers) {
  Word all = 0;
  for (const Word it : numbers) all |= it;
  return static_cast<std::uint32_t>((std::bit_width(all) + 7) / 8);
}

/// `planes` bytes of each number. `room` is scratch.
template <class Word>
void put_planes(ByteWriter& out, std::span<const Word> numbers, std::uint32_t planes,
                std::vector<std::byte>& room, ZstdCompressor& zstd) {
  room.resize(numbers.size());
  std::byte* const plane = room.data();
  for (std::uint32_t b = 0; b < planes; ++b) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
      plane[i] = static_cast<std::byte>(numbers[i] >> 8 * b);
    put_plane(out, room, zstd);
  }
}

/// Numbers of `planes` bytes; false for damaged data.
template <class Word>
bool get_planes(ByteReader& in, std::uint32_t planes, std::span<Word> numbers,
                std::vector<std::byte>& room, ZstdDecompressor& zstd) {
  if (planes == 0) std::fill(numbers.begin(), numbers.end(), Word{0});
  for (std::uint32_t b = 0; b < planes; ++b) {
    if (!get_plane(in, numbers.size(), room, zstd)) return false;
    const std::byte* const plane = room.data();
    if (b == 0)
      for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = std::to_integer<Word>(plane[i]);
    else
      for (std::size_t i = 0; i < numbers.size(); ++i)
        numbers[i] |= std::to_integer<Word>(plane[i]) << 8 * b;
  }
  return true;
}

/// Numbers, with how many bytes each has.
void put_numbers(ByteWriter& out, std::span<const std::uint32_t> numbers,
                 std::vector<std::byte>& room, ZstdCompressor& zstd);
/// Exactly `count`; false for damaged data.
bool get_numbers(ByteReader& in, std::uint64_t count, std::vector<std::uint32_t>& numbers,
                 std::vector<std::byte>& room, ZstdDecompressor& zstd);

}  // namespace shm
