#include "values/scalar_column.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "values/fitting.h"

namespace shm {
namespace {

/// Entries that a table of ranks may have.
constexpr std::uint64_t kMostEntries = std::uint64_t{1} << 20;
constexpr std::size_t kClassKeys = (std::size_t{1} << 16) + 64;
constexpr std::int32_t kMostWeight = 16 * 4096 - 1;

// Encoder: elements of a class that are looked at before its predictor is chosen, in each tile.
constexpr std::size_t kLookAt = 256, kFitAt = 512, kFewestToFit = 40;
// About what it costs to say another mode, and weights, in bits.
constexpr double kModeBits = 5.0, kWeightsBits = 120.0;

std::uint32_t surprise_class(std::uint32_t mean) {
  return mean <= 12 ? mean : std::min(12 + (mean - 9) / 4, 26u);
}

std::uint32_t bit_length(std::int64_t residual) {
  const auto bits = static_cast<std::uint64_t>(residual);
  return static_cast<std::uint32_t>(std::bit_width(residual < 0 ? 0 - bits : bits));
}

/// About the bits that it takes to say a residual.
double cost_of(std::int64_t residual) {
  const std::uint32_t length = bit_length(residual);
  return length == 0 ? 0.3 : 1.7 + static_cast<double>(length);
}

bool is_finite(double v) { return std::fabs(v) <= std::numeric_limits<double>::max(); }

std::int64_t minus(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}
std::int64_t plus(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

/// Whether a mode says anything else than the lattice for neighbourhoods with these bits.
bool is_sayable(std::uint32_t mode, std::uint32_t known) {
  const auto has = [&](std::uint32_t bits) { return (known & bits) == bits; };
  const auto any = [&](std::uint32_t bits) { return (known & bits) != 0; };
  if (mode == kLattice || mode == kLastMode || mode == kLastLineMode) return true;
  if (mode < kLineMode) return has(1u << (mode - kNearMode));
  if (mode < kCurveMode) return has(Neighbourhood::kBeyond << (mode - kLineMode));
  if (mode < kFaceMode) return has(Neighbourhood::kFarther << (mode - kCurveMode));
  if (mode < kThirdMode) return has(Neighbourhood::kDiagonal << (mode - kFaceMode));
  if (mode < kMeanThirdMode) return has(Neighbourhood::kThird << (mode - kThirdMode));
  switch (mode) {
    case kMeanThirdMode: return any(7 * Neighbourhood::kThird);
    case kMeanNearMode: return any(7 * Neighbourhood::kNear);
    case kMeanLineMode: return any(7 * Neighbourhood::kBeyond);
    case kMeanFaceMode: return any(7 * Neighbourhood::kDiagonal);
    default: return any(7 * Neighbourhood::kNear);
  }
}

std::uint32_t key_of(const Neighbourhood& item) {
  if (item.kind == Neighbourhood::lattice)
    return (item.known & 0x3ffu) | (item.known >> 13 & 7u) << 10 | std::uint32_t{item.corner} << 13;
  return (1u << 16) | std::uint32_t{item.kind} << 3 | (item.known & 7u);
}

}  // namespace

template <class Coder>
ScalarColumn<Coder>::ScalarColumn(const ArrayInfo& info, std::size_t component)
    : info_(info),
      component_(component),
      domain_{is_float(info.type)
                  ? (info.quantization.bits > 0 ? DomainKind::quantized : DomainKind::floats)
                  : DomainKind::integers,
              0, false, true},
      translator_(info, component, domain_),
      class_numbers_(kClassKeys) {}

template <class Coder>
void ScalarColumn<Coder>::make_room(std::uint32_t slot) {
  if (slot < states_.size()) return;
  const std::size_t size = std::max<std::size_t>(std::size_t{slot} + 1, states_.size() * 2);
  states_.resize(size);
  thirds_.resize(size);
  surprises_.resize(size);
  if (has_twins_) twins_.resize(size);
}

// --- domains

template <class Coder>
bool ScalarColumn<Coder>::begin_group(Coder& coder, const DomainPlan& plan) {
  ValueDomain domain = plan.domain;
  if (!coder.bit(same_domain_, domain == domain_)) {
    domain.kind =
        static_cast<DomainKind>(code_tree(coder, kind_, static_cast<std::uint32_t>(domain.kind)));
    if (static_cast<std::uint32_t>(domain.kind) >= kDomainKinds) return false;
    domain.exponent = static_cast<std::int32_t>(code_signed(coder, exponent_, domain.exponent));
    domain.negative_zero = coder.bit(negative_zero_flag_, domain.negative_zero);
    domain.odd = coder.bit(odd_flag_, domain.odd);
    if (!domain.fits(info_)) return false;
    change_domain(domain);
  }
  table_.clear();
  if (!coder.bit(table_flag_, !plan.table.empty())) return true;
  return code_table(coder, plan.table);
}

template <class Coder>
void ScalarColumn<Coder>::change_domain(const ValueDomain& domain) {
  const ValueTranslator next(info_, component_, domain);
  if (domain.kind != domain_.kind || domain.exponent != domain_.exponent) {
    const auto translate = [&](double state) {
      const double moved = next.from_value(translator_.as_value(state));
      return is_finite(moved) ? moved : 0.0;
    };
    for (double& state : states_) state = translate(state);
    for (Twin& twin : twins_) twin = {translate(twin.state), 0.0};
    twin_last_ = translate(twin_last_);
    twin_before_last_ = translate(twin_before_last_);
    last_ = translate(last_);
    before_last_ = translate(before_last_);
    std::fill(thirds_.begin(), thirds_.end(), 0.0);
  }
  domain_ = domain;
  translator_ = next;
}

template <class Coder>
bool ScalarColumn<Coder>::code_table(Coder& coder, const std::vector<std::int64_t>& table) {
  const std::uint64_t count = code_number(coder, entries_, table.size() - 1) + 1;
  if (count > kMostEntries) return false;
  std::int64_t entry = 0;
  std::uint64_t step = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    if (i == 0) {
      entry = code_signed(coder, first_entry_, table.empty() ? 0 : table[0]);
    } else {
      std::uint64_t wanted = 0;
      if constexpr (!Coder::kDecodes)
        wanted =
            static_cast<std::uint64_t>(table[i]) - static_cast<std::uint64_t>(table[i - 1]) - 1;
      if (!coder.bit(same_step_, wanted == step)) step = code_number(coder, step_, wanted);
      const std::int64_t next = plus(entry, static_cast<std::int64_t>(step + 1));
      if (next <= entry) return false;
      entry = next;
    }
    table_.push_back(entry);
  }
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
      if (info_.type == ScalarType::float32) return ranked(FloatSpace<float>());
      return ranked(FloatSpace<double>());
    case DomainKind::narrow: return ranked(FloatSpace<float>());
    case DomainKind::digits: return ranked(DecimalSpace{domain_.exponent});
    default: return ranked(LinearSpace());
  }
}

// --- classes

template <class Coder>
std::uint32_t ScalarColumn<Coder>::class_of(const Neighbourhood& item) {
  std::uint16_t& number = class_numbers_[key_of(item)];
  if (number == 0) {
    classes_.emplace_back();
    number = static_cast<std::uint16_t>(std::min<std::size_t>(classes_.size(), 65535));
  }
  return number - 1u;
}

/// At the first element of a class in a tile: its mode, and the weights.
template <class Coder>
void ScalarColumn<Coder>::code_class(Coder& coder, std::uint32_t of_class) {
  Class& it = classes_[of_class];
  it.tile = tile_;
  const Class* wanted = Coder::kDecodes ? &it : &wanted_[of_class];
  if (!coder.bit(same_mode_, wanted->mode == it.mode && wanted->way == it.way)) {
    if (has_twins_)
      it.way = std::min<std::uint32_t>(code_tree(coder, way_, wanted->way), kWays - 1);
    if (it.way != kCopy)
      it.mode = std::min<std::uint32_t>(code_tree(coder, mode_, wanted->mode), kModes - 1);
  }
  if (it.way == kCopy || it.mode != kFittedMode) return;
  if (coder.bit(same_weights_, wanted->weights == it.weights)) return;
  for (std::uint32_t i = 0; i < kWeights; ++i) {
    const std::int64_t weight =
        it.weights[i] + code_signed(coder, weight_, wanted->weights[i] - it.weights[i]);
    it.weights[i] =
        static_cast<std::int32_t>(std::clamp<std::int64_t>(weight, -kMostWeight, kMostWeight));
  }
}

// --- elements

template <class Coder>
void ScalarColumn<Coder>::skip(const Neighbourhood& item) {
  make_room(item.self);
  states_[item.self] = last_;
  thirds_[item.self] = 0.0;
  surprises_[item.self] = 0;
  if (has_twins_) twins_[item.self] = {twin_last_, 0.0};
}

// --- the reference step

/// The state of a value in the domain at hand: any number, the same everywhere.
template <class Coder>
double ScalarColumn<Coder>::reference_state(std::uint64_t bits) const {
  const double state = translator_.from_value(scalar_as_double(info_.type, bits));
  return is_finite(state) ? state : twin_last_;
}

template <class Coder>
double ScalarColumn<Coder>::twin_feature(const Neighbourhood& item, std::uint32_t feature) const {
  if (feature < kFThird) return twins_[item.at[feature]].state;
  if (feature < kFLast) return twins_[item.at[feature - kFThird]].third;
  return feature == kFLast ? twin_last_ : twin_before_last_;
}

template <class Coder>
void ScalarColumn<Coder>::note_twin(const Neighbourhood& item, double state) {
  const auto at = [&](std::uint32_t feature) { return twin_feature(item, feature); };
  const double third =
      item.knows(Neighbourhood::kLattice) ? state - Predictor(item.known, at).lattice() : 0.0;
  twins_[item.self] = {state, third};
  twin_before_last_ = twin_last_;
  twin_last_ = state;
}

template <class Coder>
auto ScalarColumn<Coder>::residual_model(std::uint32_t context) -> Residual& {
  if (context >= residual_numbers_.size()) residual_numbers_.resize(context + 1);
  std::uint16_t& number = residual_numbers_[context];
  if (number == 0) {
    residuals_.emplace_back();
    number = static_cast<std::uint16_t>(residuals_.size());
  }
  return residuals_[number - 1u];
}

template <class Coder>
std::uint32_t ScalarColumn<Coder>::context(const Neighbourhood& item, std::int32_t scale,
                                           std::span<const ValueSurprise> before) const {
  const auto relative = [&](ValueSurprise surprise) {
    return surprise == 0
               ? 0u
               : static_cast<std::uint32_t>(std::clamp<std::int32_t>(surprise - scale, 1, 64));
  };
  std::uint32_t sum = 0, count = 0;
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((item.known >> a & 1) != 0) {
      sum += relative(surprises_[item.at[a]]);
      ++count;
    }
  const std::uint32_t mean = count == 0 ? relative(last_surprise_) : (sum + count / 2) / count;
  const std::uint32_t other = before.empty() || item.self >= before.size() ? 0
                              : before[item.self] == 0                     ? 1
                                                                           : 2;
  return surprise_class(mean) * 3 + other;
}

/// The state of a value that the space has no place for, or that is not finite: what the lattice
/// says.
template <class Coder>
template <class At>
double ScalarColumn<Coder>::odd_state(const auto& space, const Predictor<At>& predictor) const {
  const double state = space.state(space.index(predictor.lattice()));
  return is_finite(state) ? state : 0.0;
}

template <class Coder>
bool ScalarColumn<Coder>::code_tile(Coder& coder, std::span<const Neighbourhood> items,
                                    std::span<std::uint64_t> bits,
                                    std::span<const ValueSurprise> before,
                                    std::span<const std::uint64_t> reference) {
  ++tile_;
  for (const Neighbourhood& item : items) make_room(item.self);
  return with_space([&](const auto& space) {
    if constexpr (!Coder::kDecodes) {
      look_ahead(space, items, bits, reference);
      choose_modes(space);
    }
    return code_items(coder, space, items, bits, before, reference);
  });
}

template <class Coder>
template <class Space>
bool ScalarColumn<Coder>::code_items(Coder& coder, const Space& space,
                                     std::span<const Neighbourhood> items,
                                     std::span<std::uint64_t> bits,
                                     std::span<const ValueSurprise> before,
                                     std::span<const std::uint64_t> reference) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Neighbourhood& item = items[i];
    const auto at = [&](std::uint32_t feature) {
      if constexpr (!Coder::kDecodes) return samples_[i].state[feature];
      if (feature < kFThird) return states_[item.at[feature]];
      if (feature < kFLast) return thirds_[item.at[feature - kFThird]];
      return feature == kFLast ? last_ : before_last_;
    };
    const Predictor predictor(item.known, at);
    const std::uint32_t of_class = class_of(item);
    if (classes_[of_class].tile != tile_) code_class(coder, of_class);
    const Class& how = classes_[of_class];
    double then = 0.0;  // the state at the reference step
    if (has_twins_) {
      if constexpr (Coder::kDecodes)
        then = reference_state(reference[i]);
      else
        then = samples_[i].reference;
    }
    const auto difference = [&](std::uint32_t feature) {
      if constexpr (!Coder::kDecodes) return samples_[i].difference[feature];
      return at(feature) - twin_feature(item, feature);
    };
    const double prediction =
        how.way == kAlone ? predictor.predict(how.mode, how.weights)
        : how.way == kCopy
            ? then
            : then + Predictor(item.known, difference).predict(how.mode, how.weights);

    bool odd = false;
    if constexpr (!Coder::kDecodes) odd = samples_[i].odd;
    if (domain_.odd) odd = last_odd_ = coder.bit(odd_[last_odd_], odd);
    ValueSurprise surprise = 0;
    double state = 0.0;
    if (odd) {
      if (has_twins_ && coder.bit(same_odd_, bits[i] == reference[i]))
        bits[i] = reference[i];
      else
        bits[i] = coder.raw(bits[i], static_cast<int>(8 * scalar_bytes(info_.type)));
      state = odd_state(space, predictor);
    } else {
      const std::int64_t expected = space.index(prediction);
      const std::int32_t scale = space.scale(prediction);
      std::int64_t residual = 0;
      if constexpr (!Coder::kDecodes) residual = minus(samples_[i].index, expected);
      residual = code_signed(coder, residual_model(context(item, scale, before)), residual);
      const std::int64_t index = plus(expected, residual);
      const std::uint32_t length = bit_length(residual);
      surprise =
          static_cast<ValueSurprise>(length == 0 ? 0 : static_cast<std::int32_t>(length) + scale);
      std::int64_t base_index = index;
      if constexpr (requires { space.table; }) {
        if (index < 0 || static_cast<std::uint64_t>(index) >= space.table.size()) return false;
        base_index = space.table[static_cast<std::size_t>(index)];
      }
      bool negative = false;
      if (domain_.negative_zero && base_index == 0) {
        if constexpr (!Coder::kDecodes) negative = bits[i] == negative_zero(info_.type);
        negative = last_negative_ = coder.bit(negative_[last_negative_], negative);
      }
      if constexpr (Coder::kDecodes)
        bits[i] = negative ? negative_zero(info_.type) : translator_.bits(base_index);
      state = space.state(index);
      if (!is_finite(state)) state = odd_state(space, predictor);
    }
    surprises_[item.self] = surprise;
    last_surprise_ = surprise;
    if constexpr (Coder::kDecodes) {
      thirds_[item.self] = item.knows(Neighbourhood::kLattice) ? state - predictor.lattice() : 0.0;
      states_[item.self] = state;
      before_last_ = last_;
      last_ = state;
      if (has_twins_) note_twin(item, then);
    }
  }
  return true;
}

// --- encoder: looking ahead

/// States, indices and classes of all elements of the tile, and what surrounds each of them. The
/// states move on to the end of the tile.
template <class Coder>
template <class Space>
void ScalarColumn<Coder>::look_ahead(const Space& space, std::span<const Neighbourhood> items,
                                     std::span<const std::uint64_t> bits,
                                     std::span<const std::uint64_t> reference) {
  samples_.resize(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Neighbourhood& item = items[i];
    Sample& it = samples_[i];
    for (std::uint32_t f = 0; f < kFThird; ++f)
      if ((item.known >> f & 1) != 0) it.state[f] = states_[item.at[f]];
    for (std::uint32_t a = 0; a < 3; ++a)
      if ((item.known >> (kFThird + a) & 1) != 0) it.state[kFThird + a] = thirds_[item.at[a]];
    it.state[kFLast] = last_;
    it.state[kFBeforeLast] = before_last_;
    it.known = item.known;
    it.of_class = class_of(item);
    const auto at = [&](std::uint32_t feature) { return it.state[feature]; };
    const Predictor predictor(item.known, at);

    auto index = translator_.index(bits[i]);
    if constexpr (requires { space.table; }) {
      if (index) {
        const auto found = std::lower_bound(space.table.begin(), space.table.end(), *index);
        if (found == space.table.end() || *found != *index)
          index.reset();
        else
          index = found - space.table.begin();
      }
    }
    it.odd = !index;
    it.index = index.value_or(0);
    double state = index ? space.state(*index) : 0.0;
    if (!index || !is_finite(state)) state = odd_state(space, predictor);
    thirds_[item.self] = item.knows(Neighbourhood::kLattice) ? state - predictor.lattice() : 0.0;
    states_[item.self] = state;
    if (has_twins_) {
      for (std::uint32_t f = 0; f < kFeatures; ++f)
        if (f >= kFLast || (item.known >> f & 1) != 0)
          it.difference[f] = it.state[f] - twin_feature(item, f);
      it.reference = reference_state(reference[i]);
      note_twin(item, it.reference);
    }
    before_last_ = last_;
    last_ = state;
  }
}

/// Says in wanted_ with which mode each class of the tile is best predicted.
template <class Coder>
template <class Space>
void ScalarColumn<Coder>::choose_modes(const Space& space) {
  wanted_ = classes_;
  std::vector<std::uint32_t> count(classes_.size());
  for (const Sample& it : samples_) ++count[it.of_class];
  std::vector<std::size_t> begin(classes_.size() + 1);
  for (std::size_t c = 0; c < count.size(); ++c) begin[c + 1] = begin[c] + count[c];
  std::vector<std::uint32_t> order(samples_.size());
  {
    auto next = begin;
    for (std::size_t i = 0; i < samples_.size(); ++i)
      order[next[samples_[i].of_class]++] = static_cast<std::uint32_t>(i);
  }
  std::vector<FitSample> fit;
  for (std::uint32_t c = 0; c < count.size(); ++c) {
    if (count[c] == 0) continue;
    const auto pick = [&](std::size_t i, std::size_t picked) -> const Sample& {
      return samples_[order[begin[c] + i * count[c] / picked]];
    };
    Class& it = wanted_[c];
    const std::uint32_t known = samples_[order[begin[c]]].known;
    const std::size_t looked = std::min<std::size_t>(count[c], kLookAt);
    const double scale = static_cast<double>(count[c]) / static_cast<double>(looked);
    const auto cost = [&](std::uint32_t way, std::uint32_t mode, const Weights& weights) {
      double sum = 0.0;
      for (std::size_t i = 0; i < looked; ++i) {
        const Sample& sample = pick(i, looked);
        if (sample.odd) continue;
        double prediction = way == kAlone ? 0.0 : sample.reference;
        const auto& features = sample.features(way);
        const auto at = [&](std::uint32_t feature) { return features[feature]; };
        if (way != kCopy) prediction += Predictor(sample.known, at).predict(mode, weights);
        sum += cost_of(minus(sample.index, space.index(prediction)));
      }
      return sum * scale;
    };

    Class best = it;
    double least = cost(it.way, it.mode, it.weights);
    const auto offer = [&](std::uint32_t way, std::uint32_t mode, const Weights& weights,
                           double extra) {
      const double its =
          cost(way, mode, weights) + extra + (way == it.way && mode == it.mode ? 0.0 : kModeBits);
      if (its >= least) return;
      least = its;
      best.way = way;
      best.mode = mode;
      best.weights = weights;
    };
    for (std::uint32_t way = 0; way < (has_twins_ ? kWays : 1u); ++way) {
      if (way == kCopy) {
        if (it.way != kCopy) offer(way, it.mode, it.weights, 0.0);
        continue;
      }
      for (std::uint32_t mode = 0; mode < kFittedMode; ++mode)
        if ((way != it.way || mode != it.mode) && is_sayable(mode, known))
          offer(way, mode, it.weights, 0.0);
      if (count[c] < kFewestToFit || !is_sayable(kFittedMode, known)) continue;
      const std::size_t fitted = std::min<std::size_t>(count[c], kFitAt);
      fit.clear();
      for (std::size_t i = 0; i < fitted; ++i) {
        const Sample& sample = pick(i, fitted);
        const auto& features = sample.features(way);
        const auto at = [&](std::uint32_t feature) { return features[feature]; };
        const Predictor predictor(sample.known, at);
        const double base = predictor.lattice();
        const double target =
            space.state(sample.index) - (way == kAlone ? 0.0 : sample.reference) - base;
        if (!sample.odd && is_finite(target)) fit.push_back({predictor.terms(base), target});
      }
      offer(way, kFittedMode, fit_weights(fit), kWeightsBits);
    }
    it = best;
  }
}

template class ScalarColumn<RangeEncoder>;
template class ScalarColumn<RangeDecoder>;

}  // namespace shm
