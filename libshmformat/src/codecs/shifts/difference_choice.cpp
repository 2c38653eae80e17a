#include "codecs/shifts/difference_choice.h"

#include <algorithm>
#include <array>
#include <bit>

namespace shm {
namespace {

constexpr std::size_t kSamples = 256;

/// The predictions that the encoder tries. Each row contains the order for each of up to three
/// lags; an order of 0 means that the lag is not used. Each prediction is a sum of at most eleven
/// taps (weighted earlier values), so that it is fast to compute.
constexpr std::array<std::array<std::uint32_t, 3>, 22> kOrders = {{
    {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {3, 0, 0}, {0, 3, 0},
    {0, 0, 3}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}, {2, 1, 0}, {2, 0, 1}, {1, 0, 2}, {2, 2, 0},
    {2, 0, 2}, {0, 2, 2}, {1, 1, 1}, {2, 1, 1}, {1, 2, 1}, {1, 1, 2},
}};

std::vector<Factor> factors_of(const std::array<std::uint32_t, 3>& orders,
                               std::span<const std::uint32_t> lags) {
  std::vector<Factor> factors;
  for (std::size_t i = 0; i < orders.size(); ++i) {
    if (orders[i] == 0) continue;
    if (i >= lags.size()) return {};
    factors.push_back({lags[i], orders[i]});
  }
  return factors;
}

/// A prediction that the encoder tries. `places`: for each tap, the index in powers_ of the tap's
/// distance.
struct Candidate {
  std::vector<Factor> factors;
  std::vector<Tap> taps;
  std::vector<std::size_t> places;
  std::uint64_t cost = 0;
};

class Trial {
 public:
  Trial(const GroupIndices& group, const KnownNumbers& known, std::span<const std::uint32_t> lags)
      : group_(group), known_(&known), placed_(known.places()) {
    candidates_.emplace_back();  // no factors: predicts the previous value
    for (const auto& orders : kOrders) {
      Candidate candidate;
      candidate.factors = factors_of(orders, lags);
      if (candidate.factors.empty()) continue;
      candidate.taps = taps_of(candidate.factors);
      for (const Tap& tap : candidate.taps) {
        const auto found = std::find(powers_.begin(), powers_.end(), tap.back);
        candidate.places.push_back(static_cast<std::size_t>(found - powers_.begin()));
        if (found == powers_.end()) powers_.push_back(tap.back);
      }
      candidates_.push_back(std::move(candidate));
    }
    remembered_.resize(powers_.size());
  }

  template <class Differences>
  std::vector<Factor> run(const Differences& differences) {
    const std::size_t count = group_.numbers.size();
    const std::size_t step = std::max<std::size_t>(count / kSamples, 1);
    for (std::size_t e = 0; e < count; ++e) {
      if (e > 0 && e % step == step / 2) try_element(differences, e);
      placed_[known_->place(group_.numbers[e])] = static_cast<std::uint32_t>(e + 1);
    }
    return std::min_element(candidates_.begin(), candidates_.end(),
                            [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; })
        ->factors;
  }

 private:
  template <class Differences>
  void try_element(const Differences& differences, std::size_t e) {
    const std::uint64_t number = group_.numbers[e];
    for (std::size_t c = 0; c < group_.values.size(); ++c) {
      for (std::size_t p = 0; p < powers_.size(); ++p)
        remembered_[p] = remembered(differences, number - powers_[p], c);
      for (Candidate& candidate : candidates_) {
        typename Differences::Sum sum = Differences::sum_of(0);
        if (candidate.taps.empty() || !is_known(number - candidate.taps[0].back))
          sum = Differences::sum_of(differences.remember(group_.index(c, e - 1)));
        else
          for (std::size_t t = 0; t < candidate.taps.size(); ++t)
            sum = Differences::add(sum, Differences::weight(candidate.taps[t].count),
                                   remembered_[candidate.places[t]]);
        candidate.cost += static_cast<std::uint64_t>(
            std::bit_width(differences.residual(group_.index(c, e), differences.index(sum))));
      }
    }
  }

  bool is_known(std::uint64_t number) const {
    const std::uint32_t placed = placed_[known_->place(number)];
    return placed == 0 ? known_->has(number) : group_.numbers[placed - 1] == number;
  }
  template <class Differences>
  std::uint64_t remembered(const Differences& differences, std::uint64_t number,
                           std::size_t component) const {
    const std::size_t slot = known_->place(number);
    return placed_[slot] == 0 ? group_.ring[slot * group_.ring_stride + component]
                              : differences.remember(group_.index(component, placed_[slot] - 1));
  }

  GroupIndices group_;
  const KnownNumbers* known_;
  // For each position in the ring: 1 plus the index of the element in the group; 0 if no element of
  // the group is at this position
  std::vector<std::uint32_t> placed_;
  std::vector<Candidate> candidates_;
  std::vector<std::uint64_t> powers_;  // distances of all taps of all candidates
  // For each distance in powers_: the value of the element at this distance before the current
  // element
  std::vector<std::uint64_t> remembered_;
};

}  // namespace

std::vector<Factor> choose_factors(ScalarType type, DomainKind kind, const GroupIndices& group,
                                   const KnownNumbers& known, std::span<const std::uint32_t> lags) {
  return with_differences(type, kind, [&](const auto& differences) {
    return Trial(group, known, lags).run(differences);
  });
}

}  // namespace shm
