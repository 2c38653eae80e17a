#include "step_values.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "bytes/byte_cursor.h"
#include "packing.h"

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

/// By TiledItems::blocks: which elements have a value.
std::vector<char> coverage(const Schema& schema, std::uint32_t array, std::uint32_t segment) {
  if (schema.arrays[array].location == Location::point)
    return segment == 0 ? std::vector<char>() : std::vector<char>{1, 0};
  std::vector<char> covers(schema.blocks.size());
  for (std::uint32_t b = 0; b < covers.size(); ++b)
    covers[b] = schema.array_covers(array, b) ? 1 : 0;
  return covers;
}

/// last + (last - before) for each scalar: integers modulo their range; floating-point numbers as
/// they are rounded, or `last` where that is not finite.
template <class T>
void go_on(std::span<const std::byte> last, std::span<const std::byte> before,
           std::span<std::byte> out) {
  for (std::size_t i = 0; i < out.size(); i += sizeof(T)) {
    T a{}, b{};
    std::memcpy(&a, last.data() + i, sizeof(T));
    std::memcpy(&b, before.data() + i, sizeof(T));
    if constexpr (std::is_integral_v<T>) {
      const auto whole = static_cast<std::uint64_t>(a);
      a = static_cast<T>(whole + (whole - static_cast<std::uint64_t>(b)));
    } else {
      const T next = a + (a - b);
      if (std::isfinite(next)) a = next;
    }
    std::memcpy(out.data() + i, &a, sizeof(T));
  }
}

}  // namespace

StepReference most_reference(const Schema& schema, std::span<const std::uint64_t> elements) {
  std::uint64_t bytes = 0;
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& info = schema.arrays[a];
    if (!info.per_step) continue;
    if (elements[a] > kMostReferenceBytes) return StepReference::nothing;  // no product overflows
    bytes += elements[a] * scalar_bytes(info.type) * info.components;
    if (bytes > kMostReferenceBytes) return StepReference::nothing;
  }
  return 2 * bytes > kMostReferenceBytes ? StepReference::before : StepReference::trend;
}

// --- the steps before

void StepMemory::take(std::size_t at, std::span<const std::byte> values) {
  if (most_ == StepReference::nothing) return;
  const auto put = [&](std::vector<std::byte>& to, std::span<const std::byte> from) {
    if (to.size() < at + from.size()) to.resize(at + from.size());
    std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(at));
  };
  if (most_ == StepReference::trend && last_.size() >= at + values.size())
    put(before_last_, std::span(last_).subspan(at, values.size()));
  put(last_, values);
}

std::span<const std::byte> StepMemory::reference(StepReference kind, const ArrayInfo& info,
                                                 std::size_t at, std::size_t bytes) {
  if (kind == StepReference::nothing) return {};
  const auto last = std::span(last_).subspan(at, bytes);
  if (kind == StepReference::before) return last;
  trend_.resize(bytes);
  const auto before = std::span(before_last_).subspan(at, bytes);
  switch (info.type) {
    case ScalarType::int8: go_on<std::int8_t>(last, before, trend_); break;
    case ScalarType::uint8: go_on<std::uint8_t>(last, before, trend_); break;
    case ScalarType::int16: go_on<std::int16_t>(last, before, trend_); break;
    case ScalarType::uint16: go_on<std::uint16_t>(last, before, trend_); break;
    case ScalarType::int32: go_on<std::int32_t>(last, before, trend_); break;
    case ScalarType::uint32: go_on<std::uint32_t>(last, before, trend_); break;
    case ScalarType::int64: go_on<std::int64_t>(last, before, trend_); break;
    case ScalarType::uint64: go_on<std::uint64_t>(last, before, trend_); break;
    case ScalarType::float32: go_on<float>(last, before, trend_); break;
    case ScalarType::float64: go_on<double>(last, before, trend_); break;
  }
  return trend_;
}

template <class Coder>
bool StepColumn<Coder>::begin(std::uint32_t segment, StepReference reference) {
  const bool goes_on = column_ && segment == segment_;
  if (goes_on && reference != reference_) return false;
  if (!goes_on) {
    column_.emplace(schema_->arrays[array_], coverage(*schema_, array_, segment));
    if (reference != StepReference::nothing) column_->use_reference();
  }
  segment_ = segment;
  reference_ = reference;
  return true;
}

template <class Coder>
EncodedColumn StepColumn<Coder>::encode(const GroupElements& elements,
                                        std::span<const std::byte> values, Level level,
                                        std::span<const std::byte> reference) {
  const ArrayInfo& info = schema_->arrays[array_];
  column_->make_room(elements.slots);
  return column_->encode(items(elements), values.data(), scalar_bytes(info.type) * info.components,
                         level, reference.empty() ? nullptr : reference.data());
}

template <class Coder>
std::optional<std::vector<std::byte>> StepColumn<Coder>::decode(
    const GroupElements& elements, ColumnCodec codec, std::span<const std::byte> bytes,
    std::uint64_t limit, std::span<const std::byte> reference) {
  const TiledItems& all = items(elements);
  column_->make_room(elements.slots);
  if (!column_->begin_group(codec, bytes, limit)) return std::nullopt;
  std::vector<std::byte> out;
  for (std::size_t t = 0; t < all.tile_begin.size(); ++t) {
    const std::size_t begin = all.tile_begin[t];
    const std::size_t end =
        t + 1 < all.tile_begin.size() ? all.tile_begin[t + 1] : all.items.size();
    const auto blocks = all.blocks.empty() ? std::span<const std::uint32_t>()
                                           : std::span(all.blocks).subspan(begin, end - begin);
    if (!column_->decode_tile(std::span(all.items).subspan(begin, end - begin), blocks, out,
                              reference.empty() ? nullptr : reference.data() + out.size()))
      return std::nullopt;
  }
  return out;
}

template class StepColumn<SplitEncoder>;
template class StepColumn<SplitDecoder>;

std::vector<std::byte> shuffle_and_compress(const ArrayInfo& info,
                                            std::span<const std::byte> values) {
  ByteWriter out;
  out.put_varint(values.size());
  out.put_bytes(zstd_compress(shuffle(values, scalar_bytes(info.type)), kZstdLevel));
  return std::move(out.bytes);
}

std::optional<std::vector<std::byte>> decompress_shuffled(const ArrayInfo& info,
                                                          std::span<const std::byte> bytes,
                                                          std::uint64_t count) {
  const std::size_t width = scalar_bytes(info.type);
  ByteReader in(bytes);
  const std::uint64_t size = count * width * info.components;
  if (in.get_varint() != size) return std::nullopt;
  const auto planes = zstd_decompress(in.get_bytes(in.left()), size);
  if (!planes) return std::nullopt;
  return unshuffle(*planes, width);
}

}  // namespace shm
