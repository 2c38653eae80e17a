// WeightedEncoder: encodes the groups of an array with the codec `weighted`. It fits the weights of
// each class of neighbourhoods to a sample of the values (least squares), and keeps them only if
// they save more bits than they need.
// spec: "Weighted values"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "codecs/weighted/weighted_column.h"

namespace shm {

class WeightedEncoder : public WeightedColumn {
 public:
  using WeightedColumn::WeightedColumn;

  /// Encodes a group. `values`: values of the covered elements. `reference`: their reference
  /// values; empty if the group has none. Precondition: the group has covered elements.
  std::vector<std::byte> encode(const TiledItems& elements, std::span<const std::byte> values,
                                const ReferenceValues& reference);

 private:
  /// Returns true if it pays to try a history for the current group.
  bool may_have_history(const ReferenceValues& reference) const {
    return !reference.empty() && classes_.covered() >= kFewestHistory;
  }
  /// Smallest number of elements of a group for which a history is tried.
  static constexpr std::size_t kFewestHistory = 64;

  /// The values of one component.
  struct Values {
    ValueDomain domain;
    std::vector<std::uint64_t> words;  ///< bits
    std::vector<std::int64_t> indices;
    std::vector<std::size_t> exceptions;  ///< positions of values that the domain does not contain
  };
  /// An element of the sample to which weights are fitted.
  struct Row {
    double target = 0, reference = 0;
    std::int64_t index = 0;
    std::array<double, kWeightedTerms + 1> x{};  ///< the base, then each term

    double predict(const ClassWeights& weights) const {
      double sum = weights.scale * x[0];
      for (std::uint32_t t = 0; t < weights.terms; ++t)
        sum += weights.weight[t] * x[weights.term[t] + 1u];
      return sum;
    }
  };

  [[gnu::cold]] Values values_of(std::span<const std::byte> values, std::size_t component) const;
  void encode_component(const Values& values, std::size_t component, const TiledItems& elements,
                        const ReferenceValues& reference_values, ByteWriter& out);
  template <class Space>
  std::vector<std::byte> encode_residuals(const Space& space, const Values& values,
                                          std::size_t component, const TiledItems& elements,
                                          std::span<const double> reference, std::uint32_t axis);
  [[gnu::cold]] std::uint32_t choose_axis(const Values& values, const TiledItems& elements) const;
  /// The rows of each class.
  using Sample = std::vector<std::vector<Row>>;
  // The following functions use std::function instead of templates, which makes them smaller. They
  // process a sample of the values only.
  using StateOf = std::function<double(std::int64_t index)>;
  using IndexOf = std::function<std::int64_t(double prediction)>;
  using BitsWith = std::function<double(const ClassWeights&)>;
  [[gnu::cold]] Sample sample(const StateOf& state_of, const Values& values, std::size_t component,
                              const TiledItems& elements, std::span<const double> reference) const;
  /// The weights of all classes, and their coded form.
  struct ChosenWeights {
    double bits = 0;  ///< approximate number of bits of the residuals and of the weights
    std::vector<ClassWeights> weights;
    std::vector<std::byte> bytes;
  };
  [[gnu::cold]] ChosenWeights choose_weights(const IndexOf& index_of, const Sample& sample,
                                             bool has_reference) const;
  [[gnu::cold]] std::vector<double> fit_history(const StateOf& state_of, const Values& values,
                                                ByteWriter& out) const;
  struct FittedWeights {
    double bits = 0;  ///< of the residuals and of the weights
    ClassWeights weights;
    std::vector<std::int64_t> numbers;  ///< coded weights
  };
  static FittedWeights fit(std::span<const Row> rows, std::uint32_t known, bool has_reference,
                           double least, const BitsWith& bits_with);
};

}  // namespace shm
