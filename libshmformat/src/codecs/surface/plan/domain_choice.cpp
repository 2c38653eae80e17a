#include "codecs/surface/plan/domain_choice.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

#include "codecs/surface/plan/mode_choice.h"
#include "codecs/surface/values/column_state.h"
#include "codecs/surface/values/rank_table.h"

namespace shm {

// --- cost of a sample

namespace {

/// Estimated cost of an escape in bits. The bits of the value itself are not included.
constexpr double kEscapeBits = 8.0;

/// Converts the states and indices of a sample's elements to another domain.
template <class Space>
InputsOfElements in_domain(const ArrayInfo& info, std::size_t component,
                           const DomainAndTable& candidate, const Space& space,
                           const GroupSample& sample) {
  const ValueTranslator from(info, component, sample.domain);
  const ValueTranslator to(info, component, candidate.domain);
  const bool same = candidate.domain.has_states_of(sample.domain);
  const auto translate = [&](double& state) {
    if (same) return;
    const double moved = to.from_value(from.as_value(state));
    state = is_finite(moved) ? moved : 0.0;
  };
  InputsOfElements translated = sample.inputs;
  for (std::size_t i = 0; i < translated.elements.size(); ++i) {
    ElementInputs& element = translated.elements[i];
    for (std::uint32_t f = 0; f < kFeatures; ++f) {
      if (f < kFLast && (element.known >> f & 1) == 0) continue;
      translate(element.state[f]);
      if (!translated.differences.empty()) translate(translated.differences[i][f]);
    }
    translate(element.reference);
    if (!element.copied) element.index = index_in(space, to, sample.bits[i]);
  }
  return translated;
}

/// The residual of an element.
constexpr std::uint8_t kEscape = 254, kCopied = 255;
struct ElementMiss {
  std::uint8_t length = kCopied;  // bit length of the residual; kEscape for an escape, kCopied for
                                  // a copy
  bool second = false;            // whether the second mode predicts the element
  bool may_be_second = false;     // true if the choice between the two modes has to be coded
};

template <class Space>
SampleCost estimate(const ArrayInfo& info, std::size_t component, const DomainAndTable& candidate,
                    const Space& space, const GroupSample& sample,
                    std::span<const std::uint16_t> families, bool matches,
                    std::vector<ClassModes>& modes) {
  const InputsOfElements elements = in_domain(info, component, candidate, space, sample);
  if (modes.empty()) {
    modes.resize(families.size());
    choose_modes(space, elements, families, matches, modes);
  }

  const ValueTranslator translator(info, component, candidate.domain);
  SampleCost found;
  found.predicted.resize(elements.elements.size());
  found.by_element.resize(elements.elements.size());
  found.lengths.resize(elements.elements.size());
  std::vector<ElementMiss> missed(elements.elements.size());
  std::array<std::uint64_t, 65> lengths{};
  std::uint64_t coded = 0, marked = 0, seconds = 0;
  for (std::size_t i = 0; i < missed.size(); ++i) {
    const ElementInputs& element = elements.elements[i];
    if (element.copied) continue;
    if (!element.index) {
      missed[i].length = kEscape;
      continue;
    }
    const ClassModes& class_modes = modes[element.of_class];
    const bool differs = class_modes.input == kDifferences;
    const auto& features = differs ? elements.differences[i] : element.state;
    const auto at = [&](std::uint32_t feature) { return features[feature]; };
    const Predictor predictor(element.known, at);
    const auto predict = [&](std::uint32_t mode) {
      const bool can = mode != kPartnerMode || element.has_partner;
      return predictor.predict(can ? mode : kLattice, class_modes.weights) +
             (differs ? element.reference : 0.0);
    };
    found.predicted[i] = predict(class_modes.mode);
    const std::int64_t first = space.index(found.predicted[i]);
    std::uint32_t length = bit_length(minus(*element.index, first));
    if (class_modes.second != kNoMode) {
      const double second = predict(class_modes.second);
      const std::int64_t other = space.index(second);
      missed[i].may_be_second = other != first;
      const std::uint32_t its_length = bit_length(minus(*element.index, other));
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
    const ElementMiss& miss = missed[i];
    double& bits = found.by_element[i];
    if (miss.length == kCopied) continue;
    if (miss.length == kEscape)
      bits = static_cast<double>(8 * scalar_bytes(info.type)) + kEscapeBits;
    else
      bits = bits_of_one(lengths[miss.length], coded) + static_cast<double>(miss.length);
    if (miss.length < kEscape) found.lengths[i] = miss.length;
    if (miss.may_be_second) bits += bits_of_one(miss.second ? seconds : marked - seconds, marked);
    found.bits += bits;
  }
  return found;
}

}  // namespace

SampleCost estimate_cost(const ArrayInfo& info, std::size_t component,
                         const DomainAndTable& candidate, const GroupSample& sample,
                         std::span<const std::uint16_t> families, bool matches,
                         std::vector<ClassModes>& modes) {
  return with_space(info, candidate.domain, candidate.table, [&](const auto& space) {
    return estimate(info, component, candidate, space, sample, families, matches, modes);
  });
}

// --- earlier values

namespace {

/// Two conditions for using recalled values or partners, two ways to predict a value from an
/// earlier value. First, they must save at least this share of all bits.
constexpr double kWorthwhileShare = 0.02;
constexpr std::uint64_t kFewestHelped =
    32;  // second condition: at least one in this number of values must have a useful earlier value

/// Estimated cost in bits of a value that is predicted from a partner, in addition to the residual.
/// A partner is an earlier element with a similar reference value.
constexpr double kPartnerBits = 1.5;
/// Constants that make the estimate for recalled values more cautious, since the models of recalled
/// values have to adapt first.
constexpr double kRecallTrust = 0.85, kLearningBits = 400.0;
/// An earlier value counts as a useful predictor only if the residual against it has at most this
/// many bits.
constexpr std::uint32_t kLongestMiss = 40;

/// Returns the index of the element of the domain that is nearest to a value.
std::int64_t index_of(const ArrayInfo& info, const ValueDomain& domain,
                      const ValueTranslator& translator, double value) {
  const double state = translator.from_value(value);
  switch (domain.kind) {
    case DomainKind::floats:
      if (info.type == ScalarType::float64) return FloatSpace<double>::index(state);
      [[fallthrough]];
    case DomainKind::narrow: return FloatSpace<float>::index(state);
    case DomainKind::digits: return DecimalSpace{domain.exponent}.index(state);
    default: return LinearSpace::index(state);
  }
}

/// Recent relations between values and the earlier values that predict them: distances between
/// their positions, and sums of their positions (which are constant if the order is reversed).
/// Several relations are stored because the classes of neighbourhoods alternate.
class Ways {
 public:
  bool goes_on(std::uint64_t here, std::uint64_t there) {
    const bool goes = has(here - there, away_) || has(here + there, around_);
    away_[next_ % kKept] = here - there;
    around_[next_ % kKept] = here + there;
    ++next_;
    return goes;
  }

 private:
  static constexpr std::size_t kKept = 16;
  using Kept = std::array<std::uint64_t, kKept>;
  static bool has(std::uint64_t way, const Kept& kept) {
    return std::find(kept.begin(), kept.end(), way) != kept.end();
  }
  Kept away_{}, around_{};
  std::size_t next_ = 0;
};

}  // namespace

EarlierValues::EarlierValues(const ArrayInfo& info, std::size_t component,
                             const ValueDomain& domain, std::span<const std::uint64_t> bits,
                             std::span<const std::uint64_t> reference)
    : missed_(bits.size(), Missed{kNothing, kNothing, false}), magnitudes_(bits.size()) {
  const ValueTranslator translator(info, component, domain);
  SortedValues so_far, references;
  Ways ways;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    const auto index = translator.index(bits[i]);
    if (!index) continue;
    const double value = scalar_as_double(info.type, bits[i]);
    if (!is_finite(value)) continue;
    const auto missed = [&](double by) {
      return bit_length(minus(*index, index_of(info, domain, translator, by)));
    };
    const std::uint64_t magnitude = magnitudes_[i] = SortedValues::magnitude_of(value);
    if (const auto* found = so_far.nearest(magnitude)) {
      const auto earlier = std::bit_cast<double>(found->magnitude);
      const std::uint32_t length = missed(value < 0 ? -earlier : earlier);
      const bool follows =
          length <= kLongestMiss && ways.goes_on(i, static_cast<std::uint64_t>(found->value));
      missed_[i].recalled = static_cast<std::uint8_t>(length);
      missed_[i].follows = follows;
      recallable_ += length <= kLongestMiss ? 1 : 0;
    }
    so_far.add(magnitude, static_cast<double>(i));
    if (reference.empty()) continue;
    const double then = scalar_as_double(info.type, reference[i]);
    if (!is_finite(then)) continue;
    const std::uint64_t key = SortedValues::magnitude_of(then);
    const auto* found = references.nearest(key);
    if (found != nullptr && ColumnState::may_be_partners(info.type, key, found->magnitude)) {
      const std::uint32_t length = missed(then < 0 ? -found->value : found->value);
      missed_[i].partnered = static_cast<std::uint8_t>(length);
      partners_ += length <= kLongestMiss ? 1 : 0;
    }
    references.add(key, then < 0 ? -value : value);
  }
}

bool EarlierValues::may_help() const {
  return std::max(recallable_, partners_) * kFewestHelped >= missed_.size();
}

namespace {

/// Counts of numbers by bit length.
struct Lengths {
  void add(std::uint32_t length) {
    ++count[length];
    ++all;
  }
  /// Returns the cost in bits of a number with `length` bits: the length, plus the entropy of the
  /// length.
  double bits(std::uint32_t length) const {
    return static_cast<double>(length) + bits_of_one(count[length], all);
  }
  std::array<std::uint64_t, 65> count{};
  std::uint64_t all = 0;
};

}  // namespace

double EarlierValues::choose(std::span<const Value> values, bool has_table,
                             ValueDomain& domain) const {
  std::vector<std::uint64_t> ascending = magnitudes_;
  std::sort(ascending.begin(), ascending.end());
  ascending.erase(std::unique(ascending.begin(), ascending.end()), ascending.end());
  const auto rank_of = [&](std::uint64_t magnitude) {
    return std::lower_bound(ascending.begin(), ascending.end(), magnitude) - ascending.begin();
  };
  // Decide whether each value would be recalled, in the same way as the coder does. The coder
  // computes ranks among the values coded so far. These ranks are not known here, so ranks among
  // all values of the group are scaled down instead.
  constexpr std::uint32_t kNotRecalled = 255;
  std::vector<std::uint32_t> ranks(values.size(), kNotRecalled);
  Lengths of_ranks, of_followed, of_misses;
  for (std::size_t v = 0; v < values.size(); ++v) {
    const Value& value = values[v];
    const Missed& missed = missed_[value.place];
    if (missed.recalled > kLongestMiss) continue;
    std::uint32_t rank = 0;
    if (!missed.follows) {
      const std::int64_t by =
          rank_of(SortedValues::magnitude_of(value.predicted)) - rank_of(magnitudes_[value.place]);
      rank = bit_length(by * static_cast<std::int64_t>(value.place) /
                        static_cast<std::int64_t>(missed_.size()));
    }
    if (rank + missed.recalled + (missed.follows ? 0 : 2) >= value.length) continue;
    ranks[v] = rank;
    (missed.follows ? of_followed : of_ranks).add(rank);
    of_misses.add(missed.recalled);
  }
  double all = 0, by_partners = 0, by_recall = 0, by_recall_besides = 0;
  for (std::size_t v = 0; v < values.size(); ++v) {
    const Value& value = values[v];
    const Missed& missed = missed_[value.place];
    double by_partner = 0, by_earlier = 0;
    if (missed.partnered <= kLongestMiss)
      by_partner = std::max(0.0, value.bits - kPartnerBits - static_cast<double>(missed.partnered));
    if (ranks[v] != kNotRecalled)
      by_earlier = value.bits - (missed.follows ? of_followed : of_ranks).bits(ranks[v]) -
                   of_misses.bits(missed.recalled);
    all += value.bits;
    by_partners += by_partner;
    by_recall += by_earlier;
    by_recall_besides += std::max(0.0, by_earlier - by_partner);
  }
  const double least = kWorthwhileShare * all;
  domain.partners = by_partners > least;
  const double saved = domain.partners ? by_partners : 0.0;
  if (has_table) return saved;
  // If values have partners, count only what recalled values save in addition to the partners.
  const double by = domain.partners ? by_recall_besides : by_recall;
  const double recalls =
      (by - binary_entropy(of_misses.all, values.size())) * kRecallTrust -
      kLearningBits * static_cast<double>(values.size()) / static_cast<double>(missed_.size());
  domain.recalls = recalls > least;
  return domain.recalls ? saved + recalls : saved;
}

// --- choice of a domain

std::vector<std::uint64_t> DomainChooser::coded(const Bits& bits) const {
  if (group_.back.empty()) return bits;
  Bits coded;
  for (std::size_t i = 0; i < bits.size(); ++i)
    if (group_.back[i] == 0) coded.push_back(bits[i]);
  return coded;
}

RatedDomain DomainChooser::choose(std::size_t component, const Bits& bits, const Bits& reference,
                                  std::vector<DomainAndTable> candidates) {
  const GroupSample sample = this->sample(component, bits, reference);
  const double scale = static_cast<double>(bits.size()) / static_cast<double>(sample.bits.size());
  std::vector<SampleCost> costs;
  std::vector<ClassModes> modes;
  std::vector<RatedDomain> rated;
  // best: index of the best candidate domain. best_without: index of the best candidate without a
  // table; only domains without a table can have recalled values
  std::size_t best = 0, best_without = candidates.size();
  for (std::size_t p = 0; p < candidates.size(); ++p) {
    costs.push_back(estimate_cost(info(), component, candidates[p], sample,
                                  column_.class_numbers().families(), group_.style.matches, modes));
    const std::size_t table = table_bytes(component, candidates[p]);
    const double all = costs[p].bits * scale + 8.0 * static_cast<double>(table);
    rated.push_back(
        {std::move(candidates[p]), all, costs[p].bits / static_cast<double>(sample.bits.size())});
    if (all < rated[best].bits) best = p;
    if (rated[p].table.empty() &&
        (best_without == candidates.size() || all < rated[best_without].bits))
      best_without = p;
  }
  if (!column_.has_earlier_values()) return std::move(rated[best]);
  const Bits coded = this->coded(bits);
  std::vector<std::size_t> tried{best};
  if (best_without < candidates.size() && best_without != best) tried.push_back(best_without);
  for (std::size_t p : tried) {
    DomainAndTable& candidate = rated[p];
    EarlierValues earlier(info(), component, candidate.domain, coded, reference);
    if (!earlier.may_help()) continue;
    const auto values = coded_values(sample, costs[p]);
    rated[p].bits -= scale * earlier.choose(values, !candidate.table.empty(), candidate.domain);
  }
  if (best_without < candidates.size() && rated[best_without].bits < rated[best].bits)
    best = best_without;
  return std::move(rated[best]);
}

void DomainChooser::rescale(RatedDomain& rated, std::size_t component, const Bits& bits) {
  const GroupSample sample = this->sample(component, bits, {});
  std::vector<ClassModes> modes;
  const double bits_each =
      estimate_cost(info(), component, rated, sample, column_.class_numbers().families(),
                    group_.style.matches, modes)
          .bits /
      static_cast<double>(sample.bits.size());
  if (rated.sampled_bits > 0) rated.bits *= bits_each / rated.sampled_bits;
  if (bits_each > 0) rated.sampled_bits = bits_each;
}

/// Returns the estimated size in bytes of the candidate's table.
std::size_t DomainChooser::table_bytes(std::size_t component, const DomainAndTable& candidate) {
  if (candidate.table.empty()) return 0;
  const auto components = column_.components();
  SplitEncoder coder;
  RankTableModels models;
  std::vector<std::int64_t> table = candidate.table;
  code_rank_table(
      coder, models, candidate.domain.kind,
      components[component].known_entries(candidate.domain, components.first(component)),
      table.size(), table);
  return coder.finish().size();
}

/// Returns the elements of the sample that are not copies. Their positions are indices into the
/// list of all elements of the group that are not copies.
std::vector<EarlierValues::Value> DomainChooser::coded_values(const GroupSample& sample,
                                                              const SampleCost& cost) const {
  const auto& back = group_.back;
  std::vector<EarlierValues::Value> values;
  std::size_t place = 0, copied = 0;
  for (std::size_t s = 0; s < sample.places.size(); ++s) {
    for (; place < sample.places[s]; ++place) copied += !back.empty() && back[place] > 0 ? 1 : 0;
    if (!back.empty() && back[place] > 0) continue;
    values.push_back({static_cast<std::uint32_t>(place - copied), cost.predicted[s],
                      cost.by_element[s], cost.lengths[s]});
  }
  return values;
}

/// Returns a sample of the elements of the group, with the values of one component.
GroupSample DomainChooser::sample(std::size_t component, const Bits& bits, const Bits& reference) {
  GroupSample sample;
  sample.domain = widest_domain(info());
  Trial state(column_.components()[component].state(), group_.elements.items, sample.domain);
  state->use_matches(group_.style.matches);
  state->change_domain(sample.domain);
  std::size_t offset = 0;
  for_each_tile(group_.elements, [&](const TiledItems::Tile& tile) {
    const auto own =
        column_.covered(tile, [&](const Neighbourhood& item) { state->stand_in(item); });
    if (own.empty()) return;
    const ColumnTile sampled{own,
                             column_.classify(own, group_.style.known()),
                             {},
                             part_of(reference, offset, own.size()),
                             part_of(group_.back, offset, own.size())};
    add_to_sample(*state, sampled, part_of(bits, offset, own.size()), offset, bits.size(), sample);
    offset += own.size();
  });
  return sample;
}

/// Stores the values of a tile in `state` without coding them, and adds some of the values to
/// `sample`. `place`: position of the tile's first element in the group. `of`: number of elements
/// in the group.
void DomainChooser::add_to_sample(ColumnState& state, const ColumnTile& tile,
                                  std::span<const std::uint64_t> bits, std::size_t place,
                                  std::size_t of, GroupSample& sample) const {
  const std::uint32_t known = group_.style.known();
  InputsOfElements& inputs = sample.inputs;
  state.begin_tile(tile);
  with_space(info(), state.domain(), {}, [&](const auto& space) {
    for (std::size_t i = 0; i < tile.items.size(); ++i) {
      if (GroupSample::takes(place + i, of)) {
        if (state.has_reference()) inputs.differences.emplace_back();
        look_ahead(state, space, known, tile, i, bits[i], inputs.elements.emplace_back(),
                   state.has_reference() ? &inputs.differences.back() : nullptr);
        sample.bits.push_back(bits[i]);
        sample.places.push_back(static_cast<std::uint32_t>(place + i));
        continue;
      }
      TileElement element{tile, i};
      state.find_matches(element);
      const auto at = [&](std::uint32_t feature) { return state.feature(element, feature); };
      const double lattice = Predictor(element.item.traits(known), at).lattice();
      const double value = state_of_copy(space, state, bits[i], lattice);
      if (state.has_reference())
        state.keep_reference(element.item, state.reference_state(tile.reference[i]));
      state.keep(element, value, lattice);
    }
    return true;
  });
}

}  // namespace shm
