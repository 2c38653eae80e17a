#include "codecs/surface/values/scalar_column.h"

#include <algorithm>
#include <bit>

#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/rank_table.h"

namespace shm {
namespace {

/// Returns the state that represents a value without an index or without a finite state: the
/// lattice prediction, rounded to the domain.
double substitute(const auto& space, double lattice) {
  const double state = space.state(space.index(lattice));
  return is_finite(state) ? state : 0.0;
}

double state_of(const auto& space, std::int64_t index, double lattice) {
  const double state = space.state(index);
  return is_finite(state) ? state : substitute(space, lattice);
}

/// Returns the state of a copied value, which is not coded in this domain and may be outside of it.
double state_of_copy(const auto& space, const ColumnState& column, std::uint64_t bits,
                     double lattice) {
  const double state = column.translator().from_value(scalar_as_double(column.info().type, bits));
  return is_finite(state) ? state : substitute(space, lattice);
}

/// True if values of this space may be recalled. Values that are ranks in a table are not recalled.
template <class Space>
constexpr bool kMayRecall = !requires(const Space& space) {
  space.table;
};

/// Encoder: estimated cost in bits of the flag of a recalled value.
constexpr std::uint32_t kRecallBits = 2;

/// Returns the modes for an element without a partner.
ClassModes modes_without_partner(const ClassModes& modes) {
  ClassModes own = modes;
  if (own.second == kPartnerMode) own.second = kNoMode;
  if (own.mode != kPartnerMode) return own;
  own.mode = own.second == kNoMode ? static_cast<std::uint32_t>(kLattice) : own.second;
  own.second = kNoMode;
  return own;
}

}  // namespace

// --- groups and tiles

template <class Coder>
bool ScalarColumn<Coder>::begin_group(Coder& coder, const DomainPlan& plan,
                                      std::span<const ScalarColumn<Coder>> before,
                                      std::uint64_t most_entries) {
  const auto domain = models_.code_domain(coder, info(), state_.domain(), plan.domain);
  if (!domain) return false;
  if (Coder::kDecodes && !state_.may_change_to(*domain, kMostMovesForEach)) return false;
  if (!(*domain == state_.domain())) state_.change_domain(*domain);
  if (!models_.code_has_table(coder, !plan.table.empty())) {
    table_.clear();
    return true;
  }
  std::vector<std::int64_t> known = known_entries(*domain, before);
  table_ = plan.table;
  return models_.code_table(coder, domain->kind, std::move(known), most_entries, table_);
}

template <class Coder>
std::vector<std::int64_t> ScalarColumn<Coder>::known_entries(
    const ValueDomain& domain, std::span<const ScalarColumn<Coder>> before) const {
  std::vector<std::int64_t> known;
  add_known_entries(table_, domain.kind, known);
  for (const ScalarColumn& other : before)
    if (other.state_.domain().has_states_of(domain))
      add_known_entries(other.table_, domain.kind, known);
  return known;
}

template <class Coder>
std::size_t ScalarColumn<Coder>::table_bytes(const DomainPlan& plan,
                                             std::span<const ScalarColumn<Coder>> before) const {
  if constexpr (!Coder::kDecodes) {
    if (plan.table.empty()) return 0;
    Coder coder;
    RankTableModels models;
    std::vector<std::int64_t> table = plan.table;
    code_rank_table(coder, models, plan.domain.kind, known_entries(plan.domain, before),
                    table.size(), table);
    return coder.finish().size();
  }
  return 0;
}

template <class Coder>
bool ScalarColumn<Coder>::code_tile(Coder& coder, const ColumnTile& tile,
                                    std::span<std::uint64_t> bits) {
  if (!state_.begin_tile(tile)) return false;
  models_.begin_tile(tile.classes);
  const bool ok = with_space(info(), state_.domain(), table_, [&](const auto& space) {
    if constexpr (!Coder::kDecodes) choose_modes(space, tile, bits);
    return code_values(coder, space, tile, bits);
  });
  return ok && state_.end_tile(tile.items);
}

// --- values

template <class Coder>
template <class Space>
bool ScalarColumn<Coder>::code_values(Coder& coder, const Space& space, const ColumnTile& tile,
                                      std::span<std::uint64_t> bits) {
  const std::uint32_t counts = style_.known();
  for (std::size_t i = 0; i < tile.items.size(); ++i) {
    const Neighbourhood& item = tile.items[i];
    TileElement element{tile, i};
    if (!looked_ahead()) state_.find_matches(element);
    if (const std::uint32_t back = element.back(); back > 0) {
      if constexpr (Coder::kDecodes)
        bits[i] = back <= i ? bits[i - back] : tile.history[tile.history.size() - (back - i)];
      state_.keep_copied(element);
      if (looked_ahead()) continue;
      const auto feature = [&](std::uint32_t f) { return state_.feature(element, f); };
      const double lattice = Predictor(item.traits(counts), feature).lattice();
      state_.keep(element, state_of_copy(space, state_, bits[i], lattice), lattice);
      continue;
    }
    double reference = 0.0;
    if (state_.has_reference()) {
      reference = looked_ahead() ? sample(i).reference : state_.reference_state(tile.reference[i]);
      if (looked_ahead())
        element.partner.is = sample(i).has_partner;
      else
        state_.find_partner(element, tile.reference[i]);
    }
    const auto at = [&](std::uint32_t feature) {
      return looked_ahead() ? sample(i).state[feature] : state_.feature(element, feature);
    };
    const auto difference_at = [&](std::uint32_t feature) {
      if (looked_ahead()) return scratch_->samples.differences[i][feature];
      if (feature == kFPartner) return element.partner.state - element.partner.then;
      return at(feature) - state_.reference_feature(item, feature, reference);
    };
    const ClassModes& of_class =
        models_.modes(coder, element.of_class(), state_.has_reference(), scratch_->wanted);
    ClassModes without_partner;
    const bool has_all =
        element.partner.is || (of_class.mode != kPartnerMode && of_class.second != kPartnerMode);
    if (!has_all) without_partner = modes_without_partner(of_class);
    const ClassModes& modes = has_all ? of_class : without_partner;
    const ClassPredictor predict(modes, item.traits(counts), at, difference_at, reference);

    const auto value = code_value(coder, space, element, predict, bits[i]);
    if (!value) return false;

    state_.keep_residual(element, value->size, value->second, value->recalled);
    if (looked_ahead()) continue;  // the states are already updated
    if (state_.has_reference()) state_.keep_reference(item, reference);
    state_.keep(element, value->state, predict.lattice());
  }
  return true;
}

/// Codes the residual of a value, or the whole value if it is an escape.
template <class Coder>
template <class Space, class Predict>
auto ScalarColumn<Coder>::code_value(Coder& coder, const Space& space, const TileElement& element,
                                     const Predict& predict, std::uint64_t& bits)
    -> std::optional<CodedValue> {
  std::optional<std::int64_t> actual;
  if constexpr (!Coder::kDecodes)
    actual = looked_ahead() ? sample(element.i).index : index_in(space, state_.translator(), bits);
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

/// Codes which mode predicts the value: the first mode of the class, or the second mode if its
/// residual is smaller.
template <class Coder>
template <class Space, class Predict>
auto ScalarColumn<Coder>::code_prediction(Coder& coder, const Space& space,
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

/// Codes the index of a value as its residual against the prediction, or against a recalled value.
/// Returns nothing if the data is damaged.
template <class Coder>
template <class Space, class Predict>
std::optional<std::int64_t> ScalarColumn<Coder>::code_index(Coder& coder, const Space& space,
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
  if constexpr (!Coder::kDecodes) watch_.note(element.of_class(), length);
  return keep(plus(expected.index, residual), length);
}

/// Codes whether the value is recalled, that is, coded relative to an earlier value of about the
/// same magnitude. If it is recalled, codes the rank of that earlier value among all values so far,
/// relative to the expected rank, and the residual against the earlier value. `index`: index of the
/// value. Returns false if the data is damaged.
template <class Coder>
template <class Space>
bool ScalarColumn<Coder>::code_recalled(Coder& coder, const Space& space,
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
    const double actual = state_.translator().as_value(space.state(index));
    if (is_finite(actual) && (actual < 0) == negative) {
      const std::size_t above = so_far.rank_of(SortedValues::magnitude_of(actual));
      std::uint32_t least = 65;
      for (std::size_t candidate = above == 0 ? 0 : above - 1;
           candidate < so_far.size() && candidate <= above; ++candidate) {
        const std::uint32_t length = bit_length(minus(index, index_at(candidate)));
        if (length >= least) continue;
        least = length;
        rank = candidate;
      }
      const std::int64_t by = minus(static_cast<std::int64_t>(rank), from);
      const std::uint32_t besides = by == 0 && by_source ? 0 : kRecallBits;
      value.recalled = bit_length(by) + least + besides < bit_length(minus(index, expected.index));
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
  if constexpr (!Coder::kDecodes)
    watch_.note(element.of_class(), bit_length(by) + bit_length(residual));
  return true;
}

/// Codes the bits of the value with this index. Returns false if there is no such value.
template <class Coder>
template <class Space>
bool ScalarColumn<Coder>::code_bits(Coder& coder, const Space& space, std::int64_t index,
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

// --- encoder: choice of modes

template <class Coder>
template <class Space>
void ScalarColumn<Coder>::choose_modes(const Space& space, const ColumnTile& tile,
                                       std::span<const std::uint64_t> bits) {
  looked_ahead_ = watch_.begin_tile(tile.classes.of_item, style_.hurries);
  models_.copy_modes(scratch_->wanted);
  if (!looked_ahead_) return;
  look_ahead(space, tile, bits);
  shm::choose_modes(space, scratch_->samples, tile.classes.families, style_.matches,
                    scratch_->wanted);
}

/// Collects the state, index, class and features of all elements of the tile, and updates the
/// states to the end of the tile.
template <class Coder>
template <class Space>
void ScalarColumn<Coder>::look_ahead(const Space& space, const ColumnTile& tile,
                                     std::span<const std::uint64_t> bits) {
  auto& [samples, differences] = scratch_->samples;
  samples.resize(tile.items.size());
  if (state_.has_reference()) differences.resize(tile.items.size());
  for (std::size_t i = 0; i < tile.items.size(); ++i)
    look_at(space, tile, i, bits[i], samples[i],
            state_.has_reference() ? &differences[i] : nullptr);
}

/// Does the same for one element.
template <class Coder>
template <class Space>
void ScalarColumn<Coder>::look_at(const Space& space, const ColumnTile& tile, std::size_t i,
                                  std::uint64_t bits, ModeSample& sample,
                                  std::array<double, kFeatures>* differences) {
  const Neighbourhood& item = tile.items[i];
  TileElement element{tile, i};
  state_.find_matches(element);
  sample.known = item.traits(style_.known());
  sample.of_class = element.of_class();
  if (state_.has_reference()) state_.find_partner(element, tile.reference[i]);
  sample.has_partner = element.partner.is;
  state_.features(element, sample.known, sample.state);
  const auto at = [&](std::uint32_t feature) { return sample.state[feature]; };
  const double lattice = Predictor(sample.known, at).lattice();
  sample.copied = element.back() > 0;
  sample.index = sample.copied ? std::nullopt : index_in(space, state_.translator(), bits);
  const double state = sample.copied  ? state_of_copy(space, state_, bits, lattice)
                       : sample.index ? state_of(space, *sample.index, lattice)
                                      : substitute(space, lattice);
  if (state_.has_reference()) {
    sample.reference = state_.reference_state(tile.reference[i]);
    for (std::uint32_t f = 0; f < kFeatures; ++f)
      if (f >= kFLast || (sample.known >> f & 1) != 0)
        (*differences)[f] = sample.state[f] - state_.reference_feature(item, f, sample.reference);
    (*differences)[kFPartner] = element.partner.state - element.partner.then;
    state_.keep_reference(item, sample.reference);
  }
  state_.keep(element, state, lattice);
}

template <class Coder>
void ScalarColumn<Coder>::survey(const ColumnTile& tile, std::span<const std::uint64_t> bits,
                                 std::size_t place, std::size_t of, DomainSample& sample) {
  state_.begin_tile(tile);
  sample.domain = state_.domain();
  with_space(info(), state_.domain(), {}, [&](const auto& space) {
    for (std::size_t i = 0; i < tile.items.size(); ++i) {
      if (DomainSample::takes(place + i, of)) {
        if (state_.has_reference()) sample.elements.differences.emplace_back();
        look_at(space, tile, i, bits[i], sample.elements.samples.emplace_back(),
                state_.has_reference() ? &sample.elements.differences.back() : nullptr);
        sample.bits.push_back(bits[i]);
        sample.places.push_back(static_cast<std::uint32_t>(place + i));
        continue;
      }
      TileElement element{tile, i};
      state_.find_matches(element);
      const auto at = [&](std::uint32_t feature) { return state_.feature(element, feature); };
      const double lattice = Predictor(element.item.traits(style_.known()), at).lattice();
      const double state = state_of_copy(space, state_, bits[i], lattice);
      if (state_.has_reference())
        state_.keep_reference(element.item, state_.reference_state(tile.reference[i]));
      state_.keep(element, state, lattice);
    }
    return true;
  });
}

template class ScalarColumn<SplitEncoder>;
template class ScalarColumn<SplitDecoder>;

}  // namespace shm
