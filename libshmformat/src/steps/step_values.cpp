#include "steps/step_values.h"

#include <utility>

namespace shm {

// --- terms

StepTerms encode_terms(const ArrayInfo& info, std::span<const std::byte> values,
                       std::span<const std::byte> reference, TermScratch& scratch) {
  TermColumn column(info, true);
  TermColumn::Elements elements;
  elements.count = values.size() / column.element_bytes();
  elements.reference = reference;
  auto bytes = column.encode_terms(elements, values.data(), column.element_bytes(), scratch);
  return {column.refers(), {Codec::terms, std::move(bytes)}};
}

std::optional<std::vector<std::byte>> decode_terms(const ArrayInfo& info,
                                                   std::span<const std::byte> bytes,
                                                   std::uint64_t count,
                                                   std::span<const std::byte> reference,
                                                   TermScratch& scratch) {
  TermColumn column(info, true);
  TermColumn::Elements elements;
  elements.count = to_size(count);
  elements.reference = reference;
  std::vector<std::byte> values;
  if (!column.begin_group(Codec::terms, bytes, count * column.element_bytes(), scratch) ||
      !column.decode(elements, values, scratch) || !column.at_end())
    return std::nullopt;
  return values;
}

// --- columns

template <class Coder>
bool StepColumn<Coder>::begin(std::uint32_t segment, StepReference reference) {
  const bool goes_on = column_ && segment == segment_;
  if (goes_on && reference != reference_) return false;
  if (!goes_on) {
    const ArrayInfo& info = schema_->arrays[array_];
    // In all segments but the first, the column treats vertices as elements of two "blocks": 0 for
    // own vertices, 1 for imported vertices (see GroupElements).
    const bool may_import = segment > 0 && info.location == Location::point;
    column_.emplace(info, may_import ? std::vector<std::uint32_t>{0} : info.blocks,
                    ColumnTraits{.earlier_values = schema_->earlier_values});
    if (reference != StepReference::nothing) column_->use_reference();
    if constexpr (Coder::kDecodes) {
      kept_ = std::make_unique<ColumnMemory>();
      kept_->allow(most_kept_, ~std::uint64_t{0});
      column_->use_memory(*kept_);
    }
  }
  segment_ = segment;
  reference_ = reference;
  return true;
}

template <class Coder>
EncodedColumn StepColumn<Coder>::encode(const ColumnElements& elements,
                                        std::span<const std::byte> values, Level level,
                                        std::span<const std::byte> reference) {
  const ArrayInfo& info = schema_->arrays[array_];
  column_->make_room(elements.slots, elements.all_slots);
  return column_->encode(*elements.items, values.data(), scalar_bytes(info.type) * info.components,
                         level, reference.empty() ? nullptr : reference.data());
}

template <class Coder>
std::optional<std::vector<std::byte>> StepColumn<Coder>::decode(
    const ColumnElements& elements, Codec codec, std::span<const std::byte> bytes,
    std::uint64_t limit, std::span<const std::byte> reference) {
  const TiledItems& all = *elements.items;
  column_->make_room(elements.slots, elements.all_slots);
  if (!column_->begin_group(codec, bytes, limit)) return std::nullopt;
  std::vector<std::byte> out;
  for (std::size_t t = 0; t < all.tile_begin.size(); ++t) {
    if (!column_->decode_tile(all.tile(t), out,
                              reference.empty() ? nullptr : reference.data() + out.size()))
      return std::nullopt;
  }
  return out;
}

template class StepColumn<SplitEncoder>;
template class StepColumn<SplitDecoder>;

}  // namespace shm
