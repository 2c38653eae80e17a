#include "codecs/weighted/weighted_classes.h"

#include <algorithm>
#include <bit>

namespace shm {

ClassWeights ClassWeights::zero(std::uint32_t known) {
  ClassWeights weights;
  known &= (1u << kWeightedTerms) - 1;
  if (known != 0) weights.base = static_cast<std::uint32_t>(std::countr_zero(known));
  weights.scale = 0;
  return weights;
}

ClassWeights ClassWeights::usual(std::uint32_t known) {
  ClassWeights weights = zero(known);
  weights.scale = 1;
  std::array<double, kWeightedTerms> w{};
  const auto has = [&](std::uint32_t k) { return (known >> k & 1) != 0; };
  if ((known & Neighbourhood::kLattice) == Neighbourhood::kLattice) {
    w = {1, 1, 1, -1, -1, -1, 1};
  } else {
    // The mean of the parallelogram rules; without a known parallelogram, the mean of the near
    // elements; without near elements, the mean of all others.
    double rules = 0;
    for (std::uint32_t i = 0; i < 3; ++i) {
      const auto [a, b] = kFaceAxes[i];
      if (!has(a) || !has(b) || !has(kAtDiagonal + i)) continue;
      rules += 1;
      w[a] += 1;
      w[b] += 1;
      w[kAtDiagonal + i] -= 1;
    }
    if (rules == 0) {
      const bool has_near = (known & 7) != 0;
      for (std::uint32_t k = 0; k < (has_near ? 3 : kWeightedNeighbours); ++k) {
        if (!has(k)) continue;
        rules += 1;
        w[k] = 1;
      }
    }
    if (rules > 1)
      for (double& weight : w) weight /= rules;
  }
  for (std::uint32_t k = 0; k < kWeightedTerms; ++k)
    if (k != weights.base && w[k] != 0) weights.add(k, w[k]);
  return weights;
}

void WeightedClasses::find(const TiledItems& elements, std::span<const std::uint32_t> blocks) {
  of_element_.clear();
  known_.clear();
  counts_.clear();
  is_covered_.clear();
  numbers_.assign(64, {0, 0});
  std::uint32_t last_key = 0, last_number = 0;
  for (std::size_t i = 0; i < elements.items.size(); ++i) {
    if (!blocks.empty()) {
      is_covered_.push_back(std::binary_search(blocks.begin(), blocks.end(), elements.blocks[i]));
      if (!is_covered_.back()) continue;
    }
    const Neighbourhood& item = elements.items[i];
    const std::uint32_t key = item.known | static_cast<std::uint32_t>(item.kind) << kWeightedTerms;
    if (known_.empty() || key != last_key) {
      last_key = key;
      last_number = number_of(key);
    }
    of_element_.push_back(last_number);
    ++counts_[last_number];
  }
}

std::uint32_t WeightedClasses::number_of(std::uint32_t key) {
  const auto place = [&](std::uint32_t of) {
    std::size_t at = (of * 0x9e3779b1u >> 8) & (numbers_.size() - 1);
    while (numbers_[at].second != 0 && numbers_[at].first != of)
      at = (at + 1) & (numbers_.size() - 1);
    return at;
  };
  if (const auto [found, number] = numbers_[place(key)]; number != 0) return number - 1;
  known_.push_back(key & 0xffff);
  counts_.push_back(0);
  numbers_[place(key)] = {key, static_cast<std::uint32_t>(known_.size())};
  if (2 * known_.size() > numbers_.size()) {
    const auto old = std::exchange(numbers_, {});
    numbers_.assign(2 * old.size(), {0, 0});
    for (const auto& [of, number] : old)
      if (number != 0) numbers_[place(of)] = {of, number};
  }
  return static_cast<std::uint32_t>(known_.size()) - 1;
}

}  // namespace shm
