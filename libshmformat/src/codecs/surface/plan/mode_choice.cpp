#include "codecs/surface/plan/mode_choice.h"

#include <algorithm>
#include <array>

#include "codecs/shared/value_domain.h"
#include "codecs/surface/plan/fitting.h"

namespace shm {
namespace {

// Numbers of elements of a class: modes are tried on kLookAt elements in each tile, and weights are
// fitted to kFitAt elements. Weights are fitted only if there are at least kFewestToFit elements.
constexpr std::size_t kLookAt = 256, kFitAt = 256, kFewestToFit = 40;
// The first round tries all modes on kFirstLooks elements. It selects the kKeptAlone modes that are
// best without a second mode, and the kKeptBeside modes that are best as a second mode.
constexpr std::size_t kFirstLooks = 32, kKeptAlone = 3, kKeptBeside = 2;
// Largest number of tiles for which a class with many elements keeps its prediction modes before
// they are chosen again.
constexpr std::uint32_t kMostTilesKept = 8;
// Estimated costs in bits: kModeBits for coding a different mode, kWeightsBits for coding weights.
constexpr double kModeBits = 5.0, kWeightsBits = 250.0;

constexpr std::uint32_t kCostParts = 10;

/// Returns the estimated cost of a residual, in units of 1 / kCostParts bit.
std::uint32_t cost_of(std::int64_t residual) {
  const std::uint32_t length = bit_length(residual);
  return length == 0 ? 3 : 17 + length * kCostParts;
}

/// Function object that returns a feature of an element. A feature is a number from which the
/// element is predicted.
struct FeatureAt {
  const std::array<double, kFeatures>* of = nullptr;
  double operator()(std::uint32_t feature) const { return (*of)[feature]; }
};

/// Returns true if the prediction of this mode can differ from the lattice prediction. `known`: bit
/// mask of the known neighbours.
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

/// Elements sorted by set. A set is a class or a family. The elements of each set are consecutive.
struct Members {
  /// `set_of(element)` returns the set of an element.
  template <class SetOf>
  Members(const InputsOfElements& all, std::size_t sets, SetOf&& set_of) : begin(sets + 1) {
    for (const ElementInputs& element : all.elements)
      if (!element.copied) ++begin[set_of(element) + 1];
    for (std::size_t s = 0; s < sets; ++s) begin[s + 1] += begin[s];
    order.resize(begin[sets]);
    auto next = begin;
    for (std::size_t i = 0; i < all.elements.size(); ++i)
      if (!all.elements[i].copied)
        order[next[set_of(all.elements[i])]++] = static_cast<std::uint32_t>(i);
  }
  std::span<const std::uint32_t> of(std::size_t s) const {
    return std::span(order).subspan(begin[s], begin[s + 1] - begin[s]);
  }
  std::vector<std::size_t> begin;  // by set: position of its first member
  std::vector<std::uint32_t> order;
};

/// Picks `count` of the elements in `members`, spread evenly over the list, and calls
/// visit(element, predictor, added) for each of them. Skips elements whose value has no index in
/// the domain. `added`: state to be added to a prediction, because the input may be differences
/// from the reference values.
template <class Visit>
void for_each_picked(const InputsOfElements& all, std::span<const std::uint32_t> members,
                     std::size_t count, std::uint32_t input, Visit&& visit) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t picked =
        members[static_cast<std::size_t>(std::uint64_t{i} * members.size() / count)];
    const ElementInputs& element = all.elements[picked];
    if (!element.index) continue;
    const auto& features = input == kDifferences ? all.differences[picked] : element.state;
    const auto at = [&](std::uint32_t feature) { return features[feature]; };
    visit(element, Predictor(element.known, at), input == kDifferences ? element.reference : 0.0);
  }
}

/// The space of the indices of a component, without its type: the search for modes, which is long
/// code, is then compiled once and not for each space.
class IndexSpace {
 public:
  virtual ~IndexSpace() = default;
  virtual double state(std::int64_t index) const = 0;
  /// Computes the cost of each residual. A residual is an index minus the predicted index.
  virtual void cost(std::span<const double> predictions, std::span<const std::int64_t> indices,
                    std::span<std::uint16_t> costs) const = 0;
};
template <class Space>
class IndexSpaceOf final : public IndexSpace {
 public:
  explicit IndexSpaceOf(const Space& space) : space_(&space) {}
  double state(std::int64_t index) const override { return space_->state(index); }
  void cost(std::span<const double> predictions, std::span<const std::int64_t> indices,
            std::span<std::uint16_t> costs) const override {
    for (std::size_t i = 0; i < predictions.size(); ++i)
      costs[i] =
          static_cast<std::uint16_t>(cost_of(minus(indices[i], space_->index(predictions[i]))));
  }

 private:
  const Space* space_;
};

/// Fits weights for the fitted mode.
Weights fit_members(const IndexSpace& space, const InputsOfElements& all,
                    std::span<const std::uint32_t> members, std::uint32_t input) {
  std::vector<FitSample> samples;
  for_each_picked(all, members, std::min(members.size(), kFitAt), input,
                  [&](const auto& element, const auto& predictor, double added) {
                    const double base = predictor.lattice();
                    const double target = space.state(*element.index) - base - added;
                    if (is_finite(target)) samples.push_back({predictor.terms(base), target});
                  });
  return fit_weights(samples);
}

/// Fits weights to families of classes. If a new class is too small for its own weights, it uses
/// the weights of its family. The classes that use these weights share the cost of coding them.
class FamilyFits {
 public:
  FamilyFits(const IndexSpace& space, const InputsOfElements& all,
             std::span<const std::uint16_t> families, const Members& classes,
             std::span<const ClassModes> modes)
      : space_(&space),
        all_(&all),
        families_(families),
        count_(families.empty() ? 0u : *std::max_element(families.begin(), families.end()) + 1u),
        members_(all, count_,
                 [&](const ElementInputs& element) { return families[element.of_class]; }),
        sharing_(count_),
        weights_{std::vector<std::optional<Weights>>(count_),
                 std::vector<std::optional<Weights>>(count_)} {
    for (std::size_t c = 0; c < modes.size(); ++c)
      if (shares(classes.of(c).size(), modes[c])) sharing_[families[c]] += classes.of(c).size();
  }

  /// Returns true if the class shares the weights of its family, and if the classes that share
  /// these weights together have enough elements.
  bool has(std::uint32_t of_class, std::size_t size, const ClassModes& start) const {
    return shares(size, start) && sharing_[families_[of_class]] >= kFewestToFit;
  }
  /// Returns the class's share of the cost of coding the weights, in bits. Precondition: has().
  double bits(std::uint32_t of_class, std::size_t size) const {
    return kWeightsBits * static_cast<double>(size) /
           static_cast<double>(sharing_[families_[of_class]]);
  }
  /// Returns the weights of the family to which the class belongs. Precondition: has().
  const Weights& weights(std::uint32_t of_class, std::uint32_t input) {
    const std::uint16_t family = families_[of_class];
    std::optional<Weights>& fit = weights_[input][family];
    if (!fit) fit = fit_members(*space_, *all_, members_.of(family), input);
    return *fit;
  }

 private:
  static bool shares(std::size_t size, const ClassModes& start) {
    return size < kFewestToFit && start.weights == Weights{};
  }

  const IndexSpace* space_;
  const InputsOfElements* all_;
  std::span<const std::uint16_t> families_;  // family of each class
  std::size_t count_;
  Members members_;
  std::vector<std::size_t> sharing_;  // for each family: total number of members of the classes
                                      // that share weights

  // Weights of families, by input and family
  std::array<std::vector<std::optional<Weights>>, 2> weights_;
};

/// Searches for the best prediction modes of one class, either with the states as input or with the
/// differences from the reference values. First tries all modes on a few elements. Then tries the
/// most promising modes on more elements, as a first mode and as a second mode.
class Search {
 public:
  /// `members`: the elements of the class; not empty. `start`: the current modes of the class.
  Search(const IndexSpace& space, const InputsOfElements& all,
         std::span<const std::uint32_t> members, std::uint32_t of_class, const ClassModes& start,
         std::uint32_t input, bool matches, FamilyFits& families)
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
  /// Returns the estimated cost of the class with the chosen modes, in bits.
  double bits() const { return bits_; }

 private:
  /// An element on which modes are tried.
  struct Pick {
    const ElementInputs* element = nullptr;
    FeatureAt at;
    double lattice = 0.0, added = 0.0;  // added: state to add to predictions
  };

  /// Picks elements of the class, spread evenly over the class. Skips elements whose value has no
  /// index in the domain. The first few picks alone are also spread evenly.
  void pick() {
    const std::size_t most = std::min(members_.size(), kLookAt);
    const std::size_t apart = most > kFirstLooks ? kLookAt / kFirstLooks : 1;
    for (std::size_t begin = 0; begin < apart; ++begin)
      for (std::size_t i = begin; i < most; i += apart) {
        const std::uint32_t picked =
            members_[static_cast<std::size_t>(std::uint64_t{i} * members_.size() / most)];
        const ElementInputs& element = all_->elements[picked];
        if (!element.index) continue;
        const bool differs = chosen_.input == kDifferences;
        const FeatureAt at{differs ? &all_->differences[picked] : &element.state};
        picks_[picked_++] = {&element, at, Predictor(element.known, at).lattice(),
                             differs ? element.reference : 0.0};
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
                         [&](std::uint32_t m) { return all_->elements[m].has_partner; });
    if (!matches_ && mode >= kMatchMode && mode != kFittedMode) return false;
    return differs_from_lattice(mode, all_->elements[members_[0]].known);
  }
  /// Computes the residuals of a mode at the picked elements. Skips residuals that have been
  /// computed before.
  void look_on(std::uint32_t mode) {
    Looks& looks = looks_[mode];
    if (looks.count >= looked_) return;
    std::array<double, kLookAt> predictions;
    std::array<std::int64_t, kLookAt> indices;
    for (std::size_t i = looks.count; i < looked_; ++i) {
      const Pick& pick = picks_[i];
      const bool can = mode != kPartnerMode || pick.element->has_partner;
      predictions[i] = Predictor(pick.element->known, pick.at, pick.lattice)
                           .predict(can ? mode : kLattice, chosen_.weights) +
                       pick.added;
      indices[i] = *pick.element->index;
    }
    const std::size_t count = looked_ - looks.count;
    const auto costs = std::span(looks.missed).subspan(looks.count, count);
    space_->cost(std::span(predictions).subspan(looks.count, count),
                 std::span(indices).subspan(looks.count, count), costs);
    for (const std::uint16_t cost : costs) looks.sum += cost;
    looks.count = looked_;
  }
  /// Returns the estimated cost in bits of coding the class in this mode. The cost of coding the
  /// mode itself is not included.
  double bits_in(std::uint32_t mode) const { return bits_of(looks_[mode].sum); }
  double bits_of(std::uint64_t looked) const {
    return looked_ == 0 ? 0.0
                        : static_cast<double>(looked) / kCostParts *
                              static_cast<double>(members_.size()) / static_cast<double>(looked_);
  }

  /// Tries the fitted mode with three kinds of weights: the current weights, weights fitted to the
  /// class, and the weights of its family. Does not try new weights if the residuals of another
  /// mode cost less than the weights.
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
      if (const double shared = families_->bits(of_class_, members_.size()); shared < bits)
        rate(families_->weights(of_class_, chosen_.input), shared);
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

  /// Cost of a pair of modes: each element is predicted by the mode that has the smaller residual.
  struct Beside {
    std::uint64_t sum = 0;
    std::size_t taken = 0;
  };
  Beside beside_first(std::uint32_t mode) const {
    const Looks &first = looks_[chosen_.mode], &second = looks_[mode];
    Beside beside;
    for (std::size_t i = 0; i < looked_; ++i) {
      const bool better = second.missed[i] + kCostParts < first.missed[i];
      beside.taken += better ? 1 : 0;
      beside.sum += better ? second.missed[i] : first.missed[i];
    }
    return beside;
  }
  /// Selects the modes for the second round: the modes with the smallest residuals, the modes that
  /// are best as a second mode, and the current modes of the class.
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
  /// Chooses a second mode. A second mode must save more bits than are needed to mark the elements
  /// that use it.
  void choose_second() {
    chosen_.second = kNoMode;
    bits_ = bits_in(chosen_.mode) + (chosen_.mode == kFittedMode ? to_code_ : 0.0) +
            (start_->second == kNoMode ? 0.0 : kModeBits);
    for (std::uint32_t mode = 0; mode < kModes; ++mode) {
      if (!tried_[mode] || mode == chosen_.mode) continue;
      const Beside beside = beside_first(mode);
      if (beside.taken == 0) continue;
      const bool codes_weights = mode == kFittedMode && !(chosen_.weights == start_->weights);
      const double total = bits_of(beside.sum) +
                           binary_entropy(beside.taken, looked_) *
                               static_cast<double>(members_.size()) / static_cast<double>(looked_) +
                           (start_->second == mode ? 0.0 : kModeBits) +
                           (codes_weights ? kWeightsBits : 0.0);
      if (total >= bits_) continue;
      bits_ = total;
      chosen_.second = mode;
    }
    bits_ += start_->mode == chosen_.mode ? 0.0 : kModeBits;
  }

  /// Costs of the residuals of one mode, in units of 1 / kCostParts bit.
  struct Looks {
    std::size_t count = 0;
    std::uint64_t sum = 0;
    std::array<std::uint16_t, kLookAt> missed;  // entries before `count` are valid
  };

  const IndexSpace* space_;
  const InputsOfElements* all_;
  std::span<const std::uint32_t> members_;
  std::uint32_t of_class_;
  const ClassModes* start_;
  bool matches_;
  FamilyFits* families_;
  std::array<Pick, kLookAt> picks_;
  std::size_t picked_ = 0, looked_ = 0;
  ClassModes chosen_;
  double bits_ = 0.0, to_code_ = 0.0;  // to_code_: cost of coding weights, in bits
  std::array<bool, kModes> tried_{};   // for each mode: true if it is tried in the current round
  std::array<Looks, kModes> looks_;    // residuals of each mode
};

void choose(const IndexSpace& space, const InputsOfElements& elements,
            std::span<const std::uint16_t> families, bool matches, std::vector<ClassModes>& modes) {
  const Members members(elements, modes.size(),
                        [](const ElementInputs& element) { return element.of_class; });
  FamilyFits fits(space, elements, families, members, modes);
  for (std::uint32_t c = 0; c < modes.size(); ++c) {
    const auto own = members.of(c);
    if (own.empty()) continue;
    const ClassModes start = modes[c];
    Search alone(space, elements, own, c, start, kStates, matches, fits);
    alone.run();
    modes[c] = alone.chosen();
    if (elements.differences.empty()) continue;
    Search difference(space, elements, own, c, start, kDifferences, matches, fits);
    difference.run();
    if (difference.bits() < alone.bits()) modes[c] = difference.chosen();
  }
}

}  // namespace

template <class Space>
void choose_modes(const Space& space, const InputsOfElements& elements,
                  std::span<const std::uint16_t> families, bool matches,
                  std::vector<ClassModes>& modes) {
  choose(IndexSpaceOf<Space>(space), elements, families, matches, modes);
}

#define SHM_CHOOSE_MODES(Space)                                     \
  template void choose_modes(const Space&, const InputsOfElements&, \
                             std::span<const std::uint16_t>, bool, std::vector<ClassModes>&)
SHM_CHOOSE_MODES(LinearSpace);
SHM_CHOOSE_MODES(DecimalSpace);
SHM_CHOOSE_MODES(FloatSpace<float>);
SHM_CHOOSE_MODES(FloatSpace<double>);
SHM_CHOOSE_MODES(RankSpace);
#undef SHM_CHOOSE_MODES

// --- when modes are chosen

bool ModeWatch::begin_tile(std::span<const std::uint16_t> classes, bool hurries) {
  std::vector<std::uint32_t> count(records_.size());
  for (std::uint16_t number : classes) {
    if (number >= count.size()) count.resize(std::size_t{number} + 1);
    ++count[number];
  }
  records_.resize(count.size());
  coded_.resize(count.size());
  const bool chooses = !hurries || does_worse(count, classes.size());
  for (std::size_t c = 0; c < count.size(); ++c) {
    Record& record = records_[c];
    if (chooses && count[c] > 0) record.tiles_since = 0;
  }
  coded_.assign(count.size(), {});
  return chooses;
}

/// Returns true if the modes of at least one class should be chosen again. `count`: for each class,
/// the number of its elements in the current tile.
bool ModeWatch::does_worse(std::span<const std::uint32_t> count, std::size_t elements) {
  bool worse = false;
  for (std::size_t c = 0; c < count.size(); ++c) {
    Record& record = records_[c];
    if (coded_[c].count > 0) {
      const double bits = coded_[c].bits / coded_[c].count;
      if (record.bits_then < 0 || record.tiles_since == 0) record.bits_then = bits;
      if (bits > record.bits_then * 1.06 + 0.1) worse = true;
    }
    if (count[c] == 0) continue;
    if (record.bits_then < 0 && count[c] * 32 > elements) worse = true;
    if (++record.tiles_since >= kMostTilesKept && count[c] * 8 > elements) worse = true;
  }
  return worse;
}

// --- tiles

TilePlan TilePlanner::plan(ComponentCoder<SplitEncoder>& component, const ColumnTile& tile,
                           std::span<const std::uint64_t> bits, ModeWatch* watch, bool hurries) {
  const bool chooses = watch == nullptr || watch->begin_tile(tile.classes.of_item, hurries);
  component.models().copy_modes(modes_);
  TilePlan plan;
  plan.modes = modes_;
  if (watch != nullptr) plan.coded = watch->coded();
  if (!chooses) return plan;
  plan.inputs = &inputs_;
  ColumnState& state = component.state();
  inputs_.elements.resize(tile.items.size());
  if (state.has_reference()) inputs_.differences.resize(tile.items.size());
  const ColumnStyle& style = component.style();
  with_space(state.info(), state.domain(), component.table(), [&](const auto& space) {
    for (std::size_t i = 0; i < tile.items.size(); ++i)
      look_ahead(state, space, style.known(), tile, i, bits[i], inputs_.elements[i],
                 state.has_reference() ? &inputs_.differences[i] : nullptr);
    choose_modes(space, inputs_, tile.classes.families, style.matches, modes_);
    return true;
  });
  return plan;
}

}  // namespace shm
