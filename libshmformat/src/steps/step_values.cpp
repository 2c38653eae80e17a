#include "steps/step_values.h"

#include <utility>

namespace shm {

// --- terms

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

bool StepColumnDecoder::begin(std::uint32_t segment, StepReference reference) {
  const bool goes_on = continues(segment);
  if (!StepColumn::begin(segment, reference)) return false;
  if (goes_on) return true;
  kept_ = std::make_unique<ColumnMemory>();
  kept_->allow(most_kept_, ~std::uint64_t{0});
  column_->use_memory(*kept_);
  return true;
}

std::optional<std::vector<std::byte>> StepColumnDecoder::decode(
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

// --- weighted

std::optional<std::vector<std::byte>> StepWeightedDecoder::decode(
    const ColumnElements& elements, std::span<const std::byte> bytes,
    const ReferenceValues& reference) {
  column_->make_room(elements.slots);
  std::vector<std::byte> out;
  if (!column_->decode(*elements.items, bytes, reference, out)) return std::nullopt;
  return out;
}

}  // namespace shm
