#include "coders/step_values.h"

#include <algorithm>
#include <memory>

#include "bytes/byte_cursor.h"
#include "packing.h"
#include "values/value_column.h"

namespace shm {
namespace {

constexpr int kZstdLevel = 9;

/// Byte b of every scalar together, least significant byte first.
std::vector<std::byte> shuffle(std::span<const std::byte> values, std::size_t width) {
  const std::size_t count = values.size() / width;
  std::vector<std::byte> little(values.size()), out(values.size());
  copy_little_endian(little.data(), values.data(), count, width);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t b = 0; b < width; ++b) out[b * count + i] = little[i * width + b];
  return out;
}
std::vector<std::byte> unshuffle(std::span<const std::byte> planes, std::size_t width) {
  const std::size_t count = planes.size() / width;
  std::vector<std::byte> little(planes.size()), out(planes.size());
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t b = 0; b < width; ++b) little[i * width + b] = planes[b * count + i];
  copy_little_endian(out.data(), little.data(), count, width);
  return out;
}

/// An element of which nothing is known but what came before it.
Neighbourhood element() {
  Neighbourhood it;
  it.self = 0;
  return it;
}

}  // namespace

StepBytes encode_step_values(const ArrayInfo& info, std::span<const std::byte> values) {
  const std::size_t width = scalar_bytes(info.type), stride = width * info.components;
  TiledItems elements;
  elements.items.assign(values.size() / stride, element());
  StepBytes predicted{container::Codec::local,
                      ValueColumn<SplitEncoder>(info, {}).encode(elements, values.data(), stride, Level::standard).bytes};
  StepBytes packed{container::Codec::shuffled_zstd,
                   zstd_compress(shuffle(values, width), kZstdLevel)};
  return packed.bytes.empty() || predicted.bytes.size() <= packed.bytes.size() ? predicted : packed;
}

std::optional<std::vector<std::byte>> decode_step_values(const ArrayInfo& info,
                                                         container::Codec codec,
                                                         std::span<const std::byte> bytes,
                                                         std::uint32_t count) {
  const std::size_t width = scalar_bytes(info.type), stride = width * info.components;
  if (codec == container::Codec::shuffled_zstd) {
    const auto planes = zstd_decompress(bytes, std::uint64_t{count} * stride);
    if (!planes) return std::nullopt;
    return unshuffle(*planes, width);
  }
  if (codec != container::Codec::local) return std::nullopt;
  ValueColumn<SplitDecoder> column(info, {});
  if (!column.begin_group(ColumnCodec::predicted, bytes, count * stride)) return std::nullopt;
  std::vector<std::byte> out;
  if (!column.decode_tile(std::vector(count, element()), {}, out)) return std::nullopt;
  return out;
}

}  // namespace shm
