#include "codecs/surface/values/column_coder.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "codecs/shared/shuffled_zstd.h"
#include "codecs/surface/values/rank_table.h"

namespace shm {
namespace {

/// True if values in this kind of domain may be recalled, i.e. coded relative to an earlier value.
/// Values that are coded as ranks in a table cannot be recalled.
template <class Space>
constexpr bool kMayRecall = !requires(const Space& space) {
  space.table;
};

/// Returns the modes that predict an element without a partner (an earlier element with a similar
/// reference value). They are the modes of the element's class except kPartnerMode. If the class
/// has only kPartnerMode, the element is predicted by the lattice.
ClassModes modes_without_partner(const ClassModes& modes) {
  ClassModes own = modes;
  if (own.second == kPartnerMode) own.second = kNoMode;
  if (own.mode != kPartnerMode) return own;
  own.mode = own.second == kNoMode ? static_cast<std::uint32_t>(kLattice) : own.second;
  own.second = kNoMode;
  return own;
}

// --- encoding: the choice of an earlier value to recall

/// Estimated cost in bits of the flag that marks a recalled value.
constexpr std::uint32_t kRecallBits = 2;

/// An earlier value, given by its rank, and the length in bits of the residual from this value.
struct EarlierRank {
  std::size_t rank = 0;
  std::uint32_t length = 65;
};

/// Returns the earlier value for which the residual of `value` is shortest. Only magnitudes are
/// recalled; the sign is that of the prediction. Returns nothing if `value` has the other sign.
/// `index_at(rank)` returns the index of the earlier value with this rank, after it has been given
/// the sign of the prediction.
template <class IndexAt>
std::optional<EarlierRank> best_earlier(const SortedValues& so_far, double value, bool negative,
                                        std::int64_t index, const IndexAt& index_at) {
  if (!is_finite(value) || (value < 0) != negative) return std::nullopt;
  const std::size_t above = so_far.rank_of(SortedValues::magnitude_of(value));
  EarlierRank best;
  for (std::size_t rank = above == 0 ? 0 : above - 1; rank < so_far.size() && rank <= above;
       ++rank) {
    const std::uint32_t length = bit_length(minus(index, index_at(rank)));
    if (length < best.length) best = {rank, length};
  }
  return best;
}

}  // namespace

// --- one component: groups and tiles

template <class Coder>
bool ComponentCoder<Coder>::begin_group(Coder& coder, const DomainAndTable& wanted,
                                        std::span<const ComponentCoder<Coder>> before,
                                        std::uint64_t most_entries) {
  const auto domain = models_.code_domain(coder, info(), state_.domain(), wanted.domain);
  if (!domain) return false;
  if (Coder::kDecodes && !state_.may_change_to(*domain, kMostMovesForEach)) return false;
  if (!(*domain == state_.domain())) state_.change_domain(*domain);
  if (!models_.code_has_table(coder, !wanted.table.empty())) {
    table_.clear();
    return true;
  }
  std::vector<std::int64_t> known = known_entries(*domain, before);
  table_ = wanted.table;
  return models_.code_table(coder, domain->kind, std::move(known), most_entries, table_);
}

template <class Coder>
std::vector<std::int64_t> ComponentCoder<Coder>::known_entries(
    const ValueDomain& domain, std::span<const ComponentCoder<Coder>> before) const {
  std::vector<std::int64_t> known;
  add_known_entries(table_, domain.kind, known);
  for (const ComponentCoder& other : before)
    if (other.state_.domain().has_states_of(domain))
      add_known_entries(other.table_, domain.kind, known);
  return known;
}

template <class Coder>
bool ComponentCoder<Coder>::code_tile(Coder& coder, const ColumnTile& tile,
                                      std::span<std::uint64_t> bits, const TilePlan& plan) {
  if constexpr (!Coder::kDecodes) plan_ = plan;
  const bool ok = with_space(info(), state_.domain(), table_, [&](const auto& space) {
    return code_values(coder, space, tile, bits);
  });
  if constexpr (!Coder::kDecodes) plan_ = {};
  return ok && state_.end_tile(tile.items);
}

// --- one component: values

template <class Coder>
double ComponentCoder<Coder>::StateAt::operator()(std::uint32_t feature) const {
  return coder->has_inputs() ? coder->inputs(element->i).state[feature]
                             : coder->state_.feature(*element, feature);
}

template <class Coder>
double ComponentCoder<Coder>::DifferenceAt::operator()(std::uint32_t feature) const {
  const TileElement& element = *at.element;
  if (at.coder->has_inputs()) return at.coder->plan_.inputs->differences[element.i][feature];
  if (feature == kFPartner) return element.partner.state - element.partner.then;
  return at(feature) - at.coder->state_.reference_feature(element.item, feature, reference);
}

template <class Coder>
template <class Space>
bool ComponentCoder<Coder>::code_values(Coder& coder, const Space& space, const ColumnTile& tile,
                                        std::span<std::uint64_t> bits) {
  const std::uint32_t counts = style_.known();
  for (std::size_t i = 0; i < tile.items.size(); ++i) {
    const Neighbourhood& item = tile.items[i];
    TileElement element{tile, i};
    if (!has_inputs()) state_.find_matches(element);
    if (const std::uint32_t back = element.back(); back > 0) {
      if constexpr (Coder::kDecodes)
        bits[i] = back <= i ? bits[i - back] : tile.history[tile.history.size() - (back - i)];
      state_.keep_copied(element);
      if (has_inputs()) continue;
      const double lattice = Predictor(item.traits(counts), StateAt{this, &element}).lattice();
      state_.keep(element, state_of_copy(space, state_, bits[i], lattice), lattice);
      continue;
    }
    double reference = 0.0;
    if (state_.has_reference()) {
      reference = has_inputs() ? inputs(i).reference : state_.reference_state(tile.reference[i]);
      if (has_inputs())
        element.partner.is = inputs(i).has_partner;
      else
        state_.find_partner(element, tile.reference[i]);
    }
    const StateAt at{this, &element};
    const DifferenceAt difference_at{at, reference};
    const ClassModes& of_class =
        models_.modes(coder, element.of_class(), state_.has_reference(), plan_.modes);
    ClassModes without_partner;
    const bool has_all =
        element.partner.is || (of_class.mode != kPartnerMode && of_class.second != kPartnerMode);
    if (!has_all) without_partner = modes_without_partner(of_class);
    const ClassModes& modes = has_all ? of_class : without_partner;
    const ClassPredictor predict(modes, item.traits(counts), at, difference_at, reference);

    const auto value = code_value(coder, space, element, predict, bits[i]);
    if (!value) return false;

    state_.keep_residual(element, value->size, value->second, value->recalled);
    if (has_inputs()) continue;  // the states are already updated
    if (state_.has_reference()) state_.keep_reference(item, reference);
    state_.keep(element, value->state, predict.lattice());
  }
  return true;
}

/// Codes a value: its residual, or the whole value if it is an escape.
template <class Coder>
template <class Space, class Predict>
auto ComponentCoder<Coder>::code_value(Coder& coder, const Space& space, const TileElement& element,
                                       const Predict& predict, std::uint64_t& bits)
    -> std::optional<CodedValue> {
  std::optional<std::int64_t> actual;
  if constexpr (!Coder::kDecodes)
    actual = has_inputs() ? inputs(element.i).index : index_in(space, state_.translator(), bits);
  bool escape = !Coder::kDecodes && !actual;
  if (state_.domain().escapes) escape = models_.code_escape(coder, escape);
  if (escape) {
    bits = models_.code_escaped(
        coder, bits, static_cast<int>(8 * scalar_bytes(info().type)),
        state_.has_reference() ? std::optional(element.tile.reference[element.i]) : std::nullopt);
    return CodedValue{substitute(space, predict.lattice())};
  }
  CodedValue value;
  const auto index = code_index(coder, space, element, predict, actual.value_or(0), value);
  if (!index || !code_bits(coder, space, *index, bits)) return std::nullopt;
  return value;
}

/// Codes which mode predicts the value. The encoder uses the second mode of the class if its
/// residual is smaller than that of the first mode.
template <class Coder>
template <class Space, class Predict>
auto ComponentCoder<Coder>::code_prediction(Coder& coder, const Space& space,
                                            const TileElement& element, const Predict& predict,
                                            std::int64_t actual) -> Prediction {
  const double first = predict(predict.modes().mode);
  const std::int64_t index = space.index(first);
  if (predict.modes().second == kNoMode) return {first, index, false};
  const double second = predict(predict.modes().second);
  const std::int64_t other = space.index(second);
  if (other == index) return {first, index, false};
  bool takes = false;
  if constexpr (!Coder::kDecodes)
    takes = bit_length(minus(actual, other)) + 1 < bit_length(minus(actual, index));
  takes = models_.code_takes_second(coder, element.of_class(), state_.seconds_near(element.item),
                                    takes);
  return takes ? Prediction{second, other, true} : Prediction{first, index, false};
}

/// Codes the index of a value as a residual from the prediction or from a recalled value. Returns
/// nothing if the data is damaged.
template <class Coder>
template <class Space, class Predict>
std::optional<std::int64_t> ComponentCoder<Coder>::code_index(Coder& coder, const Space& space,
                                                              const TileElement& element,
                                                              const Predict& predict,
                                                              std::int64_t actual,
                                                              CodedValue& value) {
  const Prediction expected = code_prediction(coder, space, element, predict, actual);
  const std::int32_t scale = space.scale(expected.state);
  const auto keep = [&](std::int64_t index, std::uint32_t missed) {
    value.state = state_of(space, index, predict.lattice());
    value.size =
        static_cast<ResidualSize>(missed == 0 ? 0 : static_cast<std::int32_t>(missed) + scale);
    value.second = expected.second;
    if (kMayRecall<Space> && state_.domain().recalls) state_.add_to_values_so_far(value.state);
    return index;
  };
  if (kMayRecall<Space> && state_.domain().recalls) {
    std::int64_t index = actual;
    if (!code_recalled(coder, space, element, expected, index, value)) return std::nullopt;
    if (value.recalled) return keep(index, bit_length(minus(index, expected.index)));
  }
  const ResidualContext context = state_.residual_context(element, scale);
  std::int64_t residual = Coder::kDecodes ? 0 : minus(actual, expected.index);
  if (style_.mixes) {
    const ClassModes& modes = predict.modes();
    const auto other = [&](std::uint32_t mode) {
      return minus(space.index(predict(mode)), expected.index);
    };
    const std::uint32_t not_taken = expected.second ? modes.mode : modes.second;
    residual = models_.code_mixed_residual(
        coder, context, expected.second, state_.sizes_around(element, scale), element.of_class(),
        {other(kLattice), other(not_taken == kNoMode ? kMeanNearMode : not_taken),
         other(kMeanLineMode)},
        residual);
  } else {
    residual = models_.code_residual(coder, context, expected.second, residual);
  }
  const std::uint32_t length = bit_length(residual);
  count_residual(element.of_class(), length);
  return keep(plus(expected.index, residual), length);
}

/// Codes whether the value is recalled, which means that it is coded relative to an earlier value
/// of about the same magnitude. If it is recalled, codes which earlier value is used, as the
/// difference between its rank (among all values so far) and the expected rank. Then codes the
/// residual from the earlier value. `index`: index of the value. Returns false if the data is
/// damaged.
template <class Coder>
template <class Space>
bool ComponentCoder<Coder>::code_recalled(Coder& coder, const Space& space,
                                          const TileElement& element, const Prediction& expected,
                                          std::int64_t& index, CodedValue& value) {
  RecalledValues& values = state_.values_so_far();
  if (values.empty()) return true;
  const SortedValues& so_far = values.list();
  const double predicted = state_.translator().as_value(expected.state);
  const bool negative = predicted < 0;
  const auto [start, by_source] =
      values.start(element.of_class(), SortedValues::magnitude_of(predicted));
  const auto from = static_cast<std::int64_t>(start);
  const auto index_at = [&](std::size_t rank) {
    const auto magnitude = std::bit_cast<double>(so_far.at(rank).magnitude);
    return space.index(state_.translator().from_value(negative ? -magnitude : magnitude));
  };
  std::size_t rank = 0;
  if constexpr (!Coder::kDecodes) {
    const auto best = best_earlier(so_far, state_.translator().as_value(space.state(index)),
                                   negative, index, index_at);
    if (best) {
      rank = best->rank;
      const std::int64_t by = minus(static_cast<std::int64_t>(rank), from);
      const std::uint32_t besides = by == 0 && by_source ? 0 : kRecallBits;
      value.recalled =
          bit_length(by) + best->length + besides < bit_length(minus(index, expected.index));
    }
  }
  value.recalled = models_.code_is_recalled(coder, by_source, state_.recalled_near(element.item),
                                            value.recalled);
  if (!value.recalled) return true;
  const std::int64_t by =
      models_.code_rank(coder, by_source, minus(static_cast<std::int64_t>(rank), from));
  const std::int64_t chosen = plus(from, by);
  if (chosen < 0 || chosen >= static_cast<std::int64_t>(so_far.size())) return false;
  const std::int64_t base = index_at(static_cast<std::size_t>(chosen));
  values.take(element.of_class(), static_cast<std::size_t>(chosen));
  const std::int64_t residual = models_.code_recalled(coder, minus(index, base));
  index = plus(base, residual);
  count_residual(element.of_class(), bit_length(by) + bit_length(residual));
  return true;
}

/// Codes the bits of the value that has this index. Returns false if no value has this
/// index.
template <class Coder>
template <class Space>
bool ComponentCoder<Coder>::code_bits(Coder& coder, const Space& space, std::int64_t index,
                                      std::uint64_t& bits) {
  if constexpr (requires { space.table; }) {
    if (index < 0 || static_cast<std::uint64_t>(index) >= space.table.size()) return false;
    index = space.table[static_cast<std::size_t>(index)];
  }
  const std::uint64_t minus_zero = negative_zero(info().type);
  bool negative = false;
  if (state_.domain().negative_zero && index == 0)
    negative = models_.code_negative_zero(coder, !Coder::kDecodes && bits == minus_zero);
  if constexpr (Coder::kDecodes) bits = negative ? minus_zero : state_.translator().bits(index);
  return true;
}

template class ComponentCoder<SplitEncoder>;
template class ComponentCoder<SplitDecoder>;

// --- all components

template <class Coder>
ColumnCoder<Coder>::ColumnCoder(const ArrayInfo& info, std::vector<std::uint32_t> blocks,
                                const ColumnTraits& traits)
    : info_(std::make_shared<const ArrayInfo>(info)),
      blocks_(std::move(blocks)),
      has_tables_(traits.tables && info.components <= kMostTableComponents),
      has_earlier_values_(has_tables_ && traits.earlier_values),
      has_copies_(has_earlier_values_ && traits.copies && info.components > 1 &&
                  info.quantization.bits == 0),
      width_(scalar_bytes(info.type)) {
  components_.reserve(info.components);
  for (std::size_t c = 0; c < info.components; ++c)
    components_.emplace_back(info_, c, has_earlier_values_);
  forget_history();
}

template <class Coder>
std::span<const Neighbourhood> ColumnCoder<Coder>::covered(const TiledItems::Tile& tile) {
  if (blocks_.empty()) return tile.items;
  const auto own = covered(tile, [&](const Neighbourhood& item) {
    for (auto& component : components_) component.state().stand_in(item);
  });
  const std::uint64_t others = tile.items.size() - own.size() + tile.left_out;
  for (auto& component : components_) component.state().count_left_out(others);
  return own;
}

template <class Coder>
void ColumnCoder<Coder>::make_room(std::uint32_t slots, std::uint32_t all) {
  for (auto& component : components_) {
    if (slots > 0) component.state().make_room(slots - 1);
    if (all > 0) component.state().count_room(all - 1);
  }
}
template <class Coder>
void ColumnCoder<Coder>::use_reference() {
  for (auto& component : components_) component.state().use_reference();
}

template <class Coder>
bool ColumnCoder<Coder>::code_head(Coder& coder, const ColumnStyle& style,
                                   std::span<const DomainAndTable> domains,
                                   std::uint64_t most_entries) {
  style_.mixes = style.mixes;
  style_.reach = static_cast<Reach>(
      std::min(code_tree(coder, reach_, static_cast<std::uint32_t>(style.reach)), 2u));
  style_.matches = coder.bit(matches_, style.matches) && has_tables_;
  style_.copies = has_copies_ && coder.bit(copies_, style.copies);
  if (!style_.copies) forget_history();
  if (!code_sources(coder, style.sources)) return false;
  for (std::size_t c = 0; c < components_.size(); ++c) {
    components_[c].set_style(style_);
    if (!components_[c].begin_group(coder, domains.empty() ? DomainAndTable() : domains[c],
                                    std::span(components_).first(c), most_entries))
      return false;
  }
  return true;
}

/// Codes the sources of the components. Returns false if a source is not an earlier component.
template <class Coder>
bool ColumnCoder<Coder>::code_sources(Coder& coder, const std::vector<std::uint8_t>& wanted) {
  style_.sources.clear();
  if (!has_earlier_values_ || components_.size() < kFewestWithSources) return true;
  if (!coder.bit(has_sources_, !wanted.empty())) return true;
  style_.sources.resize(components_.size());
  for (std::size_t c = 2; c < components_.size(); ++c) {
    const std::uint32_t source = code_tree(coder, source_, Coder::kDecodes ? 0u : wanted[c]);
    if (source >= c) return false;
    style_.sources[c] = static_cast<std::uint8_t>(source);
  }
  return true;
}

template <class Coder>
bool ColumnCoder<Coder>::begin_tile(Coder& coder, std::span<const Neighbourhood> items,
                                    std::span<std::uint32_t> back) {
  classify(items, style_.known());
  return !style_.copies || copied_.code(coder, classes_, back);
}

template <class Coder>
TileClasses ColumnCoder<Coder>::classify(std::span<const Neighbourhood> items,
                                         std::uint32_t known) {
  classes_.resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) classes_[i] = class_numbers_.of(items[i], known);
  return {classes_, class_numbers_.families()};
}

template <class Coder>
ColumnTile ColumnCoder<Coder>::tile_of(std::size_t component, std::span<const Neighbourhood> items,
                                       std::span<const std::uint64_t> reference,
                                       std::span<const std::uint32_t> back) {
  coded_tiles_.clear();
  for (std::size_t c = 0; c < component; ++c) coded_tiles_.push_back(&components_[c].coded_tile());
  ColumnTile tile{items, {classes_, class_numbers_.families()}, coded_tiles_, reference, back};
  if (component > 0) tile.source = coded_tiles_[style_.source_of(component)];
  if (style_.copies) tile.history = history_[component];
  return tile;
}

template <class Coder>
bool ColumnCoder<Coder>::code_tile(Coder& coder, std::size_t component, const ColumnTile& tile,
                                   std::span<std::uint64_t> bits, const TilePlan& plan) {
  if (!components_[component].code_tile(coder, tile, bits, plan)) return false;
  keep_history(component, bits);
  return true;
}

template <class Coder>
void ColumnCoder<Coder>::forget_history() {
  if (!has_copies_) return;
  copied_ = {};
  history_.assign(info_->components, {});
}

template <class Coder>
void ColumnCoder<Coder>::keep_history(std::size_t component, std::span<const std::uint64_t> bits) {
  if (!style_.copies) return;
  auto& kept = history_[component];
  constexpr std::size_t kFarthest = CopiedElements<Coder>::kFarthest;
  kept.insert(kept.end(), bits.begin(), bits.end());
  if (kept.size() > 2 * kFarthest) kept.erase(kept.begin(), kept.end() - kFarthest);
}

template class ColumnCoder<SplitEncoder>;
template class ColumnCoder<SplitDecoder>;

// --- decoding

void ColumnDecoder::use_memory(ColumnMemory& memory) {
  memory_ = &memory;
  for (auto& component : column_.components()) component.state().use_memory(memory);
}

bool ColumnDecoder::begin_group(Codec codec, std::span<const std::byte> bytes,
                                std::uint64_t limit) {
  if (!takes(codec)) return false;
  codec_ = codec;
  if (codec != Codec::shuffled_zstd) {
    coder_ = SplitDecoder(bytes);
    ColumnStyle style;
    style.mixes = codec == Codec::mixed_columns;
    return column_.code_head(coder_, style, {}, limit / column_.element_bytes());
  }
  column_.forget_history();
  auto values = unpack_shuffled(bytes, column_.scalar_width(), limit);
  if (!values || values->size() % column_.element_bytes() != 0) return false;
  unpacked_ = std::move(*values);
  unpacked_at_ = 0;
  return true;
}

bool ColumnDecoder::decode_tile(const TiledItems::Tile& tile, std::vector<std::byte>& out,
                                const std::byte* reference) {
  const auto items = column_.covered(tile);
  if (items.empty()) return true;
  bits_.resize(items.size());
  if (codec_ == Codec::shuffled_zstd) return copy_unpacked(items, out);
  const std::size_t stride = column_.element_bytes(), width = column_.scalar_width();
  const std::size_t base = out.size();
  out.resize(base + items.size() * stride);
  back_.assign(column_.style().copies ? items.size() : 0, 0);
  if (!column_.begin_tile(coder_, items, back_)) return false;
  const auto components = column_.components();
  for (std::size_t c = 0; c < components.size(); ++c) {
    reference_bits_.resize(reference == nullptr ? 0 : items.size());
    for (std::size_t i = 0; i < reference_bits_.size(); ++i)
      reference_bits_[i] = load_scalar(reference + i * stride + c * width, width);
    const ColumnTile own = column_.tile_of(c, items, reference_bits_, back_);
    if (!components[c].begin_tile(own) || !column_.code_tile(coder_, c, own, bits_)) return false;
    std::byte* to = out.data() + base + c * width;
    for (std::size_t i = 0; i < items.size(); ++i) store_scalar(to + i * stride, bits_[i], width);
  }
  return true;
}

/// Appends the next values of a group coded with shuffled_zstd to `out`. Also stores the values in
/// the states of the components.
bool ColumnDecoder::copy_unpacked(std::span<const Neighbourhood> items,
                                  std::vector<std::byte>& out) {
  const std::size_t stride = column_.element_bytes(), width = column_.scalar_width();
  const std::size_t bytes = items.size() * stride;
  if (bytes > unpacked_.size() - unpacked_at_) return false;
  const std::byte* from = unpacked_.data() + unpacked_at_;
  out.insert(out.end(), from, from + bytes);
  unpacked_at_ += bytes;
  const auto components = column_.components();
  for (std::size_t c = 0; c < components.size(); ++c) {
    for (std::size_t i = 0; i < items.size(); ++i)
      bits_[i] = load_scalar(from + i * stride + c * width, width);
    components[c].state().keep_values(items, bits_);
  }
  return memory_ == nullptr || !memory_->is_refused();
}

}  // namespace shm
