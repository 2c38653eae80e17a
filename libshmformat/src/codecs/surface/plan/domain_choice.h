// Chooses the domain of one component in a group.
//   GroupSample     a sample of the elements of the group
//   estimate_cost   estimates the size of the sample in a domain
//   EarlierValues   decides whether recalled values or partners save enough to be used
//   DomainChooser   chooses among the candidates of value_domain.h, by the functions above
//
// Rule: domain_candidates() proposes domains. A component uses the candidate with the smallest
// estimated size: the size of about a thousand elements spread over the group, plus the size of the
// table. Nothing is coded for the estimate. The elements are predicted with suitable modes, and the
// estimate adds up the lengths of the residuals, the entropy of these lengths, and the cost of
// marking second modes. Modes are chosen for the first candidate only, and also used for the
// remaining candidates.
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

/// Returns a part of a list that has one entry for each element, or no entries. In the second case,
/// the part is empty.
template <class T>
std::span<const T> part_of(const std::vector<T>& all, std::size_t begin, std::size_t count) {
  return std::span<const T>(all).subspan(all.empty() ? 0 : begin, all.empty() ? 0 : count);
}

/// A copy of `original`, for trying one tile of these items in another domain. Destroying the trial
/// restores the original. The copy borrows the slots of the original if both domains have the same
/// states. Otherwise all slots change, so they are copied. `Original`: ColumnState or
/// ComponentCoder.
template <class Original>
class Trial {
 public:
  /// The trial refers to `original` and `items`. The original must not be used while the trial
  /// exists.
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
  std::vector<KeptElement> kept_;  // by item: contents of the slots before the trial
  std::optional<Original> copy_;
};

/// A sample of the elements of a group, for one component.
struct GroupSample {
  ValueDomain domain;  ///< the domain of the states
  InputsOfElements inputs;
  std::vector<std::uint64_t> bits;    ///< values, by element
  std::vector<std::uint32_t> places;  ///< by element: its position in the group, ascending

  /// Returns true if the element at `place` in a group of `of` elements belongs to the sample. The
  /// sample has about a thousand elements that are spread without a period.
  static bool takes(std::size_t place, std::size_t of) {
    constexpr std::uint64_t kElements = 1024;
    const std::uint32_t turn = static_cast<std::uint32_t>(place) * 0x9e3779b1u;
    return turn * std::uint64_t{of} < kElements << 32;
  }
};

/// Estimated size of a sample in bits, without its copied elements.
struct SampleCost {
  double bits = 0;                     ///< estimated size of the sample
  std::vector<double> by_element;      ///< estimated size by element; 0 if copied
  std::vector<std::uint32_t> lengths;  ///< bit length of the residual, by element; 0 if copied
  std::vector<double> predicted;       ///< predicted value, by element; 0 if copied
};

/// Estimates the size of a sample in a domain. `families`: by class. `matches`: see
/// choose_modes(). `modes`: by class; if `modes` is empty, the function chooses modes and stores
/// them in it.
SampleCost estimate_cost(const ArrayInfo& info, std::size_t component,
                         const DomainAndTable& candidate, const GroupSample& sample,
                         std::span<const std::uint16_t> families, bool matches,
                         std::vector<ClassModes>& modes);

class EarlierValues {
 public:
  /// `bits`: all values of one component in a group, in coding order. `reference`: their reference
  /// values, or empty. The constructor does not keep either.
  EarlierValues(const ArrayInfo& info, std::size_t component, const ValueDomain& domain,
                std::span<const std::uint64_t> bits, std::span<const std::uint64_t> reference);

  /// Returns false if choose() would certainly set neither `recalls` nor `partners`.
  bool may_help() const;
  /// A value of a sample, and how it would be coded without recalled values and partners.
  struct Value {
    std::uint32_t place = 0;   ///< number of the value in the group
    double predicted = 0;      ///< prediction from the neighbours
    double bits = 0;           ///< estimated cost of the value in bits
    std::uint32_t length = 0;  ///< bit length of its residual
  };
  /// Sets `recalls` and `partners` of the domain according to a sample of the values. `has_table`:
  /// true if the values are coded as ranks in a table. Returns the estimated number of bits saved
  /// in the sample.
  double choose(std::span<const Value> values, bool has_table, ValueDomain& domain) const;

 private:
  /// Bit lengths of the residuals of a value against the best earlier values: as a recalled value
  /// and with a partner.
  struct Missed {
    std::uint8_t recalled, partnered;
    bool follows;  // whether the value continues the sequence of the last recalled value
  };
  static constexpr std::uint8_t kNothing = 255;  // length that means that there is no earlier value

  std::vector<Missed> missed_;             // residual lengths, by value
  std::vector<std::uint64_t> magnitudes_;  // magnitudes, by value

  // Number of values that could be recalled, and number of values that could have a partner
  std::uint64_t recallable_ = 0, partners_ = 0;
};
/// The group for which domains are chosen. It refers to data of the caller.
struct GroupToPlan {
  const TiledItems& elements;
  ColumnStyle style;                       ///< style of the samples
  const std::vector<std::uint32_t>& back;  ///< see ColumnTile::back, for the whole group
};

/// Chooses domains of a column in a group. The column does not change, except that classes of the
/// group are numbered.
class DomainChooser {
 public:
  using Bits = std::vector<std::uint64_t>;  // values of one component, by covered element

  DomainChooser(ColumnCoder<SplitEncoder>& column, const GroupToPlan& group)
      : column_(column), group_(group) {}

  /// Returns the best of these candidates, and decides whether it recalls values and has partners.
  /// `reference`: reference values, or empty.
  RatedDomain choose(std::size_t component, const Bits& bits, const Bits& reference,
                     std::vector<DomainAndTable> candidates);
  /// Adapts the estimated size of a domain to the elements of this group.
  void rescale(RatedDomain& rated, std::size_t component, const Bits& bits);
  /// Returns the values of a component, except the values of copies.
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
