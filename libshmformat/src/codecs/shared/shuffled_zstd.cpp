#include "codecs/shared/shuffled_zstd.h"

#include "base/binary.h"
#include "base/packing.h"

namespace shm {

std::vector<std::byte> shuffled(std::span<const std::byte> values, std::size_t width) {
  const std::size_t count = values.size() / width;
  std::vector<std::byte> little(values.size()), planes(values.size());
  copy_little_endian(little.data(), values.data(), count, width);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t b = 0; b < width; ++b) planes[b * count + i] = little[i * width + b];
  return planes;
}

std::vector<std::byte> pack_shuffled(std::span<const std::byte> planes, int level) {
  ByteWriter out;
  out.put_varint(planes.size());
  out.put_bytes(zstd_compress(planes, level));
  return std::move(out.bytes);
}

std::optional<std::vector<std::byte>> unpack_shuffled(std::span<const std::byte> bytes,
                                                      std::size_t width, std::uint64_t limit) {
  ByteReader in(bytes);
  const std::uint64_t size = in.get_varint();
  if (!in.ok() || size > limit || size % width != 0) return std::nullopt;
  const auto planes = zstd_decompress(in.get_bytes(in.left()), size);
  if (!planes) return std::nullopt;
  const std::size_t count = planes->size() / width;
  std::vector<std::byte> little(planes->size()), values(planes->size());
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t b = 0; b < width; ++b) little[i * width + b] = (*planes)[b * count + i];
  copy_little_endian(values.data(), little.data(), count, width);
  return values;
}

}  // namespace shm
