#include "values/mode_choice.h"

#include <algorithm>

#include "values/entropy_bits.h"
#include "values/fitting.h"
#include "values/value_space.h"
#include "values/whole_numbers.h"

namespace shm {
namespace {

// Elements of a class that are looked at before its modes are chosen, in each tile.
constexpr std::size_t kLookAt = 256, kFitAt = 512, kFewestToFit = 40;
// Tiles for which the modes of a large class are kept.
constexpr std::uint32_t kMostTilesKept = 8;
// About what it costs to say another mode, and weights, in bits.
constexpr double kModeBits = 5.0, kWeightsBits = 120.0;

/// About the bits that it takes to say a residual.
double cost_of(std::int64_t residual) {
  const std::uint32_t length = bit_length(residual);
  return length == 0 ? 0.3 : 1.7 + static_cast<double>(length);
}

/// Whether a mode says anything else than the lattice for neighbourhoods with these bits.
bool is_sayable(std::uint32_t mode, std::uint32_t known) {
  const auto has = [&](std::uint32_t bits) { return (known & bits) == bits; };
  const auto any = [&](std::uint32_t bits) { return (known & bits) != 0; };
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

/// Members of each class, one class behind the other.
struct Members {
  explicit Members(const ModeSamples& all, std::size_t classes) : begin(classes + 1) {
    for (const ModeSample& it : all.samples) ++begin[it.of_class + 1];
    for (std::size_t c = 0; c < classes; ++c) begin[c + 1] += begin[c];
    order.resize(all.samples.size());
    auto next = begin;
    for (std::size_t i = 0; i < all.samples.size(); ++i)
      order[next[all.samples[i].of_class]++] = static_cast<std::uint32_t>(i);
  }
  std::span<const std::uint32_t> of(std::size_t c) const {
    return std::span(order).subspan(begin[c], begin[c + 1] - begin[c]);
  }
  std::vector<std::size_t> begin;  // by class
  std::vector<std::uint32_t> order;
};

/// Searches the modes of one class, said one way.
template <class Space>
class Search {
 public:
  /// `members`: not empty. `start`: how the class is said now.
  Search(const Space& space, const ModeSamples& all, std::span<const std::uint32_t> members,
         const ClassModes& start, std::uint32_t way, bool matches)
      : space_(&space), all_(&all), members_(members), start_(&start), matches_(matches) {
    chosen_.way = way;
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
  /// What it takes to say the class so, about.
  double bits() const { return bits_; }

 private:
  bool is_difference() const { return chosen_.way == kDifference; }
  bool is_worth_trying(std::uint32_t mode) const {
    if (mode == kStayMode) return is_difference();
    if (mode == kFittedMode && members_.size() < kFewestToFit) return false;
    if (!matches_ && mode >= kMatchMode && mode != kFittedMode) return false;
    return is_sayable(mode, all_->samples[members_[0]].known);
  }
  /// Number i of so many samples that are spread over the class.
  std::uint32_t pick(std::size_t i, std::size_t of) const {
    return members_[i * members_.size() / of];
  }
  /// visit(sample, predictor, what is added to predictions) for those that have an index.
  template <class Visit>
  void for_each_picked(std::size_t count, Visit&& visit) const {
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t picked = pick(i, count);
      const ModeSample& sample = all_->samples[picked];
      if (!sample.index) continue;
      const auto& features = is_difference() ? all_->differences[picked] : sample.state;
      const auto at = [&](std::uint32_t feature) { return features[feature]; };
      visit(sample, Predictor(sample.known, at), is_difference() ? sample.reference : 0.0);
    }
  }
  /// What a mode misses, in bits.
  double look(std::uint32_t mode, const Weights& weights) {
    missed_[mode].clear();
    double sum = 0.0;
    for_each_picked(looked_, [&](const auto& sample, const auto& predictor, double added) {
      const double prediction = predictor.predict(mode, weights) + added;
      const double bits = cost_of(minus(*sample.index, space_->index(prediction)));
      missed_[mode].push_back(bits);
      sum += bits;
    });
    return sum * scale_;
  }
  /// What the fitted mode misses, with the weights as they are or with new ones.
  double fit() {
    std::vector<FitSample> samples;
    for_each_picked(std::min(members_.size(), kFitAt),
                    [&](const auto& sample, const auto& predictor, double added) {
                      const double base = predictor.lattice();
                      const double target = space_->state(*sample.index) - base - added;
                      if (is_finite(target)) samples.push_back({predictor.terms(base), target});
                    });
    const Weights found = fit_weights(samples);
    const double kept = start_->weights == Weights{} ? 1e300 : look(kFittedMode, start_->weights);
    const double anew = look(kFittedMode, found) + kWeightsBits;
    if (anew >= kept) return look(kFittedMode, start_->weights);
    chosen_.weights = found;
    return anew;
  }
  void choose_first() {
    const auto with_change = [&](std::uint32_t mode) {
      return cost_[mode] + (start_->mode == mode ? 0.0 : kModeBits);
    };
    chosen_.mode = kLattice;
    for (std::uint32_t mode = 0; mode < kModes; ++mode)
      if (tried_[mode] && with_change(mode) < with_change(chosen_.mode)) chosen_.mode = mode;
  }
  /// A mode for where the first one is wrong, if it saves more than it takes to say where.
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
      const bool says_weights = mode == kFittedMode && !(chosen_.weights == start_->weights);
      const double its = (sum + binary_entropy(taken, first.size())) * scale_ +
                         (start_->second == mode ? 0.0 : kModeBits) +
                         (says_weights ? kWeightsBits : 0.0);
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
void choose_modes(const Space& space, const ModeSamples& samples, bool matches,
                  std::vector<ClassModes>& modes) {
  const Members members(samples, modes.size());
  for (std::size_t c = 0; c < modes.size(); ++c) {
    if (members.of(c).empty()) continue;
    const ClassModes start = modes[c];
    Search alone(space, samples, members.of(c), start, kAlone, matches);
    alone.run();
    modes[c] = alone.chosen();
    if (samples.differences.empty()) continue;
    Search difference(space, samples, members.of(c), start, kDifference, matches);
    difference.run();
    if (difference.bits() < alone.bits()) modes[c] = difference.chosen();
  }
}

template void choose_modes(const LinearSpace&, const ModeSamples&, bool, std::vector<ClassModes>&);
template void choose_modes(const DecimalSpace&, const ModeSamples&, bool, std::vector<ClassModes>&);
template void choose_modes(const FloatSpace<float>&, const ModeSamples&, bool,
                           std::vector<ClassModes>&);
template void choose_modes(const FloatSpace<double>&, const ModeSamples&, bool,
                           std::vector<ClassModes>&);
template void choose_modes(const RankSpace<LinearSpace>&, const ModeSamples&, bool,
                           std::vector<ClassModes>&);
template void choose_modes(const RankSpace<DecimalSpace>&, const ModeSamples&, bool,
                           std::vector<ClassModes>&);
template void choose_modes(const RankSpace<FloatSpace<float>>&, const ModeSamples&, bool,
                           std::vector<ClassModes>&);
template void choose_modes(const RankSpace<FloatSpace<double>>&, const ModeSamples&, bool,
                           std::vector<ClassModes>&);

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
