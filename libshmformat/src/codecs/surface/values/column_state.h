// ColumnState: the data that one component stores about the elements coded so far. These are the
// states from which later elements are predicted, and the sizes of the residuals. Encoder and
// decoder update these data in the same way.
//   state      the double that predictions use: the value, or its index if the domain is linear
//   third      the residual of the lattice prediction at an element
//   reference  state and third of the reference value of an element, if the array has references
//   partner    of an element: an earlier element whose reference value has about the same magnitude
//              as the element's own reference value
//   recalled   values that are coded relative to an earlier value of the component
// spec: "Value columns", "Recalled values", "Partners"
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/lists.h"
#include "codecs/shared/neighbourhood.h"
#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/value_predictor.h"

namespace shm {

/// Limit on the work of converting states to other domains: the largest number of converted slots
/// for each element of the column. A reader refuses a column that exceeds this limit. A writer
/// stays below half of the limit, since a reader may have more slots than the writer.
/// spec: "Limits"
inline constexpr std::uint64_t kMostMovesForEach = 4096;

/// Size of a residual: 0 if the residual is zero, otherwise its bit length plus the scale of the
/// prediction.
using ResidualSize = std::uint16_t;

/// The values and residual sizes of one component in its most recent tile. Each list has one entry
/// for each element.
struct CodedTile {
  std::vector<double> values;
  std::vector<ResidualSize> sizes;
};

/// The data that are needed to code one component of a tile, except the values themselves.
struct ColumnTile {
  /// Neighbourhoods of the elements. They are the same for all components
  std::span<const Neighbourhood> items;
  TileClasses classes;  ///< classes of the elements; the same for all components
  std::span<const CodedTile* const> before;  ///< the components of this tile that have been coded
                                             ///< before this component

  /// Reference values, as bits. Empty unless use_reference() has been called
  std::span<const std::uint64_t> reference;
  /// For each element: the distance to the earlier element of which it is a copy, or 0 if it is not
  /// a copy. The list is empty if the tile has no copies
  std::span<const std::uint32_t> back;
  /// Used for decoding a tile with copies: bits of the elements before the tile; the most recent
  /// element comes last
  std::span<const std::uint64_t> history;
  /// The component in `before` whose values may predict the values of this component. Null if
  /// `before` is empty
  const CodedTile* source = nullptr;
};

/// The element that is being coded.
struct TileElement {
  const ColumnTile& tile;
  std::size_t i;
  const Neighbourhood& item = tile.items[i];
  MatchTables::Places places{};  ///< result of ColumnState::find_matches()

  /// Result of ColumnState::find_partner(): magnitude and sign of this element's reference value.
  /// The partner is an element whose reference value has about the same magnitude. `is`: true if
  /// the element can have a partner.
  struct Key {
    std::uint64_t magnitude = 0;
    bool is = false, negative = false;
  } key{};
  struct Partner {
    bool is = false;
    /// `state`: state of the partner's value. `then`: state of the partner's reference value
    double state = 0.0, then = 0.0;
  } partner{};

  std::uint32_t of_class() const { return tile.classes.of_item[i]; }
  std::uint32_t back() const { return tile.back.empty() ? 0 : tile.back[i]; }
};

/// Context for coding a residual: the expected size, derived from the sizes of earlier residuals.
/// Sizes are relative to the scale of the current prediction.
struct ResidualContext {
  std::uint32_t mean = 0;  ///< mean size of the residuals of the near elements

  /// Residual of the previous component at this element. 0: this is the first component. 1: the
  /// size is 0. 2: the size is larger than 0
  std::uint32_t before = 0;
};
/// Sizes of earlier residuals. Each size is stored plus one; 0 means that no such residual exists.
struct SizesAround {
  std::array<std::uint32_t, 3> near{};  ///< sizes at the near elements
  std::uint32_t last = 0;  ///< size for the previously coded element (stored without adding one)

  /// Sizes for this element in the previous component, and in the component before the previous one
  std::uint32_t before = 0, two_before = 0;
};

/// The data that a column stores for one element.
struct KeptElement {
  struct Reference {
    double state = 0, third = 0;
  };
  double state = 0, third = 0;
  ResidualSize size = 0;
  std::uint8_t marks = 0;
  Reference reference;
};

/// The data that a column stores for all elements, by slot.
struct ColumnSlots {
  std::vector<double> states, thirds;
  std::vector<ResidualSize> sizes;
  std::vector<std::uint8_t> marks;
  std::vector<KeptElement::Reference> references;

  void make_room(std::uint32_t slot, bool has_reference);
  KeptElement at(std::uint32_t slot) const {
    return {states[slot], thirds[slot], sizes[slot], marks[slot],
            references.empty() ? KeptElement::Reference() : references[slot]};
  }
  void set(std::uint32_t slot, const KeptElement& kept) {
    states[slot] = kept.state;
    thirds[slot] = kept.third;
    sizes[slot] = kept.size;
    marks[slot] = kept.marks;
    if (!references.empty()) references[slot] = kept.reference;
  }
};

/// Decoding: the memory budget that all columns of a segment share. When memory becomes scarce, a
/// column whose slots are nearly all equal stores only the slots that differ. It then expands them
/// into a buffer for each tile; all columns share this buffer. Requests that exceed the limit are
/// refused. The budget does not change decoded values.
class ColumnMemory {
 public:
  /// Sets the limit in bytes. Memory that is already in use counts towards the limit. Memory is
  /// scarce as soon as `plenty` bytes are in use.
  void allow(std::uint64_t bytes, std::uint64_t plenty) {
    most_ = bytes;
    plenty_ = plenty;
  }
  bool is_tight() const { return taken_ >= plenty_; }
  /// Reserves memory. Returns false if the limit would be exceeded. After it has returned false
  /// once, it always returns false.
  bool take(std::uint64_t bytes) {
    if (bytes > most_ - std::min(taken_, most_)) is_refused_ = true;
    if (!is_refused_) taken_ += bytes;
    return !is_refused_;
  }
  void give_back(std::uint64_t bytes) { taken_ -= bytes; }
  bool is_refused() const { return is_refused_; }

 private:
  friend class ColumnState;

  std::uint64_t most_ = ~std::uint64_t{0}, plenty_ = most_, taken_ = 0;
  bool is_refused_ = false;
  ColumnSlots for_tile_;
};

// --- earlier values by magnitude

/// The magnitudes that have occurred so far in a component, in ascending order. Each magnitude has
/// an associated value. The class finds the entry that is nearest to a magnitude, and the entry
/// with a given rank. It is used for recalled values and for partners.
class SortedValues {
 public:
  /// Largest number of entries. If the list is full, all entries are removed before the next entry
  /// is added. Frozen: part of the format.
  static constexpr std::size_t kMost = std::size_t{1} << 15;

  struct Entry {
    /// Bits of a double without the sign bit. As integers, these bits sort in the same order as the
    /// magnitudes
    std::uint64_t magnitude = 0;
    double value = 0.0;  ///< value added most recently with this magnitude
  };

  static std::uint64_t magnitude_of(double value) {
    return std::bit_cast<std::uint64_t>(value) & ~(std::uint64_t{1} << 63);
  }

  std::size_t size() const { return old_.size() + recent_.size(); }
  /// Returns the number of entries whose magnitude is less than `magnitude`.
  std::size_t rank_of(std::uint64_t magnitude) const {
    return static_cast<std::size_t>(place(old_, magnitude) + place(recent_, magnitude));
  }
  /// Returns the entry with this rank. Precondition: rank < size().
  const Entry& at(std::size_t rank) const {
    // Find `low` by binary search: the number of recent entries that are before the entry with this
    // rank.
    std::size_t low = rank > old_.size() ? rank - old_.size() : 0;
    std::size_t high = std::min(rank, recent_.size());
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      if (recent_[middle].magnitude < old_[rank - middle - 1].magnitude)
        low = middle + 1;
      else
        high = middle;
    }
    const std::size_t in_old = rank - low;
    if (in_old == old_.size()) return recent_[low];
    if (low == recent_.size()) return old_[in_old];
    return recent_[low].magnitude < old_[in_old].magnitude ? recent_[low] : old_[in_old];
  }
  /// Returns the entry whose magnitude is nearest. If two entries are equally near, returns the
  /// smaller entry. Returns null if the list is empty.
  const Entry* nearest(std::uint64_t magnitude) const {
    const Entry* found = nullptr;
    for (const auto* list : {&old_, &recent_}) {
      const auto position = static_cast<std::size_t>(place(*list, magnitude));
      for (std::size_t i = position == 0 ? 0 : position - 1; i < list->size() && i <= position; ++i)
        if (!found || is_nearer((*list)[i].magnitude, found->magnitude, magnitude))
          found = &(*list)[i];
    }
    return found;
  }

  void add(std::uint64_t magnitude, double value) {
    for (auto* list : {&old_, &recent_}) {
      const auto position = static_cast<std::size_t>(place(*list, magnitude));
      if (position == list->size() || (*list)[position].magnitude != magnitude) continue;
      (*list)[position].value = value;
      return;
    }
    if (size() == kMost) clear();
    recent_.insert(recent_.begin() + place(recent_, magnitude), {magnitude, value});
    if (recent_.size() == kRecent) merge();
  }
  void clear() {
    old_.clear();
    recent_.clear();
  }

 private:
  using List = std::vector<Entry>;  // entries in ascending order; no magnitude occurs twice
  static constexpr std::size_t kRecent = 256;

  static std::ptrdiff_t place(const List& list, std::uint64_t magnitude) {
    const auto below = [](const Entry& entry, std::uint64_t m) { return entry.magnitude < m; };
    return std::lower_bound(list.begin(), list.end(), magnitude, below) - list.begin();
  }
  static bool is_nearer(std::uint64_t one, std::uint64_t than, std::uint64_t to) {
    const auto distance = [to](std::uint64_t m) { return m < to ? to - m : m - to; };
    if (distance(one) != distance(than)) return distance(one) < distance(than);
    return one < than;
  }
  void merge() {
    const auto middle = static_cast<std::ptrdiff_t>(old_.size());
    if (old_.capacity() < old_.size() + kRecent && 2 * old_.size() >= kMost / 2)
      old_.reserve(kMost);
    old_.insert(old_.end(), recent_.begin(), recent_.end());
    std::inplace_merge(old_.begin(), old_.begin() + middle, old_.end(),
                       [](const Entry& a, const Entry& b) { return a.magnitude < b.magnitude; });
    recent_.clear();
  }

  List old_, recent_;  // no magnitude occurs in both lists
};

/// The earlier values of a component, accessible by magnitude and by number. A recalled value is
/// coded relative to one of them, its source. For each class, the object stores the most recent
/// source. The source of the next recalled value in the class is probably the value just after or
/// just before it.
class RecalledValues {
 public:
  bool empty() const { return list_.size() == 0; }
  const SortedValues& list() const { return list_; }

  /// The expected rank of a recalled value. The actual rank is coded relative to it.
  struct Start {
    std::size_t rank = 0;
    bool by_source = false;  ///< true if `rank` is the rank of the value just after or before the
                             ///< most recent source; false if it is the rank of the prediction
  };
  Start start(std::uint32_t of_class, std::uint64_t predicted) const {
    if (of_class < sources_.size() && sources_[of_class].trust >= kTrusted)
      if (const std::uint64_t* next = next_of(sources_[of_class]))
        return {list_.rank_of(*next), true};
    return {list_.rank_of(predicted), false};
  }
  /// Records that the current value has been coded relative to the entry with this rank. Call it
  /// before add().
  void take(std::uint32_t of_class, std::size_t rank) {
    if (of_class >= sources_.size()) sources_.resize(of_class + std::size_t{1});
    Source& source = sources_[of_class];
    const SortedValues::Entry& entry = list_.at(rank);
    const auto found = static_cast<std::int64_t>(entry.value);
    const auto here = static_cast<std::int64_t>(count_);
    if (source.known) {
      const std::uint64_t* next = next_of(source);
      if (next != nullptr && *next == entry.magnitude)
        source.trust = static_cast<std::uint8_t>(std::min(source.trust + 1, kMostTrust));
      else
        source.trust = static_cast<std::uint8_t>(std::max(source.trust - 1, 0));
      const std::int64_t gone = here - source.here;
      if (found - source.there == gone) source.direction = 1;
      if (found - source.there == -gone) source.direction = -1;
    }
    source.known = true;
    source.here = here;
    source.there = found;
  }
  /// Adds the current value.
  void add(std::uint64_t magnitude) {
    if (by_number_.size() < SortedValues::kMost)
      by_number_.push_back(magnitude);
    else
      by_number_[count_ % SortedValues::kMost] = magnitude;
    list_.add(magnitude, static_cast<double>(count_));
    ++count_;
  }

 private:
  static constexpr int kTrusted = 2, kMostTrust = 3;
  /// The most recent source of a class. `here`: number of the most recently recalled value.
  /// `there`: number of the source, the earlier value relative to which that value was coded.
  struct Source {
    std::int64_t here = 0, there = 0;
    std::int8_t direction = 1;
    std::uint8_t trust = 0;  // counts correct continuations, from 0 to kMostTrust
    bool known = false;
  };

  /// Returns the magnitude of the earlier value that is expected to be recalled next, if the
  /// sequence of sources of this class continues. Returns null if that value is no longer stored or
  /// does not exist.
  const std::uint64_t* next_of(const Source& source) const {
    const auto here = static_cast<std::int64_t>(count_);
    const std::int64_t next = source.there + source.direction * (here - source.here);
    if (next < 0 || next >= here) return nullptr;
    if (here - next > static_cast<std::int64_t>(SortedValues::kMost)) return nullptr;
    return &by_number_[static_cast<std::size_t>(next) % SortedValues::kMost];
  }

  SortedValues
      list_;  // maps each magnitude to the number of the most recent element with this magnitude
  std::vector<std::uint64_t> by_number_;  // recent magnitudes, by number modulo kMost
  std::vector<Source> sources_;           // sources of the classes, by class
  std::uint64_t count_ = 0;
};

// --- state

class ColumnState {
 public:
  ColumnState(std::shared_ptr<const ArrayInfo> info, std::size_t component);

  const ArrayInfo& info() const { return *info_; }
  const ValueDomain& domain() const { return domain_; }
  const ValueTranslator& translator() const { return translator_; }

  /// Declares that every tile has reference values. Call it before the first element.
  void use_reference() { has_reference_ = true; }
  bool has_reference() const { return has_reference_; }
  /// Sets whether predictions may use matches (earlier values with the same neighbouring values)
  /// and the values of other components.
  void use_matches(bool uses) { uses_matches_ = uses; }

  /// Returns true if the column may change to `domain`. The total number of converted slots must
  /// remain proportional to the number of elements. Otherwise a file with many tiny groups could
  /// cause unlimited work.
  bool may_change_to(const ValueDomain& domain, std::uint64_t most_moves_for_each) const {
    return domain.has_states_of(domain_) || moved_ <= elements_ * most_moves_for_each;
  }
  void change_domain(const ValueDomain& domain);

  /// Decoding: sets the memory budget. `memory` must outlive the column. Call this function before
  /// the first element.
  void use_memory(ColumnMemory& memory) { memory_ = &memory; }
  /// Allocates memory for a slot. Returns false if the memory budget does not allow this.
  bool make_room(std::uint32_t slot) {
    if (slot < slots_.states.size()) return true;
    if (memory_ != nullptr) return make_room_in_memory(slot);
    slots_.make_room(slot, has_reference_);
    return true;
  }
  // The next two functions are for sparse readers. A sparse reader omits elements on which no
  // covered element depends. These functions add the omitted elements to the counts, so that the
  // counts are equal to those in a reader that skips the elements one by one.
  void count_left_out(std::uint64_t elements) { elements_ += elements; }
  void count_room(std::uint32_t slot) { room_ = size_with_room(room_, slot); }

  /// Skips an element that the array does not cover. The element receives the state of the element
  /// before it.
  void skip(const Neighbourhood& item) {
    ++elements_;
    stand_in(item);
  }
  /// Does the same as skip(), but does not count the element. It is used in trials that need the
  /// states of neighbours.
  void stand_in(const Neighbourhood& item);
  /// Stores the states of values that were not coded with predictions.
  void keep_values(std::span<const Neighbourhood> items, std::span<const std::uint64_t> bits);

  /// Begins a tile. Returns false if the tile needs more memory than the memory budget allows.
  bool begin_tile(const ColumnTile& tile);
  /// Decoding: ends a tile. Call it after the values of the tile have been stored. Returns false if
  /// more memory is needed than the memory budget allows.
  bool end_tile(std::span<const Neighbourhood> items) {
    return !borrows_ || give_slots_back(items);
  }
  const CodedTile& coded_tile() const { return coded_; }

  // --- inputs of the predictions

  /// Looks up an element in the match tables. Call it before feature() and features().
  void find_matches(TileElement& element) const;
  /// Returns true if two elements with reference values of these magnitudes may be partners. The
  /// bits of the magnitudes, read as integers, must not differ by more than a fixed limit.
  static bool may_be_partners(ScalarType type, std::uint64_t one, std::uint64_t other);
  /// Finds the partner of an element. Call it before feature() and features(). `reference`: the
  /// bits of the element's reference value.
  void find_partner(TileElement& element, std::uint64_t reference) const;
  /// Returns the state of a feature. Precondition: the feature is known.
  double feature(const TileElement& element, std::uint32_t feature) const {
    return feature < kFThird ? slots_.states[element.item.at[feature]]
                             : farther_feature(element, feature);
  }
  /// Stores the features of an element in `states`. A feature of the neighbourhood is stored only
  /// if its bit in `known` is set; the other entries of `states` do not change.
  void features(const TileElement& element, std::uint32_t known,
                std::array<double, kFeatures>& states) const;
  /// Returns the state of a reference value. `bits`: the bits of the value; every bit pattern is
  /// allowed. The result is the same on all machines.
  double reference_state(std::uint64_t bits) const {
    const double state = translator_.from_value(scalar_as_double(info_->type, bits));
    return is_finite(state) ? state : last_reference_;
  }
  /// Returns the reference state that belongs to a feature. Differences are computed by subtracting
  /// it from the feature. Precondition: `feature` is not the feature of the partner. `own`:
  /// reference_state() of the element; it is returned for features without a reference of their
  /// own.
  double reference_feature(const Neighbourhood& item, std::uint32_t feature, double own) const {
    if (feature < kFThird) return slots_.references[item.at[feature]].state;
    if (feature < kFLast) return slots_.references[item.at[feature - kFThird]].third;
    if (feature >= kFMatch) return own;
    return feature == kFLast ? last_reference_ : before_last_reference_;
  }

  // --- sizes of residuals

  // `scale`: scale of the prediction; see the scale() functions in value_domain.h.
  ResidualContext residual_context(const TileElement& element, std::int32_t scale) const;
  SizesAround sizes_around(const TileElement& element, std::int32_t scale) const;
  /// Returns the number of near neighbours that were predicted by the second mode of their class.
  std::uint32_t seconds_near(const Neighbourhood& item) const {
    std::uint32_t count = 0;
    for (std::uint32_t a = 0; a < 3; ++a)
      if ((item.known >> a & 1) != 0) count += slots_.marks[item.at[a]] & kSecond;
    return count;
  }
  /// Returns the number of near elements that were recalled.
  std::uint32_t recalled_near(const Neighbourhood& item) const {
    std::uint32_t count = 0;
    for (std::uint32_t a = 0; a < 3; ++a)
      if ((item.known >> a & 1) != 0 && (slots_.marks[item.at[a]] & kRecalled) != 0) ++count;
    return count;
  }
  /// Returns the list of the values coded so far. The list is filled only if the domain has
  /// recalled values.
  RecalledValues& values_so_far() { return so_far_; }
  void add_to_values_so_far(double state) {
    so_far_.add(SortedValues::magnitude_of(translator_.as_value(state)));
  }

  // --- updates after an element

  /// Stores the state of a coded element. `lattice`: the lattice prediction of the element.
  void keep(const TileElement& element, double state, double lattice);
  void keep_reference(const Neighbourhood& item, double state);
  /// Stores the residual size and the marks of a copied element. A copy has no residual, so it
  /// receives the residual size of the previously coded element.
  void keep_copied(const TileElement& element) { keep_residual(element, last_size_, false, false); }
  void keep_residual(const TileElement& element, ResidualSize size, bool second, bool recalled) {
    slots_.marks[element.item.self] =
        static_cast<std::uint8_t>((second ? kSecond : 0u) | (recalled ? kRecalled : 0u));
    slots_.sizes[element.item.self] = size;
    coded_.sizes[element.i] = last_size_ = size;
  }

  /// Returns the slots. The caller may move them to a copy of this state, and later move them back.
  ColumnSlots& slots() { return slots_; }

 private:
  using Reference = KeptElement::Reference;
  // Bits of the marks of an element. kSecond: the second mode predicted the value. kRecalled: the
  // value was recalled.
  static constexpr std::uint32_t kSecond = 1, kRecalled = 2;

  bool make_room_in_memory(std::uint32_t slot);
  bool fold();
  void unfold();
  void borrow_slots(std::span<const Neighbourhood> items);
  bool give_slots_back(std::span<const Neighbourhood> items);
  void keep_apart(std::uint32_t slot, const KeptElement& kept);
  std::uint64_t bytes_of_slots(std::size_t slots) const;

  double farther_feature(const TileElement& element, std::uint32_t feature) const;
  double match(std::uint32_t kind, const TileElement& element) const {
    return uses_matches_ ? translator_.from_value(matches_.find(kind, element.places[kind])) : 0.0;
  }
  /// Returns the value of the source component at this element. The value is converted to a state
  /// in the domain of this component.
  double other_value(const TileElement& element) const {
    const CodedTile* const source = element.tile.source;
    return source == nullptr || !uses_matches_ ? 0.0
                                               : translator_.from_value(source->values[element.i]);
  }

  std::shared_ptr<const ArrayInfo> info_;
  std::size_t component_;
  ValueDomain domain_;
  ValueTranslator translator_;
  bool has_reference_ = false, uses_matches_ = true;
  std::uint64_t elements_ = 0;  // number of elements so far
  std::size_t room_ = 0;  // number of slots for all elements, including omitted elements; 0 if no
                          // elements are omitted
  std::uint64_t moved_ = 0;  // total number of slots converted to other domains

  ColumnSlots slots_;
  // Data for scarce memory. memory_: the budget. is_folded_: true if nearly all slots have the
  // contents common_ and only the other slots are stored, in apart_. borrows_: true if the column
  // has borrowed a full set of slots. folded_slots_: number of slots.
  ColumnMemory* memory_ = nullptr;
  bool is_folded_ = false, borrows_ = false;
  KeptElement common_;
  std::vector<std::pair<std::uint32_t, KeptElement>>
      apart_;  // slots whose contents differ from common_, in ascending order
  std::size_t folded_slots_ = 0;
  CodedTile coded_;
  MatchTables matches_;
  RecalledValues so_far_;
  // Maps the magnitude of an element's reference value to the element's value; the value is negated
  // if the reference value is negative
  SortedValues references_so_far_;
  // States of the two most recently coded elements
  double last_ = 0, before_last_ = 0;
  double last_reference_ = 0, before_last_reference_ = 0;
  ResidualSize last_size_ = 0;
};

// --- states of values

/// Returns the state for a value that has no index or no finite state: the state of the lattice
/// prediction, rounded to the domain.
double substitute(const auto& space, double lattice) {
  const double state = space.state(space.index(lattice));
  return is_finite(state) ? state : 0.0;
}

/// Returns the state of the value that has this index.
double state_of(const auto& space, std::int64_t index, double lattice) {
  const double state = space.state(index);
  return is_finite(state) ? state : substitute(space, lattice);
}

/// Returns the state of a copied value. The domain need not contain the value, since copied values
/// are not coded in the domain.
double state_of_copy(const auto& space, const ColumnState& column, std::uint64_t bits,
                     double lattice) {
  const double state = column.translator().from_value(scalar_as_double(column.info().type, bits));
  return is_finite(state) ? state : substitute(space, lattice);
}

}  // namespace shm
