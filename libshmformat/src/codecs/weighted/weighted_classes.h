// WeightedClasses: the elements of a group, classified by which of their neighbours are known.
// ClassWeights: how the values of a class are predicted.
// spec: "Weighted values"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "codecs/surface/values/column_coder.h"

namespace shm {

/// Number of terms of a prediction: the states of the neighbours in Neighbourhood::at, and then the
/// thirds of the three near elements. (The third of an element is the difference between its state
/// and the state that the lattice rule predicts.) Term i is known if bit i of Neighbourhood::known
/// is set.
inline constexpr std::uint32_t kWeightedNeighbours = 13, kWeightedTerms = 16;

/// How the states of a class are predicted. The base is the state of the first known neighbour, or
/// of the previous element if no neighbour is known. The prediction is scale * base plus the sum of
/// weight * (state of the neighbour - base) and of weight * third.
struct ClassWeights {
  std::uint32_t base = kWeightedTerms;  ///< kWeightedTerms: the previous element
  std::uint32_t terms = 0;              ///< number of terms with a weight
  double scale = 1;
  std::array<std::uint8_t, kWeightedTerms> term{};
  std::array<double, kWeightedTerms> weight{};

  /// Returns the weights of a class if none are coded. `known`: the bits of Neighbourhood::known.
  [[gnu::cold]] static ClassWeights usual(std::uint32_t known);
  /// Returns weights that predict 0.
  static ClassWeights zero(std::uint32_t known);
  void add(std::uint32_t of_term, double by) {
    term[terms] = static_cast<std::uint8_t>(of_term);
    weight[terms++] = by;
  }
};
/// Calls visit(term) for each term of a class that is not the base and has a coded weight.
template <class Visit>
void for_each_term(std::uint32_t known, Visit&& visit) {
  const std::uint32_t others = known & (known - 1);  // without the base
  for (std::uint32_t k = 0; k < kWeightedTerms; ++k)
    if ((others >> k & 1) != 0) visit(k);
}

/// The elements of a group, by class.
class WeightedClasses {
 public:
  /// Classifies the covered elements of a group.
  [[gnu::cold]] void find(const TiledItems& elements, std::span<const std::uint32_t> blocks);

  /// Number of covered elements.
  std::size_t covered() const { return of_element_.size(); }
  /// The bits of Neighbourhood::known of each class, in the order in which the classes first occur.
  std::span<const std::uint32_t> known() const { return known_; }
  std::span<const std::uint32_t> counts() const { return counts_; }
  /// Calls skip(item) for each element that the array does not cover, and visit(item, class, e) for
  /// each covered element. `e` is the number of covered elements before this one. In each tile, the
  /// elements that are not covered come first.
  template <class Skip, class Visit>
  void for_each(const TiledItems& elements, Skip&& skip, Visit&& visit) const {
    std::size_t e = 0;
    for (std::size_t t = 0; t < elements.tile_begin.size(); ++t) {
      const auto items = elements.tile(t).items;
      const std::size_t begin = elements.tile_begin[t];
      if (!is_covered_.empty())
        for (std::size_t i = 0; i < items.size(); ++i)
          if (!is_covered_[begin + i]) skip(items[i]);
      for (std::size_t i = 0; i < items.size(); ++i) {
        if (!is_covered_.empty() && !is_covered_[begin + i]) continue;
        visit(items[i], of_element_[e], e);
        ++e;
      }
    }
  }

 private:
  std::uint32_t number_of(std::uint32_t key);

  std::vector<std::uint32_t> of_element_, known_, counts_;
  std::vector<bool> is_covered_;  // by element; empty if all elements are covered
  std::vector<std::pair<std::uint32_t, std::uint32_t>> numbers_;  // hash table: key, number + 1
};

}  // namespace shm
