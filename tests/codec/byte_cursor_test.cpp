#include "base/binary.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>

namespace shm {
namespace {

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (int v : values) bytes.push_back(static_cast<std::byte>(v));
  return bytes;
}

TEST(ByteCursor, FixedNumbersAreLittleEndian) {
  ByteWriter out;
  out.put_u8(0x01);
  out.put_u16(0x0302);
  out.put_u32(0x07060504);
  out.put_u64(0x0f0e0d0c0b0a0908);
  EXPECT_EQ(out.bytes, bytes_of({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}));
  ByteReader in(out.bytes);
  EXPECT_EQ(in.get_u8(), 0x01);
  EXPECT_EQ(in.get_u16(), 0x0302);
  EXPECT_EQ(in.get_u32(), 0x07060504u);
  EXPECT_EQ(in.get_u64(), 0x0f0e0d0c0b0a0908u);
  EXPECT_TRUE(in.ok());
  EXPECT_EQ(in.left(), 0u);
}

TEST(ByteCursor, VarintsOfEveryLength) {
  for (int bit = 0; bit < 64; ++bit)
    for (std::uint64_t near : {0u, 1u, 2u}) {
      const std::uint64_t value = (std::uint64_t{1} << bit) + near - 1;
      ByteWriter out;
      out.put_varint(value);
      EXPECT_EQ(out.bytes.size(),
                value == 0 ? 1u : static_cast<std::size_t>(std::bit_width(value) + 6) / 7);
      ByteReader in(out.bytes);
      EXPECT_EQ(in.get_varint(), value);
      EXPECT_TRUE(in.ok());
      EXPECT_EQ(in.left(), 0u);
    }
  ByteWriter largest;
  largest.put_varint(~std::uint64_t{0});
  EXPECT_EQ(largest.bytes, bytes_of({255, 255, 255, 255, 255, 255, 255, 255, 255, 1}));
  ByteReader in(largest.bytes);
  EXPECT_EQ(in.get_varint(), ~std::uint64_t{0});
  EXPECT_TRUE(in.ok());
}

TEST(ByteCursor, VarintsBeyond64BitsAreRefused) {
  for (const auto& bytes : {bytes_of({255, 255, 255, 255, 255, 255, 255, 255, 255, 2}),
                            bytes_of({128, 128, 128, 128, 128, 128, 128, 128, 128, 128, 1})}) {
    ByteReader in(bytes);
    in.get_varint();
    EXPECT_FALSE(in.ok());
  }
}

TEST(ByteCursor, SignedNumbersOfSmallSizeAreShort) {
  for (std::int64_t value :
       {std::int64_t{0}, std::int64_t{-1}, std::int64_t{1}, std::int64_t{-64}, std::int64_t{63},
        std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    ByteWriter out;
    out.put_signed(value);
    if (value >= -64 && value < 64) {
      EXPECT_EQ(out.bytes.size(), 1u);
    }
    ByteReader in(out.bytes);
    EXPECT_EQ(in.get_signed(), value);
    EXPECT_TRUE(in.ok());
  }
}

TEST(ByteCursor, TextAndFloats) {
  ByteWriter out;
  out.put_text("two words");
  out.put_text({});
  out.put_f64(-0.0);
  ByteReader in(out.bytes);
  EXPECT_EQ(in.get_text(), "two words");
  EXPECT_EQ(in.get_text(), "");
  EXPECT_EQ(std::bit_cast<std::uint64_t>(in.get_f64()), std::uint64_t{1} << 63);
  EXPECT_TRUE(in.ok());
}

TEST(ByteCursor, SignallingNaNStaysWhatItIs) {
  constexpr std::uint64_t kBits = 0xfff4000000000123;
  ByteWriter out;
  out.put_u64(kBits);
  ByteReader in(out.bytes);
  double value = 0;
  in.get_f64(value);
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  EXPECT_EQ(bits, kBits);
}

TEST(ByteCursor, PastTheEndAreZerosAndItIsRemembered) {
  const auto bytes = bytes_of({1, 2});
  ByteReader in(bytes);
  EXPECT_EQ(in.get_u32(), 0u);
  EXPECT_FALSE(in.ok());
  EXPECT_EQ(in.left(), 0u);
  EXPECT_EQ(in.get_u8(), 0);
  EXPECT_EQ(in.get_varint(), 0u);
  EXPECT_FALSE(in.ok());
  ByteReader text(bytes);
  EXPECT_EQ(text.get_text(), "\x02");
  EXPECT_TRUE(text.ok());
  const auto lie = bytes_of({200, 200, 1, 2});
  ByteReader longer(lie);
  EXPECT_EQ(longer.get_text(), "");
  EXPECT_FALSE(longer.ok());
}

TEST(ByteCursor, CountsAreHeldAgainstWhatIsLeft) {
  const auto bytes = bytes_of({3, 0, 0, 0, 0, 0, 0});
  ByteReader fits(bytes);
  EXPECT_EQ(fits.get_count(2), 3u);
  EXPECT_TRUE(fits.ok());
  ByteReader too_many(bytes);
  EXPECT_EQ(too_many.get_count(3), 0u);
  EXPECT_FALSE(too_many.ok());
}

TEST(ByteCursor, CopyBetweenHostAndFile) {
  const std::array<std::uint32_t, 2> host = {0x04030201, 0x08070605};
  std::array<std::byte, 8> file{};
  copy_little_endian(file.data(), reinterpret_cast<const std::byte*>(host.data()), 2, 4);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(file[i], static_cast<std::byte>(i + 1));
  copy_little_endian(nullptr, nullptr, 0, 4);
}

// Compares checksum() with published values of XXH64 with seed 0. checksum() returns the low 32
// bits of XXH64.
TEST(Checksum, IsTheLowHalfOfXxh64) {
  EXPECT_EQ(checksum({}), 0x51d8e999u);
  const auto abc = bytes_of({'a', 'b', 'c'});
  EXPECT_EQ(checksum(abc), 0xad770999u);
}

}  // namespace
}  // namespace shm
