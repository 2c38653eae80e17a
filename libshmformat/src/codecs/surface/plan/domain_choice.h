// Chooses the domain of one component in a group.
//   GroupSample     a sample of the elements of the group
//   estimate_cost   estimates the size of the sample in a domain
//   EarlierValues   decides whether recalled values or partners save enough to be used
//   DomainChooser   chooses among the candidates of value_domain.h; uses all of the above
//
// domain_candidates() proposes several domains. A component uses the candidate with the smallest
// estimated size: the size of about a thousand elements that are spread over the group, plus the
// size of the table. Nothing is coded for the estimate. Modes are chosen for the first candidate
// and used for all candidates. The elements are predicted with these modes. The estimate is the sum
// of the lengths of the residuals, the entropy of these lengths, and the cost of marking elements
// that use second modes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "codecs/shared/neighbourhood.h"
#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/column_coder.h"
#include "codecs/surface/values/value_predictor.h"

namespace shm {

/// Calls visit(tile) for each tile.
template <class Visit>
void for_each_tile(const TiledItems& elements, Visit&& visit) {
  for (std::size_t t = 0; t < elements.tile_begin.size(); ++t) visit(elements.tile(t));
}

/// Returns the entries of `count` elements, from element `begin` on. `all` has one entry for each
/// element or is empty. If it is empty, so is the result.
template <class T>
std::span<const T> part_of(const std::vector<T>& all, std::size_t begin, std::size_t count) {
  return std::span<const T>(all).subspan(all.empty() ? 0 : begin, all.empty() ? 0 : count);
}

/// A copy of `original` for a trial that codes one tile, with the elements `items`, in another
/// domain. When the trial is destroyed, the original is restored. If values have the same states in
/// both domains, the copy borrows the slots (the stored states) of the original. Otherwise the
/// contents of all slots differ between the domains, so the slots are copied. `Original`:
/// ColumnState or ComponentCoder.
template <class Original>
class Trial {
 public:
  /// The trial refers to `original` and `items`. Do not use `original` while the trial exists.
  Trial(Original& original, std::span<const Neighbourhood> items, const ValueDomain& domain)
      : lender_(state_of(original)), items_(items) {
    ColumnSlots slots;
    if (lender_.domain().has_states_of(domain)) {
      lends_ = true;
      for (const Neighbourhood& item : items) lender_.make_room(item.self);
      slots = std::move(lender_.slots());
      lender_.slots() = {};
      kept_.reserve(items.size());
      for (const Neighbourhood& item : items) kept_.push_back(slots.at(item.self));
    }
    copy_.emplace(original);
    if (lends_) state_of(*copy_).slots() = std::move(slots);
  }
  ~Trial() {
    if (!lends_) return;
    lender_.slots() = std::move(state_of(*copy_).slots());
    for (std::size_t i = 0; i < items_.size(); ++i) lender_.slots().set(items_[i].self, kept_[i]);
  }
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;

  Original* operator->() { return &*copy_; }
  Original& operator*() { return *copy_; }

 private:
  static ColumnState& state_of(ColumnState& state) { return state; }
  static ColumnState& state_of(ComponentCoder<SplitEncoder>& component) {
    return component.state();
  }

  ColumnState& lender_;
  std::span<const Neighbourhood> items_;
  bool lends_ = false;
  std::vector<KeptElement> kept_;  // for each item: the contents of its slot before the trial
  std::optional<Original> copy_;
};

/// A sample of the elements of a group, with the values of one component.
struct GroupSample {
  ValueDomain domain;  ///< the domain of the states
  InputsOfElements inputs;
  std::vector<std::uint64_t> bits;    ///< values, by element
  std::vector<std::uint32_t> places;  ///< for each element of the sample: its position in the
                                      ///< group; ascending

  /// Returns true if the element at position `place` in a group of `of` elements belongs to the
  /// sample. The sample has about a thousand elements, spread over the group at irregular
  /// intervals.
  static bool takes(std::size_t place, std::size_t of) {
    constexpr std::uint64_t kElements = 1024;
    const std::uint32_t turn = static_cast<std::uint32_t>(place) * 0x9e3779b1u;
    return turn * std::uint64_t{of} < kElements << 32;
  }
};

/// Estimated size in bits of a sample. Copied elements are not counted.
struct SampleCost {
  double bits = 0;                     ///< estimated size of the sample
  std::vector<double> by_element;      ///< estimated size by element; 0 if copied
  std::vector<std::uint32_t> lengths;  ///< for each element: bit length of its residual; 0 if the
                                       ///< element is copied
  std::vector<double> predicted;       ///< predicted value, by element; 0 if copied
};

/// Estimates the size of a sample in a domain. `families`: for each class of neighbourhoods, the
/// number of its family (a group of similar classes). `matches`: see choose_modes(). `modes`: the
/// modes of each class; if `modes` is empty, the function chooses modes and stores them in `modes`.
SampleCost estimate_cost(const ArrayInfo& info, std::size_t component,
                         const DomainAndTable& candidate, const GroupSample& sample,
                         std::span<const std::uint16_t> families, bool matches,
                         std::vector<ClassModes>& modes);

class EarlierValues {
 public:
  /// `bits`: the values of one component of all elements of a group, in coding order. `reference`:
  /// their reference values; empty if none exist. Both are used only during the call.
  EarlierValues(const ArrayInfo& info, std::size_t component, const ValueDomain& domain,
                std::span<const std::uint64_t> bits, std::span<const std::uint64_t> reference);

  /// Returns false if choose() would certainly leave `recalls` and `partners` unset.
  bool may_help() const;
  /// A value of a sample, with its estimated cost if it is predicted only from its neighbours, i.e.
  /// not recalled and not predicted from a partner.
  struct Value {
    std::uint32_t place = 0;   ///< number of the value in the group
    double predicted = 0;      ///< prediction from the neighbours
    double bits = 0;           ///< estimated cost of the value in bits
    std::uint32_t length = 0;  ///< bit length of its residual
  };
  /// Sets the flags `recalls` and `partners` of the domain, according to a sample of the values.
  /// `has_table`: true if the values are coded as ranks in a table. Returns the estimated number of
  /// bits that the flags save in the sample.
  double choose(std::span<const Value> values, bool has_table, ValueDomain& domain) const;

 private:
  /// Bit lengths of two residuals of a value: from the best value that can be recalled, and from
  /// the value of the partner.
  struct Missed {
    std::uint8_t recalled, partnered;
    // True if this value and the best value to recall have the same distance, or the same sum of
    // their positions, as a recent pair of values
    bool follows;
  };
  static constexpr std::uint8_t kNothing =
      255;  // residual length that is stored if no earlier value can predict the value

  std::vector<Missed> missed_;             // residual lengths, by value
  std::vector<std::uint64_t> magnitudes_;  // magnitudes, by value

  // Number of values that could be recalled, and number of values that a partner could predict
  std::uint64_t recallable_ = 0, partners_ = 0;
};
/// The group for which domains are chosen. The struct contains references to the caller's data.
struct GroupToPlan {
  const TiledItems& elements;
  ColumnStyle style;                       ///< style of the samples
  const std::vector<std::uint32_t>& back;  ///< see ColumnTile::back, for the whole group
};

/// Chooses domains for the components of a group. It does not change the column, except that it
/// assigns numbers to classes of the group.
class DomainChooser {
 public:
  using Bits = std::vector<std::uint64_t>;  // values of one component, by covered element

  DomainChooser(ColumnCoder<SplitEncoder>& column, const GroupToPlan& group)
      : column_(column), group_(group) {}

  /// Returns the best of the candidates, with the flags that state whether values are recalled and
  /// elements have partners. `reference`: reference values; empty if none exist.
  RatedDomain choose(std::size_t component, const Bits& bits, const Bits& reference,
                     std::vector<DomainAndTable> candidates);
  /// Estimates the size of a domain again after the neighbourhoods have changed: multiplies the old
  /// estimate by the ratio of the new cost to the old cost of a sample.
  void rescale(RatedDomain& rated, std::size_t component, const Bits& bits);
  /// Returns the values of the elements that are not copies.
  Bits coded(const Bits& bits) const;

 private:
  GroupSample sample(std::size_t component, const Bits& bits, const Bits& reference);
  void add_to_sample(ColumnState& state, const ColumnTile& tile,
                     std::span<const std::uint64_t> bits, std::size_t place, std::size_t of,
                     GroupSample& sample) const;
  std::size_t table_bytes(std::size_t component, const DomainAndTable& candidate);
  std::vector<EarlierValues::Value> coded_values(const GroupSample& sample,
                                                 const SampleCost& cost) const;
  const ArrayInfo& info() const { return column_.info(); }

  ColumnCoder<SplitEncoder>& column_;
  GroupToPlan group_;
};

}  // namespace shm
