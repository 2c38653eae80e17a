#include "base/packing.h"
#include "base/binary.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;

Bytes noise(std::size_t size) {
  std::mt19937_64 random(1);
  Bytes bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random());
  return bytes;
}
Bytes packed(const Bytes& blob) {
  ByteWriter out;
  put_packed(out, blob);
  return std::move(out.bytes);
}
std::optional<Bytes> unpacked(std::span<const std::byte> bytes, std::uint64_t limit = 1 << 30) {
  ByteReader in(bytes);
  return get_packed(in, limit);
}

TEST(Packing, WhateverIsSmaller) {
  for (std::size_t size : {0u, 1u, 64u, 65u, 1000u, 300000u}) {
    const Bytes zeros(size), wild = noise(size);
    EXPECT_EQ(unpacked(packed(zeros)), zeros);
    EXPECT_EQ(unpacked(packed(wild)), wild);
    EXPECT_LE(packed(wild).size(), size + 4);
    if (size > 64) {
      EXPECT_EQ(packed(zeros)[0], std::byte{1});
      EXPECT_LT(packed(zeros).size(), 60u);
      EXPECT_EQ(packed(wild)[0], std::byte{0});
    }
  }
}

TEST(Packing, DamageIsRefused) {
  for (const Bytes& blob : {Bytes(1000), noise(50)}) {
    const Bytes whole = packed(blob);
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_FALSE(unpacked(std::span(whole).first(size))) << size;
    Bytes more = whole;
    more.push_back(std::byte{0});
    EXPECT_FALSE(unpacked(more));
    more = whole;
    more[0] = std::byte{2};
    EXPECT_FALSE(unpacked(more));
  }
}

// Ascending numbers in rows of four.
Bytes rows_of_numbers(std::uint32_t rows) {
  ByteWriter out;
  out.put_bytes(Bytes(5, std::byte{9}));  // as in an extra with fields before the numbers
  for (std::uint32_t row = 0; row < rows; ++row)
    for (const std::uint32_t number : {0u, 1u, 102u, 101u}) out.put_u32(row + number);
  return std::move(out.bytes);
}

TEST(Packing, LargeTablesGoInPlanes) {
  for (const std::uint32_t rows : {4000u, 4096u, 5001u, 300000u}) {
    const Bytes blob = rows_of_numbers(rows), whole = packed(blob);
    EXPECT_EQ(whole[0], std::byte(blob.size() < 65536 ? 1 : 2));
    EXPECT_EQ(unpacked(whole), blob);
    if (blob.size() < 65536) continue;
    EXPECT_LT(whole.size() * 10, zstd_compress(blob, 12).size());
    EXPECT_FALSE(unpacked(whole, blob.size() - 1));
    for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 50)
      EXPECT_FALSE(unpacked(std::span(whole).first(size))) << size;
    Bytes none = whole;
    none[rows < 300000 ? 4 : 5] = std::byte{0};  // the number of planes
    EXPECT_FALSE(unpacked(none));
  }
}

TEST(Packing, TheLimitHolds) {
  for (const Bytes& blob : {Bytes(1000), noise(1000)}) {
    EXPECT_TRUE(unpacked(packed(blob), 1000));
    EXPECT_FALSE(unpacked(packed(blob), 999));
  }
}

TEST(Packing, StatedLengthMustBeTheLength) {
  for (std::uint64_t stated :
       {std::uint64_t{0}, std::uint64_t{99999}, std::uint64_t{100001}, std::uint64_t{1} << 40}) {
    ByteWriter out;
    out.put_u8(1);
    out.put_varint(stated);
    out.put_bytes(zstd_compress(Bytes(100000), 3));
    EXPECT_FALSE(unpacked(out.bytes, ~std::uint64_t{0})) << stated;
  }
}

TEST(Zstd, BackAndForth) {
  for (std::size_t size : {0u, 1u, 65536u, 65537u, 5000000u}) {
    const Bytes bytes = size < 100000 ? noise(size) : Bytes(size, std::byte{7});
    EXPECT_EQ(zstd_decompress(zstd_compress(bytes, 3), size), bytes);
  }
  // zstd_decompress unpacks small data in one call, and large data piece by piece. In neither case
  // does it trust the stated size.
  for (const Bytes& bytes : {noise(1000), Bytes(1 << 20, std::byte{7})}) {
    const Bytes packed = zstd_compress(bytes, 1);
    const std::uint64_t size_of_all = bytes.size();
    for (const std::uint64_t stated : {std::uint64_t{0}, std::uint64_t{1}, size_of_all - 1,
                                       size_of_all + 1, 2 * size_of_all, std::uint64_t{1} << 40})
      EXPECT_FALSE(zstd_decompress(packed, stated)) << stated;
    for (std::size_t size = 0; size < packed.size(); ++size) {
      const Bytes cut(packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_FALSE(zstd_decompress(cut, bytes.size())) << size;
    }
    Bytes more = packed;
    more.push_back(std::byte{0});
    EXPECT_FALSE(zstd_decompress(more, bytes.size()));
  }
  EXPECT_FALSE(zstd_decompress({}, 0));
  EXPECT_FALSE(zstd_decompress(noise(100), 100));
  // A zstd frame states its window size with a window descriptor or with its content size. Some
  // frames in this test state a window that is larger than decoders must support. Such frames must
  // be refused.
  const auto framed = [](std::initializer_list<int> head) {
    Bytes frame{std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f}, std::byte{0xfd}};
    for (const int value : head) frame.push_back(static_cast<std::byte>(value));
    for (const char c : {'\x21', '\0', '\0', 'a', 'b', 'c', 'd'})
      frame.push_back(static_cast<std::byte>(c));
    return frame;  // one raw block of four bytes
  };
  EXPECT_TRUE(zstd_decompress(framed({0x00, 17 << 3}), 4));
  EXPECT_FALSE(zstd_decompress(framed({0x00, (17 << 3) + 1}), 4));
  EXPECT_FALSE(zstd_decompress(framed({0x00, 18 << 3}), 4));
  EXPECT_FALSE(zstd_decompress(framed({0xa0, 1, 0, 0, 8}), (1u << 27) + 1));
  // Two consecutive frames are refused.
  Bytes two = zstd_compress(Bytes(10), 3);
  const Bytes second = two;
  two.insert(two.end(), second.begin(), second.end());
  EXPECT_FALSE(zstd_decompress(two, 20));
}

}  // namespace
}  // namespace shm
