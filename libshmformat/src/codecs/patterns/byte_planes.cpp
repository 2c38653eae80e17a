#include "codecs/patterns/byte_planes.h"

#include <algorithm>

namespace shm {

void put_plane(ByteWriter& out, std::span<const std::byte> plane, ZstdCompressor& zstd, int level) {
  if (std::all_of(plane.begin(), plane.end(), [](std::byte byte) { return byte == std::byte{0}; }))
    return out.put_varint(0);
  const auto packed = zstd.compress(plane, level);
  const auto bytes = packed.size() < plane.size() ? packed : plane;
  out.put_varint(bytes.size());
  out.put_bytes(bytes);
}

bool get_plane(ByteReader& in, std::uint64_t size, std::vector<std::byte>& plane,
               ZstdDecompressor& zstd) {
  const auto bytes = in.get_bytes(in.get_varint());
  if (!in.ok() || bytes.size() > size) return false;
  if (!bytes.empty() && bytes.size() < size) return zstd.decompress(bytes, size, plane);
  if (bytes.empty())
    plane.assign(to_size(size), std::byte{0});
  else
    plane.assign(bytes.begin(), bytes.end());
  return true;
}

void put_numbers(ByteWriter& out, std::span<const std::uint32_t> numbers,
                 std::vector<std::byte>& scratch, ZstdCompressor& zstd) {
  const std::uint32_t planes = plane_count(numbers);
  out.put_u8(static_cast<std::uint8_t>(planes));
  put_planes(out, numbers, planes, scratch, zstd);
}

bool get_numbers(ByteReader& in, std::uint64_t count, std::vector<std::uint32_t>& numbers,
                 std::vector<std::byte>& scratch, ZstdDecompressor& zstd) {
  const std::uint32_t planes = in.get_u8();
  if (!in.ok() || planes > 4) return false;
  numbers.resize(to_size(count));
  return get_planes(in, planes, std::span(numbers), scratch, zstd);
}

}  // namespace shm
