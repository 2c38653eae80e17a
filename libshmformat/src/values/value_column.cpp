#include "values/value_column.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "bytes/byte_cursor.h"
#include "packing.h"
#include "values/domain_choice.h"

namespace shm {
namespace {

std::uint64_t load(const std::byte* at, std::size_t width) {
  std::uint64_t bits = 0;
  if constexpr (std::endian::native == std::endian::little)
    std::memcpy(&bits, at, width);
  else
    std::memcpy(reinterpret_cast<std::byte*>(&bits) + (8 - width), at, width);
  return bits;
}
void store(std::byte* at, std::uint64_t bits, std::size_t width) {
  if constexpr (std::endian::native == std::endian::little)
    std::memcpy(at, &bits, width);
  else
    std::memcpy(at, reinterpret_cast<const std::byte*>(&bits) + (8 - width), width);
}

/// Calls visit(items, blocks) for each tile.
template <class Visit>
void for_each_tile(const TiledItems& elements, Visit&& visit) {
  for (std::size_t t = 0; t < elements.tile_begin.size(); ++t) {
    const std::size_t begin = elements.tile_begin[t];
    const std::size_t end =
        t + 1 < elements.tile_begin.size() ? elements.tile_begin[t + 1] : elements.items.size();
    const auto blocks = elements.blocks.empty()
                            ? std::span<const std::uint32_t>()
                            : std::span(elements.blocks).subspan(begin, end - begin);
    visit(std::span(elements.items).subspan(begin, end - begin), blocks);
  }
}

}  // namespace

template <class Coder>
ValueColumn<Coder>::ValueColumn(const ArrayInfo& info, std::vector<char> covers)
    : info_(info), covers_(std::move(covers)), width_(scalar_bytes(info.type)) {
  columns_.reserve(info.components);
  for (std::size_t c = 0; c < info.components; ++c) columns_.emplace_back(info, c);
}

template <class Coder>
std::span<const Neighbourhood> ValueColumn<Coder>::covered(std::span<const Neighbourhood> items,
                                                           std::span<const std::uint32_t> blocks) {
  if (covers_.empty()) return items;
  covered_.clear();
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (covers(blocks[i])) {
      covered_.push_back(items[i]);
      continue;
    }
    for (auto& column : columns_) column.skip(items[i]);
  }
  return covered_;
}

template <class Coder>
EncodedColumn ValueColumn<Coder>::encode(const TiledItems& elements, const std::byte* values,
                                         std::size_t stride,
                                         Level level) requires(!Coder::kDecodes) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < elements.items.size(); ++i)
    count += elements.blocks.empty() || covers(elements.blocks[i]) ? 1 : 0;
  if (count == 0) {
    for_each_tile(elements, [&](auto items, auto blocks) { covered(items, blocks); });
    return {};
  }
  std::vector<std::vector<std::uint64_t>> bits(info_.components);
  for (std::size_t c = 0; c < info_.components; ++c) {
    bits[c].resize(count);
    for (std::size_t i = 0; i < count; ++i)
      bits[c][i] = load(values + i * stride + c * width_, width_);
  }
  const bool mixes = level == Level::best;
  for (auto& column : columns_) column.mix(mixes);

  // Runs and repeats are zstd's: tried where a quick look says that they may be the most of it.
  std::vector<std::byte> planes(count * info_.components * width_);
  for (std::size_t i = 0, at = 0; i < count; ++i)
    for (std::size_t c = 0; c < info_.components; ++c, ++at)
      for (std::size_t b = 0; b < width_; ++b)
        planes[b * count * info_.components + at] = static_cast<std::byte>(bits[c][i] >> (8 * b));
  const std::size_t quick = zstd_compress(planes, 1).size();
  const bool may_repeat = level == Level::best || quick * 6 < planes.size();
  const auto before = may_repeat ? columns_ : std::vector<ScalarColumn<Coder>>();
  EncodedColumn coded{mixes ? ColumnCodec::mixed : ColumnCodec::predicted,
                      encode_predicted(elements, bits)};
  if (!may_repeat || (level != Level::best && quick > 2 * coded.bytes.size())) return coded;
  ByteWriter packed;
  packed.put_varint(planes.size());
  packed.put_bytes(zstd_compress(planes, level == Level::fast ? 9 : 19));
  std::vector<std::byte> repeated = std::move(packed.bytes);
  if (repeated.size() >= coded.bytes.size()) return coded;
  columns_ = before;
  note(elements, bits);
  return {ColumnCodec::shuffled_zstd, std::move(repeated)};
}

template <class Coder>
std::vector<std::byte> ValueColumn<Coder>::encode_predicted(
    const TiledItems& elements, std::vector<std::vector<std::uint64_t>>& bits) {
  bool begun = false;
  std::size_t at = 0;
  for_each_tile(elements, [&](auto items, auto blocks) {
    const auto own = covered(items, blocks);
    if (own.empty()) return;
    if (!std::exchange(begun, true))
      for (std::size_t c = 0; c < info_.components; ++c)
        columns_[c].begin_group(coder_, choose_domain(c, own, bits[c]),
                                std::span(columns_).first(c));
    for (std::size_t c = 0; c < info_.components; ++c)
      code_component(c, own, std::span(bits[c]).subspan(at, own.size()));
    at += own.size();
  });
  if constexpr (Coder::kDecodes)
    return {};
  else
    return coder_.finish();
}

template <class Coder>
void ValueColumn<Coder>::note(const TiledItems& elements,
                              const std::vector<std::vector<std::uint64_t>>& bits) {
  std::size_t at = 0;
  for_each_tile(elements, [&](auto items, auto blocks) {
    const auto own = covered(items, blocks);
    for (std::size_t c = 0; c < info_.components; ++c)
      columns_[c].note(own, std::span(bits[c]).subspan(at, own.size()));
    at += own.size();
  });
}

template <class Coder>
bool ValueColumn<Coder>::code_component(std::size_t component, std::span<const Neighbourhood> items,
                                        std::span<std::uint64_t> bits) {
  traces_.clear();
  for (std::size_t c = 0; c < component; ++c) traces_.push_back(&columns_[c].trace());
  return columns_[component].code_tile(coder_, items, bits, traces_);
}

template <class Coder>
DomainPlan ValueColumn<Coder>::choose_domain(std::size_t component,
                                             std::span<const Neighbourhood> first_tile,
                                             std::span<const std::uint64_t> bits) const {
  auto plans = domain_candidates(info_, component, bits);
  if constexpr (!Coder::kDecodes) {
    std::size_t best = 0;
    double least = 0;
    for (std::size_t p = 0; p < plans.size() && plans.size() > 1 && !first_tile.empty(); ++p) {
      ScalarColumn<Coder> column = columns_[component];
      std::vector<std::uint64_t> values(
          bits.begin(), bits.begin() + static_cast<std::ptrdiff_t>(first_tile.size()));
      Coder head, body;
      column.begin_group(head, plans[p], std::span(columns_).first(component));
      column.code_tile(body, first_tile, values, {});
      const double size =
          static_cast<double>(head.finish().size()) + static_cast<double>(body.finish().size()) *
                                                          static_cast<double>(bits.size()) /
                                                          static_cast<double>(first_tile.size());
      if (p > 0 && size >= least) continue;
      least = size;
      best = p;
    }
    return std::move(plans[best]);
  }
  return std::move(plans[0]);
}

template <class Coder>
bool ValueColumn<Coder>::begin_group(ColumnCodec codec, std::span<const std::byte> bytes,
                                     std::uint64_t limit) requires(Coder::kDecodes) {
  codec_ = codec;
  begun_ = false;
  if (codec != ColumnCodec::shuffled_zstd) {
    coder_ = Coder(bytes);
    for (auto& column : columns_) column.mix(codec == ColumnCodec::mixed);
    return true;
  }
  ByteReader in(bytes);
  const std::uint64_t size = in.get_varint();
  if (!in.ok() || size > limit || size % (width_ * info_.components) != 0) return false;
  const auto planes = zstd_decompress(in.get_bytes(in.left()), size);
  if (!planes) return false;
  const std::size_t scalars = planes->size() / width_;
  unpacked_.resize(planes->size());
  unpacked_at_ = 0;
  for (std::size_t i = 0; i < scalars; ++i) {
    std::uint64_t bits = 0;
    for (std::size_t b = 0; b < width_; ++b)
      bits |= std::to_integer<std::uint64_t>((*planes)[b * scalars + i]) << (8 * b);
    store(unpacked_.data() + i * width_, bits, width_);
  }
  return true;
}

template <class Coder>
bool ValueColumn<Coder>::decode_tile(std::span<const Neighbourhood> items,
                                     std::span<const std::uint32_t> blocks,
                                     std::vector<std::byte>& out) requires(Coder::kDecodes) {
  const auto own = covered(items, blocks);
  if (own.empty()) return true;
  const std::size_t stride = width_ * info_.components, base = out.size();
  const std::size_t bytes = own.size() * stride;
  bits_.resize(own.size());
  if (codec_ == ColumnCodec::shuffled_zstd) {
    if (bytes > unpacked_.size() - unpacked_at_) return false;
    const std::byte* from = unpacked_.data() + unpacked_at_;
    out.insert(out.end(), from, from + bytes);
    unpacked_at_ += bytes;
    for (std::size_t c = 0; c < info_.components; ++c) {
      for (std::size_t i = 0; i < own.size(); ++i)
        bits_[i] = load(from + i * stride + c * width_, width_);
      columns_[c].note(own, bits_);
    }
    return true;
  }
  if (!std::exchange(begun_, true))
    for (std::size_t c = 0; c < columns_.size(); ++c)
      if (!columns_[c].begin_group(coder_, {}, std::span(columns_).first(c))) return false;
  out.resize(base + bytes);
  for (std::size_t c = 0; c < info_.components; ++c) {
    if (!code_component(c, own, bits_)) return false;
    std::byte* to = out.data() + base + c * width_;
    for (std::size_t i = 0; i < own.size(); ++i) store(to + i * stride, bits_[i], width_);
  }
  return true;
}

template class ValueColumn<RangeEncoder>;
template class ValueColumn<RangeDecoder>;

}  // namespace shm
