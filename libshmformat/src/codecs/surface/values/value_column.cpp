#include "codecs/surface/values/value_column.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/shared/shuffled_zstd.h"
#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/earlier_values.h"

namespace shm {
namespace {

// Encoder: far neighbours must save one byte in kWorthFarShare to be used. Domains are chosen again
// after kGroupsKept groups.
constexpr std::size_t kWorthFarShare = 20;
constexpr std::uint32_t kGroupsKept = 8;
constexpr int kQuickZstd = 9;
// Copies are tried if at least one element in kFewestCopies can be a copy of an earlier element.
constexpr std::size_t kFewestCopies = 8;

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

/// Calls visit(tile) for each tile.
template <class Visit>
void for_each_tile(const TiledItems& elements, Visit&& visit) {
  for (std::size_t t = 0; t < elements.tile_begin.size(); ++t) visit(elements.tile(t));
}

/// Returns a part of a list that has one entry for each element, or no entries. In the second case,
/// the part is empty.
template <class T>
std::span<const T> part_of(const std::vector<T>& all, std::size_t begin, std::size_t count) {
  return std::span<const T>(all).subspan(all.empty() ? 0 : begin, all.empty() ? 0 : count);
}

}  // namespace

template <class Coder>
ValueColumn<Coder>::ValueColumn(const ArrayInfo& info, std::vector<std::uint32_t> blocks,
                                const ColumnTraits& traits)
    : info_(std::make_shared<const ArrayInfo>(info)),
      blocks_(std::move(blocks)),
      repeats_(traits.repeats),
      has_tables_(traits.tables && info.components <= kMostTableComponents),
      has_earlier_values_(has_tables_ && traits.earlier_values),
      has_copies_(has_earlier_values_ && traits.copies && info.components > 1 &&
                  info.quantization.bits == 0),
      width_(scalar_bytes(info.type)) {
  columns_.reserve(info.components);
  for (std::size_t c = 0; c < info.components; ++c) {
    columns_.emplace_back(info_, c, has_earlier_values_);
    columns_[c].share_scratch(columns_[0]);
  }
  forget_history();
}

template <class Coder>
std::span<const Neighbourhood> ValueColumn<Coder>::covered(const TiledItems::Tile& tile) {
  if (blocks_.empty()) return tile.items;
  const auto own = covered_to_try(tile, columns_);
  const std::uint64_t others = tile.items.size() - own.size() + tile.left_out;
  for (auto& column : columns_) column.state().count_left_out(others);
  return own;
}

template <class Coder>
std::span<const Neighbourhood> ValueColumn<Coder>::covered_to_try(
    const TiledItems::Tile& tile, std::span<ScalarColumn<Coder>> columns) {
  if (blocks_.empty()) return tile.items;
  covered_.clear();
  for (std::size_t i = 0; i < tile.items.size(); ++i) {
    if (covers(tile.blocks[i])) {
      covered_.push_back(tile.items[i]);
      continue;
    }
    for (auto& column : columns) column.state().stand_in(tile.items[i]);
  }
  return covered_;
}

template <class Coder>
void ValueColumn<Coder>::make_room(std::uint32_t slots, std::uint32_t all) {
  for (auto& column : columns_) {
    if (slots > 0) column.state().make_room(slots - 1);
    if (all > 0) column.state().count_room(all - 1);
  }
}
template <class Coder>
void ValueColumn<Coder>::use_reference() {
  for (auto& column : columns_) column.state().use_reference();
}

template <class Coder>
EncodedColumn ValueColumn<Coder>::encode(const TiledItems& elements, const std::byte* values,
                                         std::size_t stride, Level level,
                                         const std::byte* reference) {
  const std::size_t count = covered_count(elements);
  Bits bits = bits_of(values, stride, count);
  const Bits references = bits_of(reference, stride, reference == nullptr ? 0 : count);
  const Codec codec = level == Level::best && has_tables_ ? Codec::mixed_columns : Codec::columns;

  // Zstd handles runs and repetitions better. Try it if a quick pass suggests that the values
  // consist mostly of these.
  const std::vector<std::byte> planes = level == Level::best || repeats_
                                            ? shuffled(packed(values, stride, count), width_)
                                            : std::vector<std::byte>();
  const std::size_t quick = planes.empty() ? 0 : zstd_compress(planes, 1).size();
  const bool may_repeat = !planes.empty() && (level == Level::best || quick * 6 < planes.size());
  std::optional<State> before;
  if (may_repeat) before = state();
  auto predicted = encode_predicted(elements, bits, references, level);
  if (!predicted) {
    forget_history();
    if (sees_other_groups_) keep_values(elements, bits);
    return {Codec::shuffled_zstd,
            pack_shuffled(shuffled(packed(values, stride, count), width_), kQuickZstd)};
  }
  EncodedColumn coded{codec, std::move(*predicted)};
  if (!may_repeat || (level != Level::best && quick > 2 * coded.bytes.size())) return coded;
  std::vector<std::byte> under_zstd = pack_shuffled(planes, level == Level::fast ? kQuickZstd : 19);
  if (under_zstd.size() >= coded.bytes.size()) return coded;
  restore(std::move(*before));
  forget_history();
  if (sees_other_groups_) keep_values(elements, bits);
  return {Codec::shuffled_zstd, std::move(under_zstd)};
}

template <class Coder>
std::size_t ValueColumn<Coder>::covered_count(const TiledItems& elements) const {
  if (elements.blocks.empty()) return elements.items.size();
  return static_cast<std::size_t>(
      std::count_if(elements.blocks.begin(), elements.blocks.end(),
                    [&](std::uint32_t block) { return covers(block); }));
}

template <class Coder>
auto ValueColumn<Coder>::bits_of(const std::byte* values, std::size_t stride,
                                 std::size_t count) const -> Bits {
  Bits bits(info_->components);
  for (std::size_t c = 0; c < info_->components; ++c) {
    bits[c].resize(count);
    for (std::size_t i = 0; i < count; ++i)
      bits[c][i] = load(values + i * stride + c * width_, width_);
  }
  return bits;
}

/// Returns the values of elements that are `stride` bytes apart, without gaps.
template <class Coder>
std::vector<std::byte> ValueColumn<Coder>::packed(const std::byte* values, std::size_t stride,
                                                  std::size_t count) const {
  const std::size_t bytes = width_ * info_->components;
  std::vector<std::byte> out(count * bytes);
  for (std::size_t i = 0; i < count; ++i)
    std::copy_n(values + i * stride, bytes, out.data() + i * bytes);
  return out;
}

template <class Coder>
bool ValueColumn<Coder>::code_head(Coder& coder, ColumnStyle style,
                                   std::span<const DomainPlan> plans, std::uint64_t most_entries) {
  style_.mixes = style.mixes;
  style_.hurries = style.hurries;
  style_.reach = static_cast<Reach>(
      std::min(code_tree(coder, reach_, static_cast<std::uint32_t>(style.reach)), 2u));
  style_.matches = coder.bit(matches_, style.matches) && has_tables_;
  style_.copies = has_copies_ && coder.bit(copies_, style.copies);
  if (!style_.copies) forget_history();
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    columns_[c].set_style(style_);
    if (!columns_[c].begin_group(coder, plans.empty() ? DomainPlan() : plans[c],
                                 std::span(columns_).first(c), most_entries))
      return false;
  }
  return true;
}

template <class Coder>
std::optional<std::vector<std::byte>> ValueColumn<Coder>::encode_predicted(
    const TiledItems& elements, Bits& bits, const Bits& reference, Level level) {
  back_ = copies_among(elements, bits);
  if (back_.empty()) return encode_as_told(elements, bits, reference, level);
  // Encode with and without copies: only the sizes show whether copies save more than their flags
  // cost.
  State before = state();
  const std::vector<DomainPlan> plans = plans_;
  auto with_copies = encode_as_told(elements, bits, reference, level);
  if (!with_copies) return with_copies;
  State after = state();
  std::vector<DomainPlan> its_plans = std::exchange(plans_, plans);
  restore(std::move(before));
  --groups_;
  back_.clear();
  auto without = encode_as_told(elements, bits, reference, level);
  if (without && without->size() <= with_copies->size()) return without;
  if (!without) ++groups_;
  restore(std::move(after));
  plans_ = std::move(its_plans);
  return with_copies;
}

template <class Coder>
std::vector<std::uint32_t> ValueColumn<Coder>::copies_among(const TiledItems& elements,
                                                            const Bits& bits) {
  if (!has_copies_) return {};
  std::vector<std::uint8_t> stands;
  for (std::size_t i = 0; i < elements.items.size(); ++i)
    if (elements.blocks.empty() || covers(elements.blocks[i]))
      stands.push_back(stand_of(elements.items[i]));
  auto back = find_copies(stands, bits, history_, CopiedElements<Coder>::kFarthest);
  const auto none = static_cast<std::size_t>(std::count(back.begin(), back.end(), 0u));
  if ((back.size() - none) * kFewestCopies < back.size() || back.empty()) back.clear();
  return back;
}

template <class Coder>
std::vector<std::uint64_t> ValueColumn<Coder>::coded_ones(
    std::span<const std::uint64_t> bits) const {
  std::vector<std::uint64_t> coded(bits.begin(), bits.end());
  if (back_.empty()) return coded;
  coded.clear();
  for (std::size_t i = 0; i < bits.size(); ++i)
    if (back_[i] == 0) coded.push_back(bits[i]);
  return coded;
}

template <class Coder>
void ValueColumn<Coder>::restore(State&& state) {
  columns_ = std::move(state.columns);
  reach_ = state.reach;
  matches_ = state.matches;
  copies_ = state.copies;
  class_numbers_ = std::move(state.class_numbers);
  copied_ = std::move(state.copied);
  history_ = std::move(state.history);
}

template <class Coder>
void ValueColumn<Coder>::forget_history() {
  if (!has_copies_) return;
  copied_ = {};
  history_.assign(info_->components, {});
}

template <class Coder>
void ValueColumn<Coder>::keep_history(std::size_t component, std::span<const std::uint64_t> bits) {
  if (!style_.copies) return;
  auto& kept = history_[component];
  constexpr std::size_t kFarthest = CopiedElements<Coder>::kFarthest;
  kept.insert(kept.end(), bits.begin(), bits.end());
  if (kept.size() > 2 * kFarthest) kept.erase(kept.begin(), kept.end() - kFarthest);
}

template <class Coder>
std::optional<std::vector<std::byte>> ValueColumn<Coder>::encode_as_told(const TiledItems& elements,
                                                                         Bits& bits,
                                                                         const Bits& reference,
                                                                         Level level) {
  // Find the first tile with covered elements.
  std::vector<Neighbourhood> first;
  for_each_tile(elements, [&](const TiledItems::Tile& tile) {
    if (!first.empty()) return;
    const auto own = covered_to_try(tile, columns_);
    first.assign(own.begin(), own.end());
  });
  const ClassNumbers numbers = class_numbers_;  // trials number classes that may never be coded
  std::vector<DomainPlan> plans;
  for (std::size_t c = 0; c < info_->components; ++c)
    plans.push_back(choose_domain(c, elements, bits[c], reference[c], level));
  for (std::size_t c = 0; c < info_->components; ++c)
    if (!columns_[c].may_change_to(plans[c].domain)) {
      class_numbers_ = numbers;
      return std::nullopt;
    }
  const ColumnStyle style = choose_style(first, bits, reference, plans, level);
  class_numbers_ = numbers;
  code_head(coder_, style, plans, bits[0].size());
  plans_ = std::move(plans);
  ++groups_;

  std::size_t offset = 0;
  for_each_tile(elements, [&](const TiledItems::Tile& tile) {
    const auto own = covered(tile);
    if (own.empty()) return;
    classify(own, style_);
    const auto own_back = part_of(back_, offset, own.size());
    std::vector<std::uint32_t> back(own_back.begin(), own_back.end());
    if (style_.copies) copied_.code(coder_, classes_, back);
    for (std::size_t c = 0; c < info_->components; ++c)
      code_component(c, own, std::span(bits[c]).subspan(offset, own.size()),
                     part_of(reference[c], offset, own.size()), back);
    offset += own.size();
  });
  if constexpr (Coder::kDecodes)
    return std::vector<std::byte>();
  else
    return coder_.finish();
}

/// Chooses the style. Far neighbours and matches cost time. Below level best they are used only if
/// they save enough bytes in the first tile. The first group of a mesh uses the full style, since
/// its first tile is not representative.
template <class Coder>
ColumnStyle ValueColumn<Coder>::choose_style(std::span<const Neighbourhood> first_tile,
                                             const Bits& bits, const Bits& reference,
                                             std::span<const DomainPlan> plans, Level level) {
  ColumnStyle full;
  full.mixes = level == Level::best && has_tables_;
  full.matches = has_tables_;
  full.copies = !back_.empty();
  if (level == Level::fast) return {farthest_reach(level), false, false, true, full.copies};
  if (level == Level::best || groups_ == 0 || first_tile.empty()) return full;
  const ColumnStyle lean{Reach::lattice, false, false, false, full.copies};
  const std::size_t least = size_with(full, first_tile, bits, reference, plans);
  const std::size_t lean_size = size_with(lean, first_tile, bits, reference, plans);
  return lean_size <= least || (lean_size - least) * kWorthFarShare <= lean_size ? lean : full;
}

/// Returns the encoded size of the first tile in a style, without heads.
template <class Coder>
std::size_t ValueColumn<Coder>::size_with(const ColumnStyle& style,
                                          std::span<const Neighbourhood> first_tile,
                                          const Bits& bits, const Bits& reference,
                                          std::span<const DomainPlan> plans) {
  if constexpr (!Coder::kDecodes) {
    classify(first_tile, style);
    std::vector<CodedTile> coded(columns_.size());
    std::vector<const CodedTile*> before;
    Coder head, body;
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      typename ScalarColumn<Coder>::Trial column(columns_[c], first_tile, plans[c].domain);
      column->set_style(style);
      column->begin_group(head, plans[c], std::span(columns_).first(c), bits[c].size());
      const auto own = std::span(bits[c]).first(first_tile.size());
      std::vector<std::uint64_t> values(own.begin(), own.end());
      column->code_tile(body,
                        {first_tile, tile_classes(), before,
                         part_of(reference[c], 0, values.size()), part_of(back_, 0, values.size())},
                        values);
      coded[c] = column->coded_tile();
      before.push_back(&coded[c]);
    }
    return body.finish().size();
  }
  return 0;
}

template <class Coder>
void ValueColumn<Coder>::keep_values(const TiledItems& elements, const Bits& bits) {
  std::size_t offset = 0;
  for_each_tile(elements, [&](const TiledItems::Tile& tile) {
    const auto own = covered(tile);
    for (std::size_t c = 0; c < info_->components; ++c)
      columns_[c].state().keep_values(own, std::span(bits[c]).subspan(offset, own.size()));
    offset += own.size();
  });
}

template <class Coder>
void ValueColumn<Coder>::classify(std::span<const Neighbourhood> items, const ColumnStyle& style) {
  const std::uint32_t counts = style.known();
  classes_.resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) classes_[i] = class_numbers_.of(items[i], counts);
}

template <class Coder>
bool ValueColumn<Coder>::code_component(std::size_t component, std::span<const Neighbourhood> items,
                                        std::span<std::uint64_t> bits,
                                        std::span<const std::uint64_t> reference,
                                        std::span<const std::uint32_t> back) {
  coded_tiles_.clear();
  for (std::size_t c = 0; c < component; ++c) coded_tiles_.push_back(&columns_[c].coded_tile());
  ColumnTile tile{items, tile_classes(), coded_tiles_, reference, back};
  if (style_.copies) tile.history = history_[component];
  if (!columns_[component].code_tile(coder_, tile, bits)) return false;
  keep_history(component, bits);
  return true;
}

/// Chooses a domain as described in mode_choice.h and earlier_values.h.
template <class Coder>
DomainPlan ValueColumn<Coder>::choose_domain(std::size_t component, const TiledItems& elements,
                                             const std::vector<std::uint64_t>& bits,
                                             const std::vector<std::uint64_t>& reference,
                                             Level level) {
  const std::vector<std::uint64_t> coded = coded_ones(bits);
  // The domain of the previous group usually fits this group, too.
  if (level != Level::best && groups_ % kGroupsKept != 0 && plans_[component].table.empty() &&
      still_fits(*info_, component, plans_[component].domain, coded))
    return plans_[component];
  auto plans = domain_candidates(*info_, component, coded);
  if (coded.empty() || (plans.size() == 1 && !has_earlier_values_)) return std::move(plans[0]);
  return best_domain(component, elements, bits, reference, std::move(plans)).plan;
}

/// Returns the best of these plans, and decides whether it recalls values and has partners.
template <class Coder>
DomainChoice ValueColumn<Coder>::best_domain(std::size_t component, const TiledItems& elements,
                                             const std::vector<std::uint64_t>& bits,
                                             const std::vector<std::uint64_t>& reference,
                                             std::vector<DomainPlan> plans) {
  const DomainSample sample = survey(component, elements, bits, reference);
  const double scale = static_cast<double>(bits.size()) / static_cast<double>(sample.bits.size());
  std::vector<DomainEstimate> estimates;
  std::vector<ClassModes> modes;
  std::vector<DomainChoice> choices;
  // Best plan without a table; values can be recalled only without a table
  std::size_t best = 0, best_without = plans.size();
  for (std::size_t p = 0; p < plans.size(); ++p) {
    estimates.push_back(estimate_plan(*info_, component, plans[p], sample,
                                      class_numbers_.families(), style_.matches, modes));
    const std::size_t table =
        columns_[component].table_bytes(plans[p], std::span(columns_).first(component));
    const double all = estimates[p].bits * scale + 8.0 * static_cast<double>(table);
    choices.push_back(
        {std::move(plans[p]), all, estimates[p].bits / static_cast<double>(sample.bits.size())});
    if (all < choices[best].bits) best = p;
    if (choices[p].plan.table.empty() &&
        (best_without == plans.size() || all < choices[best_without].bits))
      best_without = p;
  }
  if (!has_earlier_values_) return std::move(choices[best]);
  const std::vector<std::uint64_t> coded = coded_ones(bits);
  std::vector<std::size_t> tried{best};
  if (best_without < plans.size() && best_without != best) tried.push_back(best_without);
  for (std::size_t p : tried) {
    DomainPlan& plan = choices[p].plan;
    EarlierValues earlier(*info_, component, plan.domain, coded, reference);
    if (!earlier.may_help()) continue;
    const auto values = coded_values(sample, estimates[p]);
    choices[p].bits -= scale * earlier.choose(values, !plan.table.empty(), plan.domain);
  }
  if (best_without < plans.size() && choices[best_without].bits < choices[best].bits)
    best = best_without;
  return std::move(choices[best]);
}

/// Estimates the size. The estimate ignores copies, since which elements are copies does not depend
/// on their neighbours.
template <class Coder>
std::uint64_t ValueColumn<Coder>::about_bytes(const TiledItems& elements, const std::byte* values,
                                              std::size_t stride,
                                              std::vector<DomainChoice>& choices) {
  const std::size_t count = covered_count(elements);
  if (count == 0) return 0;
  const Bits bits = bits_of(values, stride, count);
  const ClassNumbers numbers = class_numbers_;
  back_.clear();
  double sum = 0;
  for (std::size_t c = 0; c < info_->components; ++c) {
    if (c == choices.size())
      choices.push_back(
          best_domain(c, elements, bits[c], {}, domain_candidates(*info_, c, bits[c])));
    else
      rescale(choices[c], c, elements, bits[c]);
    sum += choices[c].bits;
  }
  class_numbers_ = numbers;
  const auto bytes = static_cast<std::uint64_t>(std::max(sum, 0.0) / 8);
  if (!repeats_) return bytes;
  const auto planes = shuffled(packed(values, stride, count), width_);
  return std::min<std::uint64_t>(bytes, zstd_compress(planes, 1).size());
}

/// Adapts the estimate of a domain choice to these elements.
template <class Coder>
void ValueColumn<Coder>::rescale(DomainChoice& choice, std::size_t component,
                                 const TiledItems& elements,
                                 const std::vector<std::uint64_t>& bits) {
  const DomainSample sample = survey(component, elements, bits, {});
  std::vector<ClassModes> modes;
  const double bits_each = estimate_plan(*info_, component, choice.plan, sample,
                                         class_numbers_.families(), style_.matches, modes)
                               .bits /
                           static_cast<double>(sample.bits.size());
  if (choice.sampled_bits > 0) choice.bits *= bits_each / choice.sampled_bits;
  if (bits_each > 0) choice.sampled_bits = bits_each;
}

template <class Coder>
std::uint64_t ValueColumn<Coder>::bytes_if_coded(const TiledItems& elements,
                                                 const std::byte* values, std::size_t stride,
                                                 Level level) {
  State before = state();
  const std::vector<DomainPlan> plans = plans_;
  const std::uint32_t groups = groups_;
  const std::size_t bytes = encode(elements, values, stride, level).bytes.size();
  restore(std::move(before));
  plans_ = plans;
  groups_ = groups;
  return bytes;
}

/// Returns the elements of the sample that are coded. Their places are counted among all coded
/// elements.
template <class Coder>
std::vector<EarlierValues::Value> ValueColumn<Coder>::coded_values(
    const DomainSample& sample, const DomainEstimate& estimate) const {
  std::vector<EarlierValues::Value> values;
  std::size_t place = 0, copied = 0;
  for (std::size_t s = 0; s < sample.places.size(); ++s) {
    for (; place < sample.places[s]; ++place) copied += !back_.empty() && back_[place] > 0 ? 1 : 0;
    if (!back_.empty() && back_[place] > 0) continue;
    values.push_back({static_cast<std::uint32_t>(place - copied), estimate.predicted[s],
                      estimate.by_element[s], estimate.lengths[s]});
  }
  return values;
}

/// Returns a sample of the elements of the group for the component.
template <class Coder>
DomainSample ValueColumn<Coder>::survey(std::size_t component, const TiledItems& elements,
                                        const std::vector<std::uint64_t>& bits,
                                        const std::vector<std::uint64_t>& reference) {
  DomainSample sample;
  if constexpr (!Coder::kDecodes) {
    typename ScalarColumn<Coder>::Trial column(columns_[component], elements.items,
                                               widest_domain(*info_));
    column->set_style(style_);
    column->state().change_domain(widest_domain(*info_));
    std::size_t offset = 0;
    for_each_tile(elements, [&](const TiledItems::Tile& tile) {
      const auto own = covered_to_try(tile, std::span(column.operator->(), 1));
      if (own.empty()) return;
      classify(own, style_);
      column->survey({own,
                      tile_classes(),
                      {},
                      part_of(reference, offset, own.size()),
                      part_of(back_, offset, own.size())},
                     part_of(bits, offset, own.size()), offset, bits.size(), sample);
      offset += own.size();
    });
  }
  return sample;
}

template <class Coder>
bool ValueColumn<Coder>::begin_group(Codec codec, std::span<const std::byte> bytes,
                                     std::uint64_t limit) {
  if (!takes(codec)) return false;
  codec_ = codec;
  if (codec == Codec::shuffled_zstd) forget_history();
  if (codec != Codec::shuffled_zstd) {
    if constexpr (Coder::kDecodes) coder_ = Coder(bytes);
    ColumnStyle style;
    style.mixes = codec == Codec::mixed_columns;
    return code_head(coder_, style, {}, limit / (width_ * info_->components));
  }
  auto values = unpack_shuffled(bytes, width_, limit);
  if (!values || values->size() % (width_ * info_->components) != 0) return false;
  unpacked_ = std::move(*values);
  unpacked_at_ = 0;
  return true;
}

template <class Coder>
bool ValueColumn<Coder>::decode_tile(const TiledItems::Tile& tile, std::vector<std::byte>& out,
                                     const std::byte* reference) {
  const auto own = covered(tile);
  if (own.empty()) return true;
  const std::size_t stride = width_ * info_->components, base = out.size();
  const std::size_t bytes = own.size() * stride;
  bits_.resize(own.size());
  if (codec_ == Codec::shuffled_zstd) {
    if (bytes > unpacked_.size() - unpacked_at_) return false;
    const std::byte* from = unpacked_.data() + unpacked_at_;
    out.insert(out.end(), from, from + bytes);
    unpacked_at_ += bytes;
    for (std::size_t c = 0; c < info_->components; ++c) {
      for (std::size_t i = 0; i < own.size(); ++i)
        bits_[i] = load(from + i * stride + c * width_, width_);
      columns_[c].state().keep_values(own, bits_);
    }
    return memory_ == nullptr || !memory_->is_refused();
  }
  out.resize(base + bytes);
  classify(own, style_);
  back_.assign(style_.copies ? own.size() : 0, 0);
  if (style_.copies && !copied_.code(coder_, classes_, back_)) return false;
  for (std::size_t c = 0; c < info_->components; ++c) {
    reference_bits_.resize(reference == nullptr ? 0 : own.size());
    for (std::size_t i = 0; i < reference_bits_.size(); ++i)
      reference_bits_[i] = load(reference + i * stride + c * width_, width_);
    if (!code_component(c, own, bits_, reference_bits_, back_)) return false;
    std::byte* to = out.data() + base + c * width_;
    for (std::size_t i = 0; i < own.size(); ++i) store(to + i * stride, bits_[i], width_);
  }
  return true;
}

template class ValueColumn<SplitEncoder>;
template class ValueColumn<SplitDecoder>;

}  // namespace shm
