#include "values/mode_choice.h"

#include <algorithm>

#include "values/fitting.h"
#include "values/value_domain.h"

namespace shm {
namespace {

// Elements of a class that are looked at before its modes are chosen, in each tile.
constexpr std::size_t kLookAt = 256, kFitAt = 512, kFewestToFit = 40;
// Tiles for which the modes of a large class are kept.
constexpr std::uint32_t kMostTilesKept = 8;
// About what it costs to code another mode, and weights, in bits.
constexpr double kModeBits = 5.0, kWeightsBits = 250.0;

/// About the bits of a residual.
double cost_of(std::int64_t residual) {
  const std::uint32_t length = bit_length(residual);
  return length == 0 ? 0.3 : 1.7 + static_cast<double>(length);
}

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

  struct Fit {
    std::optional<Weights> weights;
    double bits = 0;  ///< what coding them costs the class
  };
  /// No weights: the class is not one of those that share, or the family is too small.
  Fit of(std::uint32_t of_class, std::size_t size, const ClassModes& start, std::uint32_t input) {
    const std::uint16_t family = families_[of_class];
    const auto members = members_.of(family);
    if (!shares(size, start) || members.size() < kFewestToFit) return {};
    std::optional<Weights>& weights = weights_[input][family];
    if (!weights) weights = fit_members(*space_, *all_, members, input);
    return {weights,
            kWeightsBits * static_cast<double>(size) / static_cast<double>(sharing_[family])};
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

/// Searches the modes of one class, for one input.
template <class Space>
class Search {
 public:
  /// `members`: not empty. `start`: how the class is predicted now.
  Search(const Space& space, const ModeSamples& all, std::span<const std::uint32_t> members,
         const ClassModes& start, std::uint32_t input, bool matches,
         const typename FamilyFits<Space>::Fit& family)
      : space_(&space),
        all_(&all),
        members_(members),
        start_(&start),
        matches_(matches),
        family_(family) {
    chosen_.input = input;
    chosen_.weights = start.weights;
    looked_ = std::min(members.size(), kLookAt);
    scale_ = static_cast<double>(members.size()) / static_cast<double>(looked_);
  }

  void run() {
    for (std::uint32_t mode = 0; mode < kModes; ++mode) {
      tried_[mode] = is_worth_trying(mode);
      if (!tried_[mode]) continue;
      cost_[mode] = mode == kFittedMode ? fit() : look(mode, chosen_.weights);
    }
    choose_first();
    choose_second();
  }
  const ClassModes& chosen() const { return chosen_; }
  /// About the bits of the class when it is predicted so.
  double bits() const { return bits_; }

 private:
  bool is_fittable() const { return members_.size() >= kFewestToFit; }
  bool is_worth_trying(std::uint32_t mode) const {
    if (mode == kStayMode) return chosen_.input == kDifferences;
    if (mode == kFittedMode && !is_fittable() && !family_.weights && start_->weights == Weights{})
      return false;
    if (mode == kPartnerMode)
      return std::any_of(members_.begin(), members_.end(),
                         [&](std::uint32_t m) { return all_->samples[m].has_partner; });
    if (!matches_ && mode >= kMatchMode && mode != kFittedMode) return false;
    return differs_from_lattice(mode, all_->samples[members_[0]].known);
  }
  /// What a mode misses, in bits.
  double look(std::uint32_t mode, const Weights& weights) {
    missed_[mode].clear();
    double sum = 0.0;
    for_each_picked(*all_, members_, looked_, chosen_.input,
                    [&](const auto& sample, const auto& predictor, double added) {
                      const bool can = mode != kPartnerMode || sample.has_partner;
                      const double prediction =
                          predictor.predict(can ? mode : kLattice, weights) + added;
                      const double bits = cost_of(minus(*sample.index, space_->index(prediction)));
                      missed_[mode].push_back(bits);
                      sum += bits;
                    });
    return sum * scale_;
  }
  /// What the fitted mode misses, with the weights as they are or with those of the class or its
  /// family.
  double fit() {
    double least = 1e300, to_code = 0.0;
    const auto rate = [&](const Weights& weights, double bits) {
      const double cost = look(kFittedMode, weights) + bits;
      if (cost >= least) return;
      least = cost;
      to_code = bits;
      chosen_.weights = weights;
    };
    if (!(start_->weights == Weights{})) rate(start_->weights, 0.0);
    if (family_.weights) rate(*family_.weights, family_.bits);
    if (is_fittable()) rate(fit_members(*space_, *all_, members_, chosen_.input), kWeightsBits);
    return look(kFittedMode, chosen_.weights) + to_code;
  }
  void choose_first() {
    const auto with_change = [&](std::uint32_t mode) {
      return cost_[mode] + (start_->mode == mode ? 0.0 : kModeBits);
    };
    chosen_.mode = kLattice;
    for (std::uint32_t mode = 0; mode < kModes; ++mode)
      if (tried_[mode] && with_change(mode) < with_change(chosen_.mode)) chosen_.mode = mode;
  }
  /// A mode for where the first one is wrong, if it saves more than it costs to mark these places.
  void choose_second() {
    const auto& first = missed_[chosen_.mode];
    chosen_.second = kNoMode;
    bits_ = cost_[chosen_.mode] + (start_->second == kNoMode ? 0.0 : kModeBits);
    for (std::uint32_t mode = 0; mode < kModes; ++mode) {
      if (!tried_[mode] || mode == chosen_.mode) continue;
      double sum = 0.0;
      std::size_t taken = 0;
      for (std::size_t i = 0; i < first.size(); ++i) {
        const bool better = missed_[mode][i] + 1.0 < first[i];
        taken += better ? 1 : 0;
        sum += better ? missed_[mode][i] : first[i];
      }
      if (taken == 0) continue;
      const bool codes_weights = mode == kFittedMode && !(chosen_.weights == start_->weights);
      const double its = (sum + binary_entropy(taken, first.size())) * scale_ +
                         (start_->second == mode ? 0.0 : kModeBits) +
                         (codes_weights ? kWeightsBits : 0.0);
      if (its >= bits_) continue;
      bits_ = its;
      chosen_.second = mode;
    }
    bits_ += start_->mode == chosen_.mode ? 0.0 : kModeBits;
  }

  const Space* space_;
  const ModeSamples* all_;
  std::span<const std::uint32_t> members_;
  const ClassModes* start_;
  bool matches_;
  typename FamilyFits<Space>::Fit family_;
  std::size_t looked_ = 0;
  double scale_ = 1.0;  // members for each that is looked at
  ClassModes chosen_;
  double bits_ = 0.0;
  // by mode
  std::array<bool, kModes> tried_{};
  std::array<double, kModes> cost_{};
  std::array<std::vector<double>, kModes> missed_;  // bits, by sample
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
    Search alone(space, samples, its, start, kStates, matches,
                 fits.of(c, its.size(), start, kStates));
    alone.run();
    modes[c] = alone.chosen();
    if (samples.differences.empty()) continue;
    Search difference(space, samples, its, start, kDifferences, matches,
                      fits.of(c, its.size(), start, kDifferences));
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

}  // namespace shm
