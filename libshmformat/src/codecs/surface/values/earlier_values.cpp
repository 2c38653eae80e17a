#include "codecs/surface/values/earlier_values.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

#include "codecs/surface/values/column_state.h"
#include "codecs/surface/values/mode_choice.h"

namespace shm {
namespace {

/// Least share of all bits that recalled values or partners must save to be used.
constexpr double kWorthwhileShare = 0.02;
constexpr std::uint64_t kFewestHelped = 32;  // at least one value in 32 must profit, too

/// Cost of a partnered value in addition to its residual, in bits.
constexpr double kPartnerBits = 1.5;
/// Correction of the estimate for recalled values, whose models have to adapt first.
constexpr double kRecallTrust = 0.85, kLearningBits = 400.0;
/// Longest residual, in bits, that counts as a hit.
constexpr std::uint32_t kLongestMiss = 40;

/// Returns the index in the domain that is nearest to a value.
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

/// Distances from recent values to their sources, and centres of symmetry between values and
/// sources. Several are stored because the classes of neighbourhoods alternate.
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
  /// Returns the cost of a number in bits: its length plus the entropy of its length.
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
  // Decide as the coder will decide. The true rank differences are not known here, since the coder
  // computes ranks among the values coded so far: ranks among all values of the group are scaled
  // down instead.
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
  // A value that a partner predicts well does not profit from being recalled.
  const double by = domain.partners ? by_recall_besides : by_recall;
  const double recalls =
      (by - binary_entropy(of_misses.all, values.size())) * kRecallTrust -
      kLearningBits * static_cast<double>(values.size()) / static_cast<double>(missed_.size());
  domain.recalls = recalls > least;
  return domain.recalls ? saved + recalls : saved;
}

// --- copies

namespace {

/// The elements of the history and of the group, numbered consecutively.
class Elements {
 public:
  Elements(std::span<const std::vector<std::uint64_t>> bits,
           std::span<const std::vector<std::uint64_t>> history)
      : bits_(bits), history_(history), before_(history.empty() ? 0 : history[0].size()) {}

  std::size_t before() const { return before_; }
  std::size_t size() const { return before_ + bits_[0].size(); }
  bool are_equal(std::size_t one, std::size_t other) const {
    for (std::size_t c = 0; c < bits_.size(); ++c)
      if (at(c, one) != at(c, other)) return false;
    return true;
  }
  std::uint64_t hash(std::size_t i) const {
    std::uint64_t sum = 0;
    for (std::size_t c = 0; c < bits_.size(); ++c) {
      sum = (sum ^ at(c, i)) * 0x9e3779b97f4a7c15u;
      sum ^= sum >> 29;
    }
    return sum;
  }

 private:
  std::uint64_t at(std::size_t c, std::size_t i) const {
    return i < before_ ? history_[c][i] : bits_[c][i - before_];
  }

  std::span<const std::vector<std::uint64_t>> bits_, history_;
  std::size_t before_;
};

/// Returns, for each element, the next element with the same kind and corner; if there is none,
/// returns the element itself.
std::vector<std::uint32_t> next_alike(std::span<const std::uint8_t> stands) {
  constexpr std::size_t kPlaces = 64;
  std::vector<std::uint32_t> next(stands.size());
  std::array<std::uint32_t, kPlaces> last;
  last.fill(kNone);
  for (auto i = static_cast<std::uint32_t>(stands.size()); i-- > 0;) {
    std::uint32_t& next_of_kind = last[stands[i] % kPlaces];
    next[i] = next_of_kind == kNone ? i : next_of_kind;
    next_of_kind = i;
  }
  return next;
}

}  // namespace

std::vector<std::uint32_t> find_copies(std::span<const std::uint8_t> stands,
                                       std::span<const std::vector<std::uint64_t>> bits,
                                       std::span<const std::vector<std::uint64_t>> history,
                                       std::uint32_t farthest) {
  constexpr std::uint32_t kLongestRun = 32, kMostLooks = 16;
  const Elements all(bits, history);
  std::vector<std::uint32_t> back(stands.size()), wanted(stands.size());
  const std::vector<std::uint32_t> next = next_alike(stands);
  // Hash chains of earlier elements, the most recent element first.
  std::vector<std::uint32_t> heads(std::bit_ceil(all.size() + 1), kNone), chain(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::uint32_t& head = heads[static_cast<std::size_t>(all.hash(i)) & (heads.size() - 1)];
    chain[i] = head;
    head = static_cast<std::uint32_t>(i);
    if (i < all.before()) continue;
    const std::size_t item = i - all.before();
    const auto is_copy = [&](std::uint32_t by) { return by <= i && all.are_equal(i, i - by); };
    std::uint32_t& found = back[item];
    if (wanted[item] > 0 && is_copy(wanted[item])) {
      found = wanted[item];
    } else {
      std::uint32_t longest = 0, looks = 0;
      for (std::uint32_t earlier = chain[i]; earlier != kNone && looks < kMostLooks;
           earlier = chain[earlier], ++looks) {
        const auto by = static_cast<std::uint32_t>(i - earlier);
        if (by > farthest) break;
        if (!is_copy(by)) continue;
        std::uint32_t run = 1;
        for (std::size_t like = item; run < kLongestRun && next[like] != like; ++run) {
          like = next[like];
          const std::size_t element = like + all.before();
          if (!all.are_equal(element, element - by)) break;
        }
        if (run <= longest) continue;
        longest = run;
        found = by;
      }
    }
    if (next[item] != item) wanted[next[item]] = found > 0 ? found : wanted[item];
  }
  return back;
}

}  // namespace shm
