// ByteWriter and ByteReader: write and read bytes of the format. All numbers of more than one byte
// are little-endian. ByteWriter appends to a vector. ByteReader reads from borrowed bytes. If a
// read passes the end of these bytes, ByteReader returns zeros and records the failure: check ok()
// once per structure, before using the values.
// spec: "Conventions", "Checksums"
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace shm {

struct ReadLimits;

// Counts in the format have 64 bits, but sizes in memory have only 32 bits on some machines. Before
// a number from a file is converted to std::size_t, it is checked against the reader's limits.
// within_sizes() ensures that these limits do not exceed the range of std::size_t.

/// Converts the number to std::size_t. Returns the largest std::size_t if the number is larger.
inline std::size_t to_size(std::uint64_t number) {
  return static_cast<std::size_t>(
      std::min<std::uint64_t>(number, std::numeric_limits<std::size_t>::max()));
}
/// Returns `limit` + `each` * `bytes`, or the largest 64-bit number if that overflows.
constexpr std::uint64_t limit_with(std::uint64_t limit, std::uint64_t each, std::uint64_t bytes) {
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  return bytes > (kAll - limit) / each ? kAll : limit + each * bytes;
}
/// Returns the limits unchanged if sizes have 64 bits. If sizes have 32 bits, reduces each limit on
/// bytes to at most 1 GiB. Data that needs more memory is then refused with ErrorCode::over_limit,
/// even if the caller allows more.
ReadLimits within_sizes(ReadLimits limits);

static_assert(std::endian::native == std::endian::little ||
              std::endian::native == std::endian::big);

/// Copies `count` scalars of `width` bytes each. If the host is big-endian, reverses the bytes of
/// each scalar, to convert between the byte order of the host and little-endian order.
inline void copy_little_endian(std::byte* to, const std::byte* from, std::size_t count,
                               std::size_t width) {
  if (count == 0) return;
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(to, from, count * width);
  } else {
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t b = 0; b < width; ++b) to[i * width + b] = from[i * width + width - 1 - b];
  }
}

/// Returns the checksum of chunk headers, payloads and bitstreams: the low 32 bits of XXH64 with
/// seed 0.
std::uint32_t checksum(std::span<const std::byte> bytes);

class ByteWriter {
 public:
  std::vector<std::byte> bytes;

  void put_u8(std::uint8_t v) { bytes.push_back(std::byte{v}); }
  void put_u16(std::uint16_t v) { put_fixed(v, 2); }
  void put_u32(std::uint32_t v) { put_fixed(v, 4); }
  void put_u64(std::uint64_t v) { put_fixed(v, 8); }
  void put_f64(double v) { put_u64(std::bit_cast<std::uint64_t>(v)); }
  /// Writes `v` as LEB128: seven bits per byte, low bits first, at most ten bytes.
  void put_varint(std::uint64_t v) {
    for (; v >= 0x80; v >>= 7) put_u8(static_cast<std::uint8_t>(v | 0x80));
    put_u8(static_cast<std::uint8_t>(v));
  }
  void put_signed(std::int64_t v) {
    put_varint((static_cast<std::uint64_t>(v) << 1) ^ static_cast<std::uint64_t>(v >> 63));
  }
  void put_text(std::string_view v) {
    put_varint(v.size());
    put_bytes(std::as_bytes(std::span(v.data(), v.size())));
  }
  void put_bytes(std::span<const std::byte> v) { bytes.insert(bytes.end(), v.begin(), v.end()); }

 private:
  void put_fixed(std::uint64_t v, int width) {
    for (int i = 0; i < width; ++i) put_u8(static_cast<std::uint8_t>(v >> (8 * i)));
  }
};

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint8_t get_u8() { return static_cast<std::uint8_t>(get_fixed(1)); }
  std::uint16_t get_u16() { return static_cast<std::uint16_t>(get_fixed(2)); }
  std::uint32_t get_u32() { return static_cast<std::uint32_t>(get_fixed(4)); }
  std::uint64_t get_u64() { return get_fixed(8); }
  double get_f64() { return std::bit_cast<double>(get_u64()); }
  /// Copies the bits of a double into `value`. Returning a double by value could change the bits of
  /// a NaN on 32-bit x86.
  void get_f64(double& value) {
    const std::uint64_t bits = get_u64();
    std::memcpy(&value, &bits, sizeof value);
  }
  /// Is not inlined, because it is called in many places, and none of them is critical for speed.
  [[gnu::noinline]] std::uint64_t get_varint() {
    std::uint64_t v = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const std::uint8_t byte = get_u8();
      if (shift == 63 && byte > 1) ok_ = false;  // a number of more than 64 bits
      v |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
      if (byte < 0x80) return v;
    }
    ok_ = false;
    return 0;
  }
  /// Reads a varint. Fails if the number is 2^32 or more.
  std::uint32_t get_varint32() {
    const std::uint64_t v = get_varint();
    if (v > 0xffffffffu) ok_ = false;
    return static_cast<std::uint32_t>(v);
  }
  /// Reads a byte. Fails unless the byte is 0 or 1.
  bool get_flag() {
    const std::uint8_t v = get_u8();
    if (v > 1) ok_ = false;
    return v == 1;
  }
  std::int64_t get_signed() {
    const std::uint64_t v = get_varint();
    return static_cast<std::int64_t>((v >> 1) ^ (0 - (v & 1)));
  }
  std::string get_text() {
    const auto v = get_bytes(get_varint());
    return {reinterpret_cast<const char*>(v.data()), v.size()};
  }
  /// Returns a view of the next `count` bytes. If fewer bytes are left, the view is empty and ok()
  /// becomes false.
  std::span<const std::byte> get_bytes(std::uint64_t count) {
    if (count > left()) {
      ok_ = false;
      at_ = bytes_.size();
      return {};
    }
    const auto view = bytes_.subspan(at_, static_cast<std::size_t>(count));
    at_ += view.size();
    return view;
  }
  /// Returns a view of the bytes from position `begin` to the current position.
  std::span<const std::byte> since(std::size_t begin) const {
    return bytes_.subspan(begin, at_ - begin);
  }
  std::size_t left() const { return bytes_.size() - at_; }
  std::size_t position() const { return at_; }
  bool ok() const { return ok_; }
  /// Reads a count of items. Each item needs at least `bytes_each` bytes. Fails if the remaining
  /// bytes are too few for all items.
  std::uint64_t get_count(std::size_t bytes_each) {
    const std::uint64_t count = get_varint();
    if (count > left() / bytes_each) {
      ok_ = false;
      return 0;
    }
    return count;
  }

 private:
  std::uint64_t get_fixed(std::size_t width) {
    const auto view = get_bytes(width);
    std::uint64_t v = 0;
    for (std::size_t i = view.size(); i-- > 0;)
      v = v << 8 | std::to_integer<std::uint64_t>(view[i]);
    return v;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace shm
