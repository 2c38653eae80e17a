#include "values/value_column.h"

#include <algorithm>
#include <bit>
#include <cstring>

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
void ValueColumn<Coder>::make_room(std::uint32_t slots) {
  if (slots > 0)
    for (auto& column : columns_) column.make_room(slots - 1);
}
template <class Coder>
void ValueColumn<Coder>::use_reference() {
  for (auto& column : columns_) column.use_reference();
}

template <class Coder>
std::vector<std::byte> ValueColumn<Coder>::encode(
    const TiledItems& elements, const std::byte* values, std::size_t stride,
    const std::byte* reference) requires(!Coder::kDecodes) {
  const std::size_t tiles = elements.tile_begin.size();
  const auto tile = [&](std::size_t t) {
    const std::size_t end = t + 1 < tiles ? elements.tile_begin[t + 1] : elements.items.size();
    const auto all =
        std::span(elements.items).subspan(elements.tile_begin[t], end - elements.tile_begin[t]);
    const auto blocks =
        elements.blocks.empty()
            ? std::span<const std::uint32_t>()
            : std::span(elements.blocks).subspan(elements.tile_begin[t], all.size());
    return std::pair(all, blocks);
  };
  std::size_t count = 0;
  for (std::size_t i = 0; i < elements.items.size(); ++i)
    count += elements.blocks.empty() || covers(elements.blocks[i]) ? 1 : 0;

  std::vector<std::vector<std::uint64_t>> bits(info_.components), then(info_.components);
  for (std::size_t c = 0; c < info_.components; ++c) {
    bits[c].resize(count);
    for (std::size_t i = 0; i < count; ++i)
      bits[c][i] = load(values + i * stride + c * width_, width_);
    if (reference == nullptr) continue;
    then[c].resize(count);
    for (std::size_t i = 0; i < count; ++i)
      then[c][i] = load(reference + i * stride + c * width_, width_);
  }
  if (count > 0) {
    const auto [items, blocks] = tile(0);
    const auto first = covered(items, blocks);
    for (std::size_t c = 0; c < info_.components; ++c)
      columns_[c].begin_group(coder_, choose_domain(c, first, bits[c], then[c]));
  }
  std::size_t at = 0;
  for (std::size_t t = 0; t < tiles; ++t) {
    const auto [items, blocks] = tile(t);
    const auto own = covered(items, blocks);
    for (std::size_t c = 0; c < info_.components && !own.empty(); ++c)
      columns_[c].code_tile(coder_, own, std::span(bits[c]).subspan(at, own.size()), before(c),
                            then[c].empty() ? std::span<const std::uint64_t>()
                                            : std::span(then[c]).subspan(at, own.size()));
    at += own.size();
  }
  return coder_.finish();
}

template <class Coder>
DomainPlan ValueColumn<Coder>::choose_domain(std::size_t component,
                                             std::span<const Neighbourhood> first_tile,
                                             std::span<const std::uint64_t> bits,
                                             std::span<const std::uint64_t> reference) const {
  auto plans = domain_candidates(info_, component, bits);
  if constexpr (!Coder::kDecodes) {
    std::size_t best = 0;
    double least = 0;
    for (std::size_t p = 0; p < plans.size() && plans.size() > 1 && !first_tile.empty(); ++p) {
      ScalarColumn<Coder> column = columns_[component];
      std::vector<std::uint64_t> values(
          bits.begin(), bits.begin() + static_cast<std::ptrdiff_t>(first_tile.size()));
      Coder head, body;
      column.begin_group(head, plans[p]);
      column.code_tile(body, first_tile, values, before(component),
                       reference.first(std::min(reference.size(), values.size())));
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
bool ValueColumn<Coder>::begin_group(std::span<const std::byte> bytes) requires(Coder::kDecodes) {
  coder_ = Coder(bytes);
  begun_ = false;
  return true;
}

template <class Coder>
bool ValueColumn<Coder>::decode_tile(std::span<const Neighbourhood> items,
                                     std::span<const std::uint32_t> blocks,
                                     std::vector<std::byte>& out,
                                     const std::byte* reference) requires(Coder::kDecodes) {
  const auto own = covered(items, blocks);
  if (own.empty()) return true;
  if (!std::exchange(begun_, true))
    for (auto& column : columns_)
      if (!column.begin_group(coder_, {})) return false;
  const std::size_t stride = width_ * info_.components, base = out.size();
  out.resize(base + own.size() * stride);
  bits_.resize(own.size());
  for (std::size_t c = 0; c < info_.components; ++c) {
    reference_bits_.resize(reference == nullptr ? 0 : own.size());
    for (std::size_t i = 0; i < reference_bits_.size(); ++i)
      reference_bits_[i] = load(reference + i * stride + c * width_, width_);
    if (!columns_[c].code_tile(coder_, own, bits_, before(c), reference_bits_)) return false;
    std::byte* to = out.data() + base + c * width_;
    for (std::size_t i = 0; i < own.size(); ++i) store(to + i * stride, bits_[i], width_);
  }
  return true;
}

template class ValueColumn<RangeEncoder>;
template class ValueColumn<RangeDecoder>;

}  // namespace shm
