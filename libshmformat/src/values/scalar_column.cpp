#include "values/scalar_column.h"

#include <algorithm>

#include "bytes/lists.h"
#include "bytes/whole_numbers.h"

namespace shm {
namespace {

/// Of the mean of relative surprises.
std::uint32_t surprise_class(std::uint32_t mean) {
  return mean <= 12 ? mean : std::min(12 + (mean - 9) / 4, kSurpriseClasses - 1);
}

/// A surprise as it looks from a prediction of this scale.
std::uint32_t relative(ValueSurprise surprise, std::int32_t scale) {
  return surprise == 0
             ? 0u
             : static_cast<std::uint32_t>(std::clamp<std::int32_t>(surprise - scale, 1, 64));
}

/// Its bit length, near a guess; then sign and the bits behind the leading one, as they are.
template <class Coder>
std::int64_t code_residual(Coder& coder, NearModel& model, std::uint32_t guess,
                           std::int64_t residual) {
  const std::uint32_t length = code_near(coder, model, guess, bit_length(residual));
  if (length == 0) return 0;
  const auto bits = static_cast<std::uint64_t>(residual);
  const std::uint64_t low = (std::uint64_t{1} << (length - 1)) - 1;
  std::uint64_t size = residual < 0 ? 0 - bits : bits;
  // length bits: the sign stands where the leading one would
  std::uint64_t said = (size & low) | (residual < 0 ? low + 1 : 0);
  said = coder.raw(said, static_cast<int>(length));
  size = (said & low) | (low + 1);
  return static_cast<std::int64_t>((said & (low + 1)) != 0 ? 0 - size : size);
}

}  // namespace

template <class Coder>
ScalarColumn<Coder>::ScalarColumn(std::shared_ptr<const ArrayInfo> info, std::size_t component)
    : info_(std::move(info)),
      component_(component),
      domain_{is_float(info_->type)
                  ? (info_->quantization.bits > 0 ? DomainKind::quantized : DomainKind::floats)
                  : DomainKind::integers,
              0, false, true},
      translator_(*info_, component, domain_) {}

template <class Coder>
void ScalarColumn<Coder>::set_style(const ColumnStyle& style) {
  style_ = style;
}

template <class Coder>
void ScalarColumn<Coder>::make_room(std::uint32_t slot) {
  slots_.make_room(slot, has_twins_);
}

template <class Coder>
void ScalarColumn<Coder>::BySlot::make_room(std::uint32_t slot, bool has_twins) {
  if (slot < states.size()) return;
  shm::make_room(states, slot);
  const std::size_t last = states.size() - 1;
  shm::make_room(thirds, last);
  shm::make_room(surprises, last);
  shm::make_room(seconds, last);
  if (has_twins) shm::make_room(twins, last);
}

// --- encoder: trials

template <class Coder>
ScalarColumn<Coder>::Trial::Trial(ScalarColumn& column, std::span<const Neighbourhood> items,
                                  const ValueDomain& domain)
    : lender_(column), items_(items), lends_(column.domain_.has_states_of(domain)) {
  if (!lends_) {
    column_.emplace(lender_);
    return;
  }
  for (const Neighbourhood& item : items) lender_.make_room(item.self);
  BySlot slots = std::move(lender_.slots_);
  before_.reserve(items.size());
  for (const Neighbourhood& item : items) {
    const std::uint32_t s = item.self;
    before_.push_back({slots.states[s], slots.thirds[s], slots.surprises[s], slots.seconds[s],
                       lender_.has_twins_ ? slots.twins[s] : Twin()});
  }
  lender_.slots_ = {};
  column_.emplace(lender_);
  column_->slots_ = std::move(slots);
}

template <class Coder>
ScalarColumn<Coder>::Trial::~Trial() {
  if (!lends_) return;
  BySlot& slots = lender_.slots_ = std::move(column_->slots_);
  for (std::size_t i = 0; i < items_.size(); ++i) {
    const std::uint32_t s = items_[i].self;
    const Slot& was = before_[i];
    slots.states[s] = was.state;
    slots.thirds[s] = was.third;
    slots.surprises[s] = was.surprise;
    slots.seconds[s] = was.second;
    if (lender_.has_twins_) slots.twins[s] = was.twin;
  }
}

// --- domains

template <class Coder>
bool ScalarColumn<Coder>::begin_group(Coder& coder, const DomainPlan& plan,
                                      std::span<const ScalarColumn<Coder>> before,
                                      std::uint64_t most_entries) {
  ValueDomain domain = plan.domain;
  if (!coder.bit(same_domain_, domain == domain_)) {
    DomainModels& models = domain_models_.get();
    domain.kind = static_cast<DomainKind>(
        code_tree(coder, models.kind, static_cast<std::uint32_t>(domain.kind)));
    if (static_cast<std::uint32_t>(domain.kind) >= kDomainKinds) return false;
    domain.exponent =
        static_cast<std::int32_t>(code_signed(coder, models.exponent, domain.exponent));
    domain.negative_zero = coder.bit(models.negative_zero, domain.negative_zero);
    domain.odd = coder.bit(models.odd, domain.odd);
    if (!domain.fits(*info_)) return false;
    if (!change_domain(domain)) return false;
  }
  if (!coder.bit(table_flag_, !plan.table.empty())) {
    table_.clear();
    return true;
  }
  std::vector<std::int64_t> known;
  add_known_entries(table_, domain_.kind, known);
  for (const ScalarColumn& other : before)
    if (other.domain_.kind == domain_.kind && other.domain_.exponent == domain_.exponent)
      add_known_entries(other.table_, domain_.kind, known);
  table_ = plan.table;
  return code_rank_table(coder, table_models_.get(), domain_.kind, std::move(known), most_entries,
                         table_);
}

template <class Coder>
bool ScalarColumn<Coder>::change_domain(const ValueDomain& domain) {
  const ValueTranslator next(*info_, component_, domain);
  if (!domain.has_states_of(domain_)) {
    if (Coder::kDecodes && moved_ > elements_ * kMostMovesForEach) return false;
    moved_ += room_ > 0 ? room_ : slots_.states.size();
    const auto translate = [&](double state) {
      const double moved = next.from_value(translator_.as_value(state));
      return is_finite(moved) ? moved : 0.0;
    };
    for (double& state : slots_.states) state = translate(state);
    for (Twin& twin : slots_.twins) twin = {translate(twin.state), 0.0};
    twin_last_ = translate(twin_last_);
    twin_before_last_ = translate(twin_before_last_);
    last_ = translate(last_);
    before_last_ = translate(before_last_);
    std::fill(slots_.thirds.begin(), slots_.thirds.end(), 0.0);
  }
  domain_ = domain;
  translator_ = next;
  return true;
}

template <class Coder>
template <class Visit>
bool ScalarColumn<Coder>::with_space(Visit&& visit) {
  const auto ranked = [&](const auto& base) {
    if (table_.empty()) return visit(base);
    return visit(RankSpace<std::remove_cvref_t<decltype(base)>>{base, table_});
  };
  switch (domain_.kind) {
    case DomainKind::floats:
      if (info_->type == ScalarType::float32) return ranked(FloatSpace<float>());
      return ranked(FloatSpace<double>());
    case DomainKind::narrow: return ranked(FloatSpace<float>());
    case DomainKind::digits: return ranked(DecimalSpace{domain_.exponent});
    default: return ranked(LinearSpace());
  }
}

// --- classes

/// A class that is new begins as the last one of its family was said before this tile.
template <class Coder>
void ScalarColumn<Coder>::meet_classes(const TileClasses& classes) {
  std::uint32_t most = 0;
  for (std::uint32_t it : classes.of_item) most = std::max(most, it);
  for (std::size_t c = classes_.size(); c <= most; ++c) {
    const std::uint16_t family = classes.families[c];
    if (family >= said_last_.size()) said_last_.resize(std::size_t{family} + 1);
    const ClassModes modes =
        said_last_[family] == 0 ? ClassModes() : classes_[said_last_[family] - 1u].modes;
    classes_.emplace_back().modes = modes;
  }
}

/// At the first element of a class in a tile: its modes, and the weights.
template <class Coder>
void ScalarColumn<Coder>::code_class(Coder& coder, std::uint32_t of_class) {
  classes_[of_class].tile = tile_;
  ClassModes& it = classes_[of_class].modes;
  const ClassModes& wanted = Coder::kDecodes ? it : scratch_->wanted[of_class];
  if (has_twins_ && !coder.bit(same_way_, wanted.way == it.way))
    it.way = it.way == kAlone ? kDifference : kAlone;
  if (!coder.bit(same_mode_, wanted.mode == it.mode))
    it.mode = std::min<std::uint32_t>(code_tree(coder, mode_, wanted.mode), kModes - 1);
  if (!coder.bit(same_second_, wanted.second == it.second)) {
    it.second = code_tree(coder, second_, wanted.second);
    if (it.second >= kModes) it.second = kNoMode;
  }
  std::uint16_t& said_last = said_last_[tile_classes_.families[of_class]];
  const Weights& family = said_last == 0 ? it.weights : classes_[said_last - 1u].modes.weights;
  if ((it.mode == kFittedMode || it.second == kFittedMode) &&
      !coder.bit(same_weights_, wanted.weights == it.weights)) {
    if (coder.bit(family_weights_, wanted.weights == family)) {
      it.weights = family;
    } else {
      for (std::uint32_t i = 0; i < kWeights; ++i) {
        const std::int64_t weight = plus(
            it.weights[i], code_signed(coder, weight_.get(), wanted.weights[i] - it.weights[i]));
        it.weights[i] =
            static_cast<std::int32_t>(std::clamp<std::int64_t>(weight, -kMostWeight, kMostWeight));
      }
    }
  }
  said_last = static_cast<std::uint16_t>(of_class + 1);
}

// --- elements

template <class Coder>
void ScalarColumn<Coder>::skip(const Neighbourhood& item) {
  ++elements_;
  make_room(item.self);
  slots_.states[item.self] = last_;
  slots_.thirds[item.self] = 0.0;
  slots_.surprises[item.self] = 0;
  slots_.seconds[item.self] = 0;
  if (has_twins_) slots_.twins[item.self] = {twin_last_, 0.0};
}

template <class Coder>
void ScalarColumn<Coder>::note(std::span<const Neighbourhood> items,
                               std::span<const std::uint64_t> bits) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    const double value = translator_.from_value(scalar_as_double(info_->type, bits[i]));
    skip(items[i]);
    if (is_finite(value)) slots_.states[items[i].self] = value;
    before_last_ = last_;
    last_ = slots_.states[items[i].self];
    last_surprise_ = 0;
    if (!has_twins_) continue;
    slots_.twins[items[i].self] = {last_, 0.0};
    twin_before_last_ = twin_last_;
    twin_last_ = last_;
  }
}

// --- what values refer to

/// The state of a value in the domain at hand: any number, the same everywhere.
template <class Coder>
double ScalarColumn<Coder>::reference_state(std::uint64_t bits) const {
  const double state = translator_.from_value(scalar_as_double(info_->type, bits));
  return is_finite(state) ? state : twin_last_;
}

/// What is told from a feature in a difference. `then`: the twin of the element itself.
template <class Coder>
double ScalarColumn<Coder>::twin_feature(const Neighbourhood& item, std::uint32_t feature,
                                         double then) const {
  if (feature < kFThird) return slots_.twins[item.at[feature]].state;
  if (feature < kFLast) return slots_.twins[item.at[feature - kFThird]].third;
  if (feature >= kFMatch) return then;
  return feature == kFLast ? twin_last_ : twin_before_last_;
}

template <class Coder>
void ScalarColumn<Coder>::note_twin(const Neighbourhood& item, double state) {
  const auto at = [&](std::uint32_t feature) { return twin_feature(item, feature, state); };
  const double third = item.has_rule() ? state - Predictor(item.traits(), at).lattice() : 0.0;
  slots_.twins[item.self] = {state, third};
  twin_before_last_ = twin_last_;
  twin_last_ = state;
}

template <class Coder>
auto ScalarColumn<Coder>::context(const Neighbourhood& item, std::int32_t scale, bool second,
                                  std::size_t i) const -> Context {
  std::uint32_t sum = 0, count = 0;
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((item.known >> a & 1) != 0) {
      sum += relative(slots_.surprises[item.at[a]], scale);
      ++count;
    }
  const std::uint32_t mean = count == 0   ? relative(last_surprise_, scale)
                             : count == 1 ? sum
                             : count == 2 ? (sum + 1) / 2
                                          : (sum + 1) / 3;
  const std::uint32_t other = before_.empty() ? 0 : before_.back()->surprises[i] == 0 ? 1 : 2;
  return {(surprise_class(mean) * 3 + other) * 2 + (second ? 1 : 0), mean};
}

template <class Coder>
template <class At>
MatchTables::Places ScalarColumn<Coder>::match_places(const Neighbourhood& item, const At& at,
                                                      std::size_t i) const {
  std::array<MatchTables::Key, kMatchKinds> keys;
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((item.known >> a & 1) != 0) keys[0].add(at(a));
  keys[1].add(at(kFLast));
  keys[1].add(at(kFBeforeLast));
  for (std::size_t c = 0; c < before_.size() && c < 2; ++c)
    keys[2].add(before_[before_.size() - 1 - c]->values[i]);
  return {keys[0].place(), keys[1].place(), keys[2].place()};
}

template <class Coder>
void ScalarColumn<Coder>::ask_about(Mixed& mixed, const Neighbourhood& item, std::int32_t scale,
                                    std::size_t i, std::uint32_t of_class, std::int64_t expected,
                                    const std::array<std::int64_t, 3>& others, bool second) {
  std::array<std::uint32_t, 3> near{};
  for (std::uint32_t a = 0; a < 3; ++a)
    near[a] = (item.known >> a & 1) != 0 ? relative(slots_.surprises[item.at[a]], scale) + 1 : 0;
  const auto way = [&](std::int64_t other) {
    const std::int64_t by = minus(other, expected);
    return 2 * bit_length(by) + (by < 0 ? 1 : 0);
  };
  const std::uint32_t last = relative(last_surprise_, scale);
  const std::uint32_t before =
      before_.empty() ? 0 : relative(before_.back()->surprises[i], scale) + 1;
  const std::uint32_t first =
      before_.size() < 2 ? 0 : relative(before_[before_.size() - 2]->surprises[i], scale) + 1;
  const std::uint32_t sum = near[0] + near[1] + near[2];
  mixed.coder.about(0, clue(sum, before, second), clue(near[0], near[1], near[2]),
                    clue(of_class, last, second), clue(way(others[0]), way(others[1])),
                    clue(before, first, way(others[2])));
}

/// The state of a value that the space has no place for, or that is not finite: what the lattice
/// says.
template <class Coder>
template <class At>
double ScalarColumn<Coder>::odd_state(const auto& space, const Predictor<At>& predictor) const {
  const double state = space.state(space.index(predictor.lattice()));
  return is_finite(state) ? state : 0.0;
}

/// The index of a value in a space, nothing where it has none.
template <class Coder>
std::optional<std::int64_t> ScalarColumn<Coder>::index_of(const auto& space,
                                                          std::uint64_t bits) const {
  const auto index = translator_.index(bits);
  if constexpr (requires { space.table; }) {
    if (!index) return index;
    const auto found = std::lower_bound(space.table.begin(), space.table.end(), *index);
    if (found == space.table.end() || *found != *index) return std::nullopt;
    return found - space.table.begin();
  } else {
    return index;
  }
}

template <class Coder>
bool ScalarColumn<Coder>::code_tile(Coder& coder, std::span<const Neighbourhood> items,
                                    const TileClasses& classes, std::span<std::uint64_t> bits,
                                    std::span<const Trace* const> before,
                                    std::span<const std::uint64_t> reference) {
  ++tile_;
  elements_ += items.size();
  before_ = before;
  trace_.surprises.resize(items.size());
  if (style_.matches) {
    trace_.values.resize(items.size());
    matches_.expect(items.size());
  }
  tile_classes_ = classes;
  std::uint32_t most_slot = 0;
  for (const Neighbourhood& item : items) most_slot = std::max(most_slot, item.self);
  make_room(most_slot);
  meet_classes(classes);
  return with_space([&](const auto& space) {
    if constexpr (!Coder::kDecodes) {
      looked_ahead_ = watch_.begin_tile(classes.of_item, style_.hurries);
      scratch_->wanted.clear();
      for (const Class& it : classes_) scratch_->wanted.push_back(it.modes);
      if (looked_ahead_) {
        look_ahead(space, items, bits, reference);
        choose_modes(space, scratch_->samples, classes.families, style_.matches, scratch_->wanted);
      }
    }
    return code_items(coder, space, items, bits, reference);
  });
}

template <class Coder>
template <class Space>
bool ScalarColumn<Coder>::code_items(Coder& coder, const Space& space,
                                     std::span<const Neighbourhood> items,
                                     std::span<std::uint64_t> bits,
                                     std::span<const std::uint64_t> reference) {
  const std::uint32_t counts = style_.known();
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Neighbourhood& item = items[i];
    MatchTables::Places places{};
    const auto at = [&](std::uint32_t feature) {
      if constexpr (!Coder::kDecodes)
        if (looked_ahead_) return sample(i).state[feature];
      if (feature < kFThird) return slots_.states[item.at[feature]];
      if (feature < kFLast) return slots_.thirds[item.at[feature - kFThird]];
      if (feature >= kFOther) return other_value(i);
      if (feature >= kFMatch) return from_match(feature - kFMatch, places);
      return feature == kFLast ? last_ : before_last_;
    };
    if (style_.matches && (Coder::kDecodes || !looked_ahead_)) places = match_places(item, at, i);
    const std::uint32_t traits = item.traits(counts);
    const Predictor predictor(traits, at);
    const std::uint32_t of_class = tile_classes_.of_item[i];
    if (classes_[of_class].tile != tile_) code_class(coder, of_class);
    Class& its = classes_[of_class];
    const ClassModes& how = its.modes;
    double then = 0.0;  // the state of the reference
    if (has_twins_)
      then =
          !Coder::kDecodes && looked_ahead_ ? sample(i).reference : reference_state(reference[i]);
    const auto difference_at = [&](std::uint32_t feature) {
      if constexpr (!Coder::kDecodes)
        if (looked_ahead_) return scratch_->samples.differences[i][feature];
      return at(feature) - twin_feature(item, feature, then);
    };
    const auto predict = [&](std::uint32_t mode) {
      if (how.way == kAlone) return predictor.predict(mode, how.weights);
      return then + Predictor(traits, difference_at).predict(mode, how.weights);
    };
    double prediction = predict(how.mode);

    bool odd = false;
    std::int64_t actual = 0;
    if constexpr (!Coder::kDecodes) {
      const auto index = looked_ahead_ ? sample(i).index : index_of(space, bits[i]);
      odd = !index;
      actual = index.value_or(0);
    }
    if (domain_.odd) odd = last_odd_ = coder.bit(odd_[last_odd_], odd);
    ValueSurprise surprise = 0;
    double state = 0.0;
    if (odd) {
      if (has_twins_ && coder.bit(same_odd_, bits[i] == reference[i]))
        bits[i] = reference[i];
      else
        bits[i] = coder.raw(bits[i], static_cast<int>(8 * scalar_bytes(info_->type)));
      state = odd_state(space, predictor);
      slots_.seconds[item.self] = 0;
    } else {
      std::int64_t expected = space.index(prediction);
      bool second = false;
      if (how.second != kNoMode) {
        const double other = predict(how.second);
        const std::int64_t instead = space.index(other);
        if (instead != expected) {
          if constexpr (!Coder::kDecodes)
            second = bit_length(minus(actual, instead)) + 1 < bit_length(minus(actual, expected));
          std::uint32_t near = 0;
          for (std::uint32_t a = 0; a < 3; ++a)
            if ((item.known >> a & 1) != 0) near += slots_.seconds[item.at[a]];
          second = coder.bit(its.takes_second[near], second);
          if (second) {
            expected = instead;
            prediction = other;
          }
        }
      }
      slots_.seconds[item.self] = second ? 1 : 0;
      const std::int32_t scale = space.scale(prediction);
      const Context around = context(item, scale, second, i);
      std::int64_t residual = 0;
      if constexpr (!Coder::kDecodes) residual = minus(actual, expected);
      if (style_.mixes) {
        Mixed& mixed = mixed_.get();
        const std::array<std::int64_t, 3> others = {
            space.index(predict(kLattice)),
            space.index(predict(how.second == kNoMode ? kMeanNearMode
                                : second              ? how.mode
                                                      : how.second)),
            space.index(predict(kMeanLineMode))};
        mixed.coder.use(coder);
        ask_about(mixed, item, scale, i, of_class, expected, others, second);
        residual = code_signed(mixed.coder, mixed.residuals.of(around.number), residual);
      } else {
        residual = code_residual(coder, residuals_.of(around.number), around.mean, residual);
      }
      const std::int64_t index = plus(expected, residual);
      const std::uint32_t length = bit_length(residual);
      surprise =
          static_cast<ValueSurprise>(length == 0 ? 0 : static_cast<std::int32_t>(length) + scale);
      std::int64_t base_index = index;
      if constexpr (requires { space.table; }) {
        if (index < 0 || static_cast<std::uint64_t>(index) >= space.table.size()) return false;
        base_index = space.table[static_cast<std::size_t>(index)];
      }
      bool minus_zero = false;
      if (domain_.negative_zero && base_index == 0) {
        if constexpr (!Coder::kDecodes) minus_zero = bits[i] == negative_zero(info_->type);
        minus_zero = last_negative_ = coder.bit(negative_[last_negative_], minus_zero);
      }
      if constexpr (Coder::kDecodes) {
        bits[i] = minus_zero ? negative_zero(info_->type) : translator_.bits(base_index);
      } else {
        watch_.note(of_class, length);
      }
      state = space.state(index);
      if (!is_finite(state)) state = odd_state(space, predictor);
    }
    slots_.surprises[item.self] = surprise;
    trace_.surprises[i] = surprise;
    last_surprise_ = surprise;
    if (Coder::kDecodes || !looked_ahead_) {
      if (has_twins_) note_twin(item, then);
      settle(item, i, state, predictor.lattice(), places);
    }
  }
  return true;
}

/// The element has this state: known to those that come after it.
template <class Coder>
void ScalarColumn<Coder>::settle(const Neighbourhood& item, std::size_t i, double state,
                                 double lattice, const MatchTables::Places& places) {
  slots_.thirds[item.self] = item.has_rule() ? state - lattice : 0.0;
  slots_.states[item.self] = state;
  before_last_ = last_;
  last_ = state;
  if (!style_.matches) return;
  trace_.values[i] = translator_.as_value(state);
  matches_.remember(places, trace_.values[i]);
}

// --- encoder: looking ahead

/// States, indices and classes of all elements of the tile, and what surrounds each of them. The
/// states move on to the end of the tile.
template <class Coder>
template <class Space>
void ScalarColumn<Coder>::look_ahead(const Space& space, std::span<const Neighbourhood> items,
                                     std::span<const std::uint64_t> bits,
                                     std::span<const std::uint64_t> reference) {
  auto& [samples, differences] = scratch_->samples;
  samples.resize(items.size());
  if (has_twins_) differences.resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Neighbourhood& item = items[i];
    ModeSample& it = samples[i];
    it.known = item.traits(style_.known());
    it.of_class = tile_classes_.of_item[i];
    for (std::uint32_t f = 0; f < kFThird; ++f)
      if ((it.known >> f & 1) != 0) it.state[f] = slots_.states[item.at[f]];
    for (std::uint32_t a = 0; a < 3; ++a)
      if ((it.known >> (kFThird + a) & 1) != 0) it.state[kFThird + a] = slots_.thirds[item.at[a]];
    it.state[kFLast] = last_;
    it.state[kFBeforeLast] = before_last_;
    const auto at = [&](std::uint32_t feature) { return it.state[feature]; };
    MatchTables::Places places{};
    if (style_.matches) {
      places = match_places(item, at, i);
      for (std::uint32_t m = 0; m < kMatchKinds; ++m) it.state[kFMatch + m] = from_match(m, places);
      it.state[kFOther] = other_value(i);
    }
    const Predictor predictor(it.known, at);
    it.index = index_of(space, bits[i]);
    double state = it.index ? space.state(*it.index) : 0.0;
    if (!it.index || !is_finite(state)) state = odd_state(space, predictor);
    if (has_twins_) {
      it.reference = reference_state(reference[i]);
      for (std::uint32_t f = 0; f < kFeatures; ++f)
        if (f >= kFLast || (it.known >> f & 1) != 0)
          differences[i][f] = it.state[f] - twin_feature(item, f, it.reference);
      note_twin(item, it.reference);
    }
    settle(item, i, state, predictor.lattice(), places);
  }
}

template class ScalarColumn<SplitEncoder>;
template class ScalarColumn<SplitDecoder>;

}  // namespace shm
