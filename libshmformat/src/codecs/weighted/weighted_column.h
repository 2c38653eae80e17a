// WeightedColumn: codes the values of an array, group by group. The *state* of an element is its
// value, or, if the group has reference values, its value minus its reference value. A component
// may also have a history (weighted_history.h). The prediction from it then takes the place of the
// reference value. The state is predicted as a weighted sum of the states of earlier elements
// nearby. Elements whose known neighbours are alike form a class. The encoder computes the weights
// of each class (weighted_encoder.h) and writes them to the stream. The lengths of the residuals
// are coded with static models (length_coder.h), and all other bits of the residuals are stored as
// they are. The files are about as small as with the codec `columns`, but coding is many times
// faster, because nothing adapts. spec: "Weighted values"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/binary.h"
#include "codecs/shared/reference_values.h"
#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/column_coder.h"
#include "codecs/weighted/length_coder.h"
#include "codecs/weighted/weighted_classes.h"
#include "codecs/weighted/weighted_history.h"
#include "shm/schema.h"

namespace shm {

/// Denominator of coded weights, and the largest magnitude of a coded weight. Frozen: part of the
/// format.
inline constexpr std::int32_t kWeightUnit = 4096, kMostCodedWeight = 65535;

/// Bit of a component's head that is set if the component has a history. Frozen: part of the
/// format.
inline constexpr std::uint32_t kHistoryBit = 32;

/// The space of evenly spaced values: the multiples of a step, plus a minimum. Unlike in
/// LinearSpace, the state of an index is its value, except that it may be rounded differently. With
/// a relative error bound, the state is the index.
struct EvenSpace {
  double minimum = 0, down = 1, up = 1;

  /// Returns the space of a domain of the kind binary, decimal, quantized or integers.
  static EvenSpace of(const ArrayInfo& info, std::size_t component, const ValueDomain& domain);
  std::int64_t index(double prediction) const {
    return nearest_integer((prediction - minimum) * up);
  }
  double state(std::int64_t index) const { return minimum + static_cast<double>(index) * down; }
  static std::int32_t scale(double) { return 0; }
};

/// Sizes of elements whose residual is 0, and of elements whose value is a matched value.
inline constexpr std::int32_t kZeroSize = std::numeric_limits<std::int32_t>::min(),
                              kMatchedSize = kZeroSize + 1;

/// Data of an element from which later elements are predicted.
struct WeightedSlot {
  double state = 0, third = 0;
  std::int64_t index = 0;
  std::int32_t size = 0;  ///< length of the residual plus Space::scale(), or one of the sizes above
};

/// Returns the index of the value with the opposite sign.
constexpr std::int64_t negated_index(std::int64_t index, bool is_float) {
  return is_float ? ~index : minus(0, index);
}

/// Finds values of earlier elements that have the same neighbour along one axis. In a mesh with
/// mirrored or repeated parts, the values of the elements are then often the same, or negated.
class MatchedValues {
 public:
  /// Begins a group of `count` elements. `axis`: 0 to 2; or kNoAxis if no values are matched.
  void begin(std::uint32_t axis, std::size_t count);
  static constexpr std::uint32_t kNoAxis = 3;

  /// Returns the index that is likely for an element with this neighbourhood; 0 if none is known.
  /// `is_float`: true if indices are those of floating-point numbers.
  std::int64_t find(const Neighbourhood& item, std::span<const WeightedSlot> slots, bool is_float);
  /// Stores the index of the element for which find() was called.
  void remember(std::int64_t index);
  bool is_on() const { return axis_ != kNoAxis; }

 private:
  std::uint32_t axis_ = kNoAxis;
  int shift_ = 0;
  std::vector<std::int64_t> table_;  // indices, negated if the index of the neighbour was negative
  // Of the element for which find() was called
  std::size_t place_ = 0;
  bool has_place_ = false, is_negated_ = false, is_float_ = false;
};

/// The data of one component that is kept from group to group.
struct WeightedComponent {
  std::vector<WeightedSlot> slots;
  WeightedSlot last;  ///< of the previous element

  double base(const ClassWeights& weights, const Neighbourhood& item) const {
    return weights.base == kWeightedTerms ? last.state : slots[item.at[weights.base]].state;
  }
  double term(std::uint32_t k, const Neighbourhood& item, double base) const {
    return k < kWeightedNeighbours ? slots[item.at[k]].state - base
                                   : slots[item.at[k - kWeightedNeighbours]].third;
  }
  double predict(const ClassWeights& weights, const Neighbourhood& item) const {
    const double from = base(weights, item);
    double sum = weights.scale * from;
    for (std::uint32_t t = 0; t < weights.terms; ++t)
      sum += weights.weight[t] * term(weights.term[t], item, from);
    return sum;
  }
  /// Stores the state of the element.
  void set_state(const Neighbourhood& item, double state, std::int64_t index, std::int32_t size);
  /// Stores the data of the previous element for an element that is not covered.
  void skip(const Neighbourhood& item) { slots[item.self] = last; }
};

/// Returns the context of the length of an element's residual. `scale`: Space::scale() of the
/// prediction.
std::uint32_t length_context(const WeightedComponent& component, const Neighbourhood& item,
                             std::int32_t scale);

/// The parts of WeightedColumn that the encoder and the decoder share.
class WeightedColumn {
 public:
  /// `blocks`: element blocks that the array covers; empty if it covers all blocks.
  WeightedColumn(const ArrayInfo& info, std::vector<std::uint32_t> blocks)
      : info_(std::make_shared<ArrayInfo>(info)),
        blocks_(std::move(blocks)),
        width_(scalar_bytes(info.type)),
        components_(info.components) {}

  /// Allocates memory for `slots` slots.
  void make_room(std::uint32_t slots);
  /// Returns the number of bytes of memory that `slots` slots need.
  std::uint64_t room_for(std::uint32_t slots) const {
    return std::uint64_t{slots} * sizeof(WeightedSlot) * components_.size();
  }

 protected:
  /// The result of coding a value: whether it is the matched value, otherwise its residual.
  struct Coded {
    bool is_matched = false;
    std::int64_t residual = 0;
  };
  /// Predicts and codes one component. Calls code(e, predicted, context, match) for the value of
  /// each covered element `e`. `predicted` and `match` are indices; `context` is that of the length
  /// of the residual. code() returns a Coded.
  template <class Space, class Code>
  void walk(const Space& space, WeightedComponent& component, const TiledItems& elements,
            std::span<const double> reference, Code&& code);
  /// Sets the history of a component. `values`: its reference values, as reference_of() returns
  /// them.
  void begin_history(const ReferenceValues& reference, const ValueDomain& domain,
                     std::size_t component, const std::vector<double>& values);
  /// Gives component `to` the data of component `from` for all elements of the group.
  void copy_component(std::size_t from, std::size_t to, const TiledItems& elements);
  /// Calls visit(space) with the space of a domain.
  template <class Visit>
  void with_space(std::size_t component, const ValueDomain& domain, Visit&& visit) const;
  /// Returns values of an earlier step of a component, as states of the domain. Values that are not
  /// finite become 0. `values`: the values of all components; may be empty.
  std::vector<double> reference_of(std::span<const std::byte> values, const ValueDomain& domain,
                                   std::size_t component) const;
  std::size_t stride() const { return width_ * components_.size(); }

  std::shared_ptr<const ArrayInfo> info_;
  std::vector<std::uint32_t> blocks_;
  std::size_t width_;
  std::vector<WeightedComponent> components_;
  // Data of the current group
  WeightedClasses classes_;
  std::vector<ClassWeights> weights_;  // by class
  MatchedValues matches_;
  WeightedHistory history_;
};

class WeightedDecoder : public WeightedColumn {
 public:
  using WeightedColumn::WeightedColumn;

  /// Decodes a group and appends the values of its covered elements to `out`. `reference`: their
  /// reference values; empty if the group has none. Returns false if the data is damaged.
  bool decode(const TiledItems& elements, std::span<const std::byte> bytes,
              const ReferenceValues& reference, std::vector<std::byte>& out);

 private:
  /// A value that the domain does not contain. `position`: number of covered elements before it.
  struct Exception {
    std::uint64_t position = 0, bits = 0;
  };
  [[gnu::cold]] bool read_exceptions(ByteReader& in);
  [[gnu::cold]] bool read_weights(ByteReader& in, bool has_reference);
  [[gnu::cold]] bool read_history(ByteReader& in, std::vector<double>& reference);
  bool decode_component(ByteReader& in, std::uint8_t head, std::size_t c,
                        const TiledItems& elements, const ReferenceValues& reference,
                        std::vector<std::uint64_t>& words);

  std::vector<Exception> exceptions_;
  bool has_neighbours_ = false;  // true if history_ has found the neighbours of the group
  LengthDecoder lengths_;
};

// --- implementation of the templates

template <class Space, class Code>
void WeightedColumn::walk(const Space& space, WeightedComponent& component,
                          const TiledItems& elements, std::span<const double> reference,
                          Code&& code) {
  constexpr bool kIsFloat = !std::is_same_v<Space, EvenSpace>;
  classes_.for_each(
      elements, [&](const Neighbourhood& item) { component.skip(item); },
      [&](const Neighbourhood& item, std::uint32_t of_class, std::size_t e) {
        const double from = reference.empty() ? 0.0 : reference[e];
        const double prediction = from + component.predict(weights_[of_class], item);
        const std::int32_t scale = space.scale(prediction);
        const std::int64_t predicted = space.index(prediction);
        const std::int64_t match =
            matches_.is_on() ? matches_.find(item, component.slots, kIsFloat) : 0;
        const Coded coded = code(e, predicted, length_context(component, item, scale), match);
        const std::int64_t index = coded.is_matched ? match : plus(predicted, coded.residual);
        const std::int32_t size =
            coded.is_matched      ? kMatchedSize
            : coded.residual == 0 ? kZeroSize
                                  : static_cast<std::int32_t>(bit_length(coded.residual)) + scale;
        if (matches_.is_on()) matches_.remember(index);
        component.set_state(item, space.state(index) - from, index, size);
      });
}

template <class Visit>
void WeightedColumn::with_space(std::size_t component, const ValueDomain& domain,
                                Visit&& visit) const {
  if (domain.is_linear())
    visit(EvenSpace::of(*info_, component, domain));
  else if (domain.kind == DomainKind::narrow || info_->type == ScalarType::float32)
    visit(FloatSpace<float>());
  else
    visit(FloatSpace<double>());
}

}  // namespace shm
