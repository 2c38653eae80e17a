#include "steps/step_values.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace shm {
namespace {

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
  if (schema.step_references == StepReference::nothing) return StepReference::nothing;
  std::uint64_t bytes = 0;
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& info = schema.arrays[a];
    if (!info.per_step) continue;
    if (elements[a] > kMostReferenceBytes) return StepReference::nothing;  // no product overflows
    bytes += elements[a] * scalar_bytes(info.type) * info.components;
    if (bytes > kMostReferenceBytes) return StepReference::nothing;
  }
  return std::min(schema.step_references,
                  2 * bytes > kMostReferenceBytes ? StepReference::before : StepReference::trend);
}

StepMemory memory_of(const ArrayInfo& array, StepReference most) {
  return StepMemory(array.per_step && !array.quantization.lossy() ? most : StepReference::nothing);
}

// --- the steps before

void go_on(ScalarType type, std::span<const std::byte> last, std::span<const std::byte> before,
           std::vector<std::byte>& out) {
  out.resize(last.size());
  switch (type) {
    case ScalarType::int8: go_on<std::int8_t>(last, before, out); break;
    case ScalarType::uint8: go_on<std::uint8_t>(last, before, out); break;
    case ScalarType::int16: go_on<std::int16_t>(last, before, out); break;
    case ScalarType::uint16: go_on<std::uint16_t>(last, before, out); break;
    case ScalarType::int32: go_on<std::int32_t>(last, before, out); break;
    case ScalarType::uint32: go_on<std::uint32_t>(last, before, out); break;
    case ScalarType::int64: go_on<std::int64_t>(last, before, out); break;
    case ScalarType::uint64: go_on<std::uint64_t>(last, before, out); break;
    case ScalarType::float32: go_on<float>(last, before, out); break;
    case ScalarType::float64: go_on<double>(last, before, out); break;
  }
}

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
  go_on(info.type, last, std::span(before_last_).subspan(at, bytes), trend_);
  return trend_;
}

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
    // GroupElements: of segments but the first, vertices in "block" 1 are imported.
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
