#include "codecs/weighted/weighted_history.h"

#include <utility>

#include "codecs/shared/value_domain.h"

namespace shm {

void WeightedHistory::find_neighbours(const WeightedClasses& classes, const TiledItems& elements,
                                      std::size_t slots) {
  constexpr std::size_t kEarlier = 7, kNear = 3;
  constexpr std::uint32_t kNoElement = ~std::uint32_t{0};
  std::vector<std::uint32_t> element_of(slots, kNoElement);  // most recent element of each slot
  neighbours_.resize(classes.covered());
  classes.for_each(
      elements, [&](const Neighbourhood& item) { element_of[item.self] = kNoElement; },
      [&](const Neighbourhood& item, std::uint32_t, std::size_t e) {
        const auto self = static_cast<std::uint32_t>(e);
        auto& neighbours = neighbours_[e];
        neighbours.fill(self);
        for (std::size_t k = 0; k < kEarlier; ++k) {
          if ((item.known >> k & 1) == 0) continue;
          const std::uint32_t neighbour = element_of[item.at[k]];
          if (neighbour == kNoElement) continue;
          neighbours[k] = neighbour;
          if (k < kNear) neighbours_[neighbour][kEarlier + k] = self;
        }
        element_of[item.self] = self;
      });
}

void WeightedHistory::set_values(std::vector<double> last, std::span<const double> trend) {
  last_ = std::move(last);
  changes_.resize(trend.size());
  for (std::size_t e = 0; e < trend.size(); ++e) changes_[e] = trend[e] - last_[e];
}

auto WeightedHistory::terms_of(std::size_t element) const -> Terms {
  Terms terms{};
  const auto& neighbours = neighbours_[element];
  const auto add = [&](std::span<const double> values, std::size_t first) {
    for (std::size_t k = 0; k < kNeighbours; ++k)
      terms[first + k] = values[neighbours[k]] - values[element];
  };
  add(last_, 0);
  if (changes_.empty()) return terms;
  terms[kNeighbours] = changes_[element];
  add(changes_, kNeighbours + 1);
  return terms;
}

std::vector<double> WeightedHistory::predict(std::span<const double> weights) const {
  std::vector<double> predicted;
  predicted.reserve(last_.size());
  for (std::size_t e = 0; e < last_.size(); ++e) {
    const Terms terms = terms_of(e);
    double sum = last_[e];
    for (std::size_t k = 0; k < weights.size(); ++k) sum += weights[k] * terms[k];
    predicted.push_back(is_finite(sum) ? sum : last_[e]);
  }
  return predicted;
}

}  // namespace shm
