#include "codecs/patterns/byte_planes.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;

constexpr std::size_t kSize = 1000;

Bytes stored(const Bytes& plane) {
  ByteWriter out;
  ZstdCompressor zstd;
  put_plane(out, plane, zstd);
  return std::move(out.bytes);
}

/// Reads a plane of kSize bytes. Returns false if it is damaged, or if bytes follow it.
bool read(const Bytes& bytes, Bytes& plane) {
  ByteReader in(bytes);
  ZstdDecompressor zstd;
  return get_plane(in, kSize, plane, zstd) && in.left() == 0;
}

/// Returns a stored plane: its stored size, followed by `bytes`.
Bytes with_size(std::uint64_t size, const Bytes& bytes) {
  ByteWriter out;
  out.put_varint(size);
  out.put_bytes(bytes);
  return std::move(out.bytes);
}

Bytes noise(std::size_t size) {
  std::mt19937 random(1);
  Bytes bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

TEST(BytePlanes, TakeTheSmallestForm) {
  const Bytes zeros(kSize), ones(kSize, std::byte{1}), wild = noise(kSize);
  EXPECT_EQ(stored(zeros).size(), 1u);
  EXPECT_LT(stored(ones).size(), 30u);
  EXPECT_EQ(stored(wild), with_size(kSize, wild));
  for (const Bytes& plane : {zeros, ones, wild}) {
    Bytes back = noise(3);
    EXPECT_TRUE(read(stored(plane), back));
    EXPECT_EQ(back, plane);
  }
}

TEST(BytePlanes, DamagedOnesAreRefused) {
  Bytes back;
  EXPECT_FALSE(read({}, back));
  EXPECT_FALSE(read(with_size(kSize + 1, noise(kSize + 1)), back));  // larger than the plane
  EXPECT_FALSE(read(with_size(kSize, noise(kSize - 1)), back));      // fewer bytes than its size
  EXPECT_FALSE(read(with_size(9, noise(9)), back));                  // not a zstd frame
  // Frames of planes of other sizes
  ZstdCompressor zstd;
  for (const std::size_t size : {kSize - 1, kSize + 1}) {
    const auto frame = zstd.compress(Bytes(size, std::byte{1}), 1);
    EXPECT_FALSE(read(with_size(frame.size(), {frame.begin(), frame.end()}), back));
  }
}

TEST(BytePlanes, NumbersOfEveryWidth) {
  ZstdCompressor zstd;
  ZstdDecompressor unzstd;
  Bytes scratch;
  for (const std::uint32_t largest : {0u, 1u, 255u, 256u, 65535u, 65536u, 1u << 24, ~0u}) {
    std::vector<std::uint32_t> numbers(300), back(7);
    for (std::size_t i = 0; i < numbers.size(); ++i)
      numbers[i] = i % 3 == 0 ? largest : largest / static_cast<std::uint32_t>(i + 1);
    ByteWriter out;
    put_numbers(out, numbers, scratch, zstd);
    ByteReader in(out.bytes);
    EXPECT_TRUE(get_numbers(in, numbers.size(), back, scratch, unzstd));
    EXPECT_EQ(back, numbers);
    EXPECT_EQ(in.left(), 0u);
    // A list of another length is refused.
    if (largest == 0) continue;
    ByteReader again(out.bytes);
    EXPECT_FALSE(get_numbers(again, numbers.size() - 1, back, scratch, unzstd));
  }
  // A number has at most four bytes.
  const Bytes five{std::byte{5}, std::byte{0}, std::byte{0},
                   std::byte{0}, std::byte{0}, std::byte{0}};
  ByteReader in(five);
  std::vector<std::uint32_t> back;
  EXPECT_FALSE(get_numbers(in, 1, back, scratch, unzstd));
}

}  // namespace
}  // namespace shm
