#include "values/mode_choice.h"

#include <algorithm>
#include <array>

#include "values/fitting.h"
#include "values/value_domain.h"

namespace shm {
namespace {

// Elements of a class that are looked at before its modes are chosen, in each tile.
constexpr std::size_t kLookAt = 256, kFitAt = 256, kFewestToFit = 40;
// Before that: by all modes, and how many of these go on.
constexpr std::size_t kFirstLooks = 32, kKeptAlone = 3, kKeptBeside = 2;
// Tiles for which the modes of a large class are kept.
constexpr std::uint32_t kMostTilesKept = 8;
// About what it costs to code another mode, and weights, in bits.
constexpr double kModeBits = 5.0, kWeightsBits = 250.0;

constexpr std::uint32_t kCostParts = 10;

/// About the bits of a residual, in parts of one.
std::uint32_t cost_of(std::int64_t residual) {
  const std::uint32_t length = bit_length(residual);
  return length == 0 ? 3 : 17 + length * kCostParts;
}

/// A feature of an element.
struct FeatureAt {
  const std::array<double, kFeatures>* of = nullptr;
  double operator()(std::uint32_t feature) const { return (*of)[feature]; }
};

/// Whether a mode may predict anything else than the lattice where these bits are known.
bool differs_from_lattice(std::uint32_t mode, std::uint32_t known) {
  const auto has = [&](std::uint32_t bits) { return (known & bits) == bits; };
  const auto any = [&](std::uint32_t bits) { return (known & bits) != 0; };
  const std::uint32_t kind = known >> Neighbourhood::kKindShift;
  if ((kind == Neighbourhood::midpoint || kind == Neighbourhood::centre) && mode == kMeanFaceMode)
    return has(7 * Neighbourhood::kThird);
  if (mode == kLattice || mode == kLastMode || mode == kLastLineMode ||
      (mode >= kMatchMode && mode < kFittedMode))
    return true;
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

/// Samples sorted into sets, one set behind the other.
struct Members {
  /// `set_of`: the set of a sample.
  template <class SetOf>
  Members(const ModeSamples& all, std::size_t sets, SetOf&& set_of) : begin(sets + 1) {
    for (const ModeSample& it : all.samples)
      if (!it.copied) ++begin[set_of(it) + 1];
    for (std::size_t s = 0; s < sets; ++s) begin[s + 1] += begin[s];
    order.resize(begin[sets]);
    auto next = begin;
    for (std::size_t i = 0; i < all.samples.size(); ++i)
      if (!all.samples[i].copied)
        order[next[set_of(all.samples[i])]++] = static_cast<std::uint32_t>(i);
  }
  std::span<const std::uint32_t> of(std::size_t s) const {
    return std::span(order).subspan(begin[s], begin[s + 1] - begin[s]);
  }
  std::vector<std::size_t> begin;  // by set
  std::vector<std::uint32_t> order;
};

/// Visits so many members, spread over all: visit(sample, predictor, what is added to predictions)
/// for those that have an index.
template <class Visit>
void for_each_picked(const ModeSamples& all, std::span<const std::uint32_t> members,
                     std::size_t count, std::uint32_t input, Visit&& visit) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t picked =
        members[static_cast<std::size_t>(std::uint64_t{i} * members.size() / count)];
    const ModeSample& sample = all.samples[picked];
    if (!sample.index) continue;
    const auto& features = input == kDifferences ? all.differences[picked] : sample.state;
    const auto at = [&](std::uint32_t feature) { return features[feature]; };
    visit(sample, Predictor(sample.known, at), input == kDifferences ? sample.reference : 0.0);
  }
}

/// Weights for the fitted mode.
template <class Space>
Weights fit_members(const Space& space, const ModeSamples& all,
                    std::span<const std::uint32_t> members, std::uint32_t input) {
  std::vector<FitSample> samples;
  for_each_picked(all, members, std::min(members.size(), kFitAt), input,
                  [&](const auto& sample, const auto& predictor, double added) {
                    const double base = predictor.lattice();
                    const double target = space.state(*sample.index) - base - added;
                    if (is_finite(target)) samples.push_back({predictor.terms(base), target});
                  });
  return fit_weights(samples);
}

/// Weights that fit a family: for new classes that are too small to be fitted. They share the
/// bits of the weights.
template <class Space>
class FamilyFits {
 public:
  FamilyFits(const Space& space, const ModeSamples& all, std::span<const std::uint16_t> families,
             const Members& classes, std::span<const ClassModes> modes)
      : space_(&space),
        all_(&all),
        families_(families),
        count_(families.empty() ? 0u : *std::max_element(families.begin(), families.end()) + 1u),
        members_(all, count_, [&](const ModeSample& it) { return families[it.of_class]; }),
        sharing_(count_),
        weights_{std::vector<std::optional<Weights>>(count_),
                 std::vector<std::optional<Weights>>(count_)} {
    for (std::size_t c = 0; c < modes.size(); ++c)
      if (shares(classes.of(c).size(), modes[c])) sharing_[families[c]] += classes.of(c).size();
  }

  /// Whether the class is one of those that share, and they are enough.
  bool has(std::uint32_t of_class, std::size_t size, const ClassModes& start) const {
    return shares(size, start) && sharing_[families_[of_class]] >= kFewestToFit;
  }
  /// What coding them costs the class. Must hold: has().
  double bits(std::uint32_t of_class, std::size_t size) const {
    return kWeightsBits * static_cast<double>(size) /
           static_cast<double>(sharing_[families_[of_class]]);
  }
  /// Must hold: has().
  const Weights& weights(std::uint32_t of_class, std::uint32_t input) {
    const std::uint16_t family = families_[of_class];
    std::optional<Weights>& its = weights_[input][family];
    if (!its) its = fit_members(*space_, *all_, members_.of(family), input);
    return *its;
  }

 private:
  static bool shares(std::size_t size, const ClassModes& start) {
    return size < kFewestToFit && start.weights == Weights{};
  }

  const Space* space_;
  const ModeSamples* all_;
  std::span<const std::uint16_t> families_;  // by class
  std::size_t count_;
  Members members_;
  std::vector<std::size_t> sharing_;                            // members, by family
  std::array<std::vector<std::optional<Weights>>, 2> weights_;  // by input, by family
};

/// Searches the modes of one class, for one input: all of them at a few of its elements, and at
/// more of these the ones that came out well, alone or beside the first.
template <class Space>
class Search {
 public:
  /// `members`: of the class, not empty. `start`: how it is predicted now.
  Search(const Space& space, const ModeSamples& all, std::span<const std::uint32_t> members,
         std::uint32_t of_class, const ClassModes& start, std::uint32_t input, bool matches,
         FamilyFits<Space>& families)
      : space_(&space),
        all_(&all),
        members_(members),
        of_class_(of_class),
        start_(&start),
        matches_(matches),
        families_(&families) {
    chosen_.input = input;
    chosen_.weights = start.weights;
    pick();
  }

  void run() {
    for (std::uint32_t mode = 0; mode < kModes; ++mode) {
      tried_[mode] = mode != kFittedMode && is_worth_trying(mode);
      if (tried_[mode]) look_on(mode);
    }
    choose_first();
    if (is_worth_trying(kFittedMode)) fit();
    choose_first();
    if (looked_ < picked_) {
      keep_the_best();
      looked_ = picked_;
      for (std::uint32_t mode = 0; mode < kModes; ++mode)
        if (tried_[mode]) look_on(mode);
      choose_first();
    }
    choose_second();
  }
  const ClassModes& chosen() const { return chosen_; }
  /// About the bits of the class when it is predicted so.
  double bits() const { return bits_; }

 private:
  /// An element that is looked at.
  struct Pick {
    const ModeSample* sample = nullptr;
    FeatureAt at;
    double lattice = 0.0, added = 0.0;  // added: to predictions
  };

  /// Those with an index of some that are spread over all; so are the first of them.
  void pick() {
    const std::size_t most = std::min(members_.size(), kLookAt);
    const std::size_t apart = most > kFirstLooks ? kLookAt / kFirstLooks : 1;
    for (std::size_t begin = 0; begin < apart; ++begin)
      for (std::size_t i = begin; i < most; i += apart) {
        const std::uint32_t its =
            members_[static_cast<std::size_t>(std::uint64_t{i} * members_.size() / most)];
        const ModeSample& sample = all_->samples[its];
        if (!sample.index) continue;
        const bool differs = chosen_.input == kDifferences;
        const FeatureAt at{differs ? &all_->differences[its] : &sample.state};
        picks_[picked_++] = {&sample, at, Predictor(sample.known, at).lattice(),
                             differs ? sample.reference : 0.0};
      }
    looked_ = std::min(picked_, kFirstLooks);
  }
  bool is_fittable() const { return members_.size() >= kFewestToFit; }
  bool has_family() const { return families_->has(of_class_, members_.size(), *start_); }
  bool is_worth_trying(std::uint32_t mode) const {
    if (mode == kStayMode) return chosen_.input == kDifferences;
    if (mode == kFittedMode && !is_fittable() && !has_family() && start_->weights == Weights{})
      return false;
    if (mode == kPartnerMode)
      return std::any_of(members_.begin(), members_.end(),
                         [&](std::uint32_t m) { return all_->samples[m].has_partner; });
    if (!matches_ && mode >= kMatchMode && mode != kFittedMode) return false;
    return differs_from_lattice(mode, all_->samples[members_[0]].known);
  }
  /// Looks what a mode misses at the elements that are to be looked at and have not been by it.
  void look_on(std::uint32_t mode) {
    Looks& its = looks_[mode];
    for (; its.count < looked_; ++its.count) {
      const Pick& pick = picks_[its.count];
      const bool can = mode != kPartnerMode || pick.sample->has_partner;
      const double prediction = Predictor(pick.sample->known, pick.at, pick.lattice)
                                    .predict(can ? mode : kLattice, chosen_.weights) +
                                pick.added;
      const std::uint32_t cost = cost_of(minus(*pick.sample->index, space_->index(prediction)));
      its.missed[its.count] = static_cast<std::uint16_t>(cost);
      its.sum += cost;
    }
  }
  /// Bits of the class in a mode, without what choosing it costs.
  double bits_in(std::uint32_t mode) const { return bits_of(looks_[mode].sum); }
  double bits_of(std::uint64_t looked) const {
    return looked_ == 0 ? 0.0
                        : static_cast<double>(looked) / kCostParts *
                              static_cast<double>(members_.size()) / static_cast<double>(looked_);
  }

  /// The fitted mode, with the weights as they are or with those of the class or its family; unless
  /// what is found already is so good that weights cannot pay.
  void fit() {
    double least = 1e300;
    Weights best = chosen_.weights;
    const auto rate = [&](const Weights& weights, double bits) {
      looks_[kFittedMode].count = 0;
      looks_[kFittedMode].sum = 0;
      chosen_.weights = weights;
      look_on(kFittedMode);
      const double cost = bits_in(kFittedMode) + bits;
      if (cost >= least) return;
      least = cost;
      to_code_ = bits;
      best = weights;
    };
    if (!(start_->weights == Weights{})) rate(start_->weights, 0.0);
    const double bits = bits_in(chosen_.mode);
    if (has_family())
      if (const double its = families_->bits(of_class_, members_.size()); its < bits)
        rate(families_->weights(of_class_, chosen_.input), its);
    if (is_fittable() && bits > kWeightsBits)
      rate(fit_members(*space_, *all_, members_, chosen_.input), kWeightsBits);
    tried_[kFittedMode] = least < 1e300;
    if (tried_[kFittedMode]) rate(best, to_code_);
    chosen_.weights = best;
  }
  void choose_first() {
    const auto with_change = [&](std::uint32_t mode) {
      return bits_in(mode) + (mode == kFittedMode ? to_code_ : 0.0) +
             (start_->mode == mode ? 0.0 : kModeBits);
    };
    chosen_.mode = kLattice;
    for (std::uint32_t mode = 0; mode < kModes; ++mode)
      if (tried_[mode] && with_change(mode) < with_change(chosen_.mode)) chosen_.mode = mode;
  }

  /// What is missed where another mode is taken instead of the first one when it is better.
  struct Beside {
    std::uint64_t sum = 0;
    std::size_t taken = 0;
  };
  Beside beside_first(std::uint32_t mode) const {
    const Looks &first = looks_[chosen_.mode], &its = looks_[mode];
    Beside beside;
    for (std::size_t i = 0; i < looked_; ++i) {
      const bool better = its.missed[i] + kCostParts < first.missed[i];
      beside.taken += better ? 1 : 0;
      beside.sum += better ? its.missed[i] : first.missed[i];
    }
    return beside;
  }
  /// Goes on with the modes that miss least, those that miss least beside the first one, and how
  /// the class is predicted now.
  void keep_the_best() {
    std::array<bool, kModes> kept{};
    std::array<std::uint64_t, kModes> sums{};
    const auto keep_least = [&](std::size_t count) {
      for (; count > 0; --count) {
        std::uint32_t least = kNoMode;
        for (std::uint32_t mode = 0; mode < kModes; ++mode)
          if (tried_[mode] && !kept[mode] && (least == kNoMode || sums[mode] < sums[least]))
            least = mode;
        if (least == kNoMode) return;
        kept[least] = true;
      }
    };
    for (std::uint32_t mode : {static_cast<std::uint32_t>(kLattice), start_->mode, start_->second})
      if (mode < kModes) kept[mode] = tried_[mode];
    kept[chosen_.mode] = true;
    for (std::uint32_t mode = 0; mode < kModes; ++mode) sums[mode] = looks_[mode].sum;
    keep_least(kKeptAlone);
    for (std::uint32_t mode = 0; mode < kModes; ++mode)
      if (tried_[mode]) sums[mode] = beside_first(mode).sum;
    keep_least(kKeptBeside);
    tried_ = kept;
  }
  /// A mode for where the first one is wrong, if it saves more than it costs to mark these places.
  void choose_second() {
    chosen_.second = kNoMode;
    bits_ = bits_in(chosen_.mode) + (chosen_.mode == kFittedMode ? to_code_ : 0.0) +
            (start_->second == kNoMode ? 0.0 : kModeBits);
    for (std::uint32_t mode = 0; mode < kModes; ++mode) {
      if (!tried_[mode] || mode == chosen_.mode) continue;
      const Beside beside = beside_first(mode);
      if (beside.taken == 0) continue;
      const bool codes_weights = mode == kFittedMode && !(chosen_.weights == start_->weights);
      const double its = bits_of(beside.sum) +
                         binary_entropy(beside.taken, looked_) *
                             static_cast<double>(members_.size()) / static_cast<double>(looked_) +
                         (start_->second == mode ? 0.0 : kModeBits) +
                         (codes_weights ? kWeightsBits : 0.0);
      if (its >= bits_) continue;
      bits_ = its;
      chosen_.second = mode;
    }
    bits_ += start_->mode == chosen_.mode ? 0.0 : kModeBits;
  }

  /// What a mode misses, in parts of a bit.
  struct Looks {
    std::size_t count = 0;
    std::uint64_t sum = 0;
    std::array<std::uint16_t, kLookAt> missed;  // those before `count`
  };

  const Space* space_;
  const ModeSamples* all_;
  std::span<const std::uint32_t> members_;
  std::uint32_t of_class_;
  const ClassModes* start_;
  bool matches_;
  FamilyFits<Space>* families_;
  std::array<Pick, kLookAt> picks_;
  std::size_t picked_ = 0, looked_ = 0;
  ClassModes chosen_;
  double bits_ = 0.0, to_code_ = 0.0;  // to_code_: weights
  std::array<bool, kModes> tried_{};   // by mode
  std::array<Looks, kModes> looks_;    // by mode
};

}  // namespace

template <class Space>
void choose_modes(const Space& space, const ModeSamples& samples,
                  std::span<const std::uint16_t> families, bool matches,
                  std::vector<ClassModes>& modes) {
  const Members members(samples, modes.size(), [](const ModeSample& it) { return it.of_class; });
  FamilyFits fits(space, samples, families, members, modes);
  for (std::uint32_t c = 0; c < modes.size(); ++c) {
    const auto its = members.of(c);
    if (its.empty()) continue;
    const ClassModes start = modes[c];
    Search alone(space, samples, its, c, start, kStates, matches, fits);
    alone.run();
    modes[c] = alone.chosen();
    if (samples.differences.empty()) continue;
    Search difference(space, samples, its, c, start, kDifferences, matches, fits);
    difference.run();
    if (difference.bits() < alone.bits()) modes[c] = difference.chosen();
  }
}

#define SHM_CHOOSE_MODES(Space)                                                                \
  template void choose_modes(const Space&, const ModeSamples&, std::span<const std::uint16_t>, \
                             bool, std::vector<ClassModes>&)
SHM_CHOOSE_MODES(LinearSpace);
SHM_CHOOSE_MODES(DecimalSpace);
SHM_CHOOSE_MODES(FloatSpace<float>);
SHM_CHOOSE_MODES(FloatSpace<double>);
SHM_CHOOSE_MODES(RankSpace<LinearSpace>);
SHM_CHOOSE_MODES(RankSpace<DecimalSpace>);
SHM_CHOOSE_MODES(RankSpace<FloatSpace<float>>);
SHM_CHOOSE_MODES(RankSpace<FloatSpace<double>>);
#undef SHM_CHOOSE_MODES

// --- when

bool ModeWatch::begin_tile(std::span<const std::uint16_t> classes, bool hurries) {
  std::vector<std::uint32_t> count(records_.size());
  for (std::uint16_t it : classes) {
    if (it >= count.size()) count.resize(std::size_t{it} + 1);
    ++count[it];
  }
  records_.resize(count.size());
  const bool chooses = !hurries || does_worse(count, classes.size());
  for (std::size_t c = 0; c < count.size(); ++c) {
    Record& it = records_[c];
    it.count = it.bits = 0;
    if (chooses && count[c] > 0) it.tiles_since = 0;
  }
  return chooses;
}

/// `count`: elements of the tile at hand, by class.
bool ModeWatch::does_worse(std::span<const std::uint32_t> count, std::size_t elements) {
  bool worse = false;
  for (std::size_t c = 0; c < count.size(); ++c) {
    Record& it = records_[c];
    if (it.count > 0) {
      const double bits = it.bits / it.count;
      if (it.bits_then < 0 || it.tiles_since == 0) it.bits_then = bits;
      if (bits > it.bits_then * 1.06 + 0.1) worse = true;
    }
    if (count[c] == 0) continue;
    if (it.bits_then < 0 && count[c] * 32 > elements) worse = true;
    if (++it.tiles_since >= kMostTilesKept && count[c] * 8 > elements) worse = true;
  }
  return worse;
}

// --- domains

namespace {

/// An escape: the bits of the value, and what tells that it is one.
constexpr double kEscapeBits = 8.0;

/// The elements of a sample with the states and indices of another domain.
template <class Space>
ModeSamples in_domain(const ArrayInfo& info, std::size_t component, const DomainPlan& plan,
                      const Space& space, const DomainSample& sample) {
  const ValueTranslator from(info, component, sample.domain);
  const ValueTranslator to(info, component, plan.domain);
  const bool same = plan.domain.has_states_of(sample.domain);
  const auto translate = [&](double& state) {
    if (same) return;
    const double moved = to.from_value(from.as_value(state));
    state = is_finite(moved) ? moved : 0.0;
  };
  ModeSamples its = sample.elements;
  for (std::size_t i = 0; i < its.samples.size(); ++i) {
    ModeSample& it = its.samples[i];
    for (std::uint32_t f = 0; f < kFeatures; ++f) {
      if (f < kFLast && (it.known >> f & 1) == 0) continue;
      translate(it.state[f]);
      if (!its.differences.empty()) translate(its.differences[i][f]);
    }
    translate(it.reference);
    if (!it.copied) it.index = index_in(space, to, sample.bits[i]);
  }
  return its;
}

/// What the modes miss at an element.
constexpr std::uint8_t kEscape = 254, kCopied = 255;
struct ElementMiss {
  std::uint8_t length = kCopied;  // in bits, or one of the above
  bool second = false;            // whether it is of the second mode
  bool may_be_second = false;     // whether that is told
};

template <class Space>
DomainEstimate estimate(const ArrayInfo& info, std::size_t component, const DomainPlan& plan,
                        const Space& space, const DomainSample& sample,
                        std::span<const std::uint16_t> families, bool matches,
                        std::vector<ClassModes>& modes) {
  const ModeSamples elements = in_domain(info, component, plan, space, sample);
  if (modes.empty()) {
    modes.resize(families.size());
    choose_modes(space, elements, families, matches, modes);
  }

  const ValueTranslator translator(info, component, plan.domain);
  DomainEstimate found;
  found.predicted.resize(elements.samples.size());
  found.by_element.resize(elements.samples.size());
  found.lengths.resize(elements.samples.size());
  std::vector<ElementMiss> missed(elements.samples.size());
  std::array<std::uint64_t, 65> lengths{};
  std::uint64_t coded = 0, marked = 0, seconds = 0;
  for (std::size_t i = 0; i < missed.size(); ++i) {
    const ModeSample& it = elements.samples[i];
    if (it.copied) continue;
    if (!it.index) {
      missed[i].length = kEscape;
      continue;
    }
    const ClassModes& its = modes[it.of_class];
    const bool differs = its.input == kDifferences;
    const auto& features = differs ? elements.differences[i] : it.state;
    const auto at = [&](std::uint32_t feature) { return features[feature]; };
    const Predictor predictor(it.known, at);
    const auto predict = [&](std::uint32_t mode) {
      const bool can = mode != kPartnerMode || it.has_partner;
      return predictor.predict(can ? mode : kLattice, its.weights) + (differs ? it.reference : 0.0);
    };
    found.predicted[i] = predict(its.mode);
    const std::int64_t first = space.index(found.predicted[i]);
    std::uint32_t length = bit_length(minus(*it.index, first));
    if (its.second != kNoMode) {
      const double second = predict(its.second);
      const std::int64_t other = space.index(second);
      missed[i].may_be_second = other != first;
      const std::uint32_t its_length = bit_length(minus(*it.index, other));
      missed[i].second = its_length + 1 < length;
      if (missed[i].second) {
        length = its_length;
        found.predicted[i] = second;
      }
      marked += missed[i].may_be_second ? 1 : 0;
      seconds += missed[i].second ? 1 : 0;
    }
    found.predicted[i] = translator.as_value(found.predicted[i]);
    missed[i].length = static_cast<std::uint8_t>(length);
    ++lengths[length];
    ++coded;
  }

  for (std::size_t i = 0; i < missed.size(); ++i) {
    const ElementMiss& it = missed[i];
    double& bits = found.by_element[i];
    if (it.length == kCopied) continue;
    if (it.length == kEscape)
      bits = static_cast<double>(8 * scalar_bytes(info.type)) + kEscapeBits;
    else
      bits = bits_of_one(lengths[it.length], coded) + static_cast<double>(it.length);
    if (it.length < kEscape) found.lengths[i] = it.length;
    if (it.may_be_second) bits += bits_of_one(it.second ? seconds : marked - seconds, marked);
    found.bits += bits;
  }
  return found;
}

}  // namespace

DomainEstimate estimate_plan(const ArrayInfo& info, std::size_t component, const DomainPlan& plan,
                             const DomainSample& sample, std::span<const std::uint16_t> families,
                             bool matches, std::vector<ClassModes>& modes) {
  return with_space(info, plan.domain, plan.table, [&](const auto& space) {
    return estimate(info, component, plan, space, sample, families, matches, modes);
  });
}

}  // namespace shm
