// ColumnState: what a component keeps of the elements that it has coded: what later ones are
// predicted from, and how well that went. Both directions change it alike.
//   state      a value as a number of the domain at hand
//   third      what the lattice missed at an element
//   reference  state and third of the value that an element refers to, where there are references
//   partner    the earlier element whose reference is as large as that of the element at hand
// spec: "Value columns"
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bytes/lists.h"
#include "values/neighbourhood.h"
#include "values/recalled_values.h"
#include "values/value_domain.h"
#include "values/value_predictor.h"

namespace shm {

/// Steps of translating what is kept by slot into other domains, for each element of a column: a
/// reader refuses more. Writers take half, since they may keep fewer slots. spec: "Limits"
inline constexpr std::uint64_t kMostMovesForEach = 4096;

/// How large a residual is: its bit length, raised by the scale of the prediction; 0: there is
/// none.
using ResidualSize = std::uint16_t;

/// What a component held in the last tile, by element.
struct CodedTile {
  std::vector<double> values;
  std::vector<ResidualSize> sizes;
};

/// A tile of one component, but for its values.
struct ColumnTile {
  std::span<const Neighbourhood> items;      ///< its elements, in order
  TileClasses classes;                       ///< the same for all components
  std::span<const CodedTile* const> before;  ///< of the components before this one
  /// Bits that the values refer to; empty unless use_reference() was called.
  std::span<const std::uint64_t> reference;
  /// How many elements before each one its value stood already, which is not coded; 0: it is.
  /// Empty: none did.
  std::span<const std::uint32_t> back;
  /// Decoding, where `back` has any: bits of the elements before the tile, the last one behind.
  std::span<const std::uint64_t> history;
};

/// The element of a tile that is coded.
struct TileElement {
  const ColumnTile& tile;
  std::size_t i;
  const Neighbourhood& item = tile.items[i];
  MatchTables::Places places{};  ///< of ColumnState::find_matches()
  /// Of ColumnState::find_partner(): the value that the element refers to, if it can have partners.
  struct Key {
    std::uint64_t magnitude = 0;
    bool is = false, negative = false;
  } key{};
  struct Partner {
    bool is = false;
    double state = 0.0, then = 0.0;  ///< of the partner, and of what it refers to
  } partner{};

  std::uint32_t of_class() const { return tile.classes.of_item[i]; }
  std::uint32_t back() const { return tile.back.empty() ? 0 : tile.back[i]; }
};

/// How large a residual is likely to be, by the sizes of others as they look from its prediction.
struct ResidualContext {
  std::uint32_t mean = 0;    ///< of the near elements
  std::uint32_t before = 0;  ///< of the component before: 0: there is none, 1: size 0, 2: more
};
/// The same in detail: sizes, plus one; 0 where there is none.
struct SizesAround {
  std::array<std::uint32_t, 3> near{};       ///< at the near elements
  std::uint32_t last = 0;                    ///< of the element coded last: the size itself
  std::uint32_t before = 0, two_before = 0;  ///< of the components before
};

/// What a column keeps of an element.
struct KeptElement {
  struct Reference {
    double state = 0, third = 0;
  };
  double state = 0, third = 0;
  ResidualSize size = 0;
  std::uint8_t marks = 0;
  Reference reference;
};

/// What a column keeps by slot.
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

/// Decoding: the memory of all columns of a segment. Where it becomes tight, a column in which all
/// slots but a few hold the same keeps these few alone, and borrows slots for the tile at hand;
/// what of that is more than was allowed is refused. It changes no values.
class ColumnMemory {
 public:
  /// What may be taken from here on, with what is taken already; it is tight beyond `plenty`.
  void allow(std::uint64_t bytes, std::uint64_t plenty) {
    most_ = bytes;
    plenty_ = plenty;
  }
  bool is_tight() const { return taken_ >= plenty_; }
  /// False, now and ever after, where there is not so much.
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

class ColumnState {
 public:
  ColumnState(std::shared_ptr<const ArrayInfo> info, std::size_t component);

  const ArrayInfo& info() const { return *info_; }
  const ValueDomain& domain() const { return domain_; }
  const ValueTranslator& translator() const { return translator_; }

  /// Before the first element: all tiles will come with a reference.
  void use_reference() { has_reference_ = true; }
  bool has_reference() const { return has_reference_; }
  /// Whether predictions look at matches, and at other components.
  void use_matches(bool uses) { uses_matches_ = uses; }

  /// Whether it may change to that domain: translating what it keeps by slot must stay in
  /// proportion to its elements, so that groups of few elements cannot demand it at will.
  bool may_change_to(const ValueDomain& domain, std::uint64_t most_moves_for_each) const {
    return domain.has_states_of(domain_) || moved_ <= elements_ * most_moves_for_each;
  }
  void change_domain(const ValueDomain& domain);

  /// Decoding, before the first element. It is borrowed.
  void use_memory(ColumnMemory& memory) { memory_ = &memory; }
  /// False where there is no memory for it.
  bool make_room(std::uint32_t slot) {
    if (slot < slots_.states.size()) return true;
    if (memory_ != nullptr) return make_room_in_memory(slot);
    slots_.make_room(slot, has_reference_);
    return true;
  }
  // Where elements were left out that no covered one looks at: as if they had been skipped, and as
  // if there were room for this slot.
  void count_left_out(std::uint64_t elements) { elements_ += elements; }
  void count_room(std::uint32_t slot) { room_ = size_with_room(room_, slot); }

  /// An element that the array does not cover: takes the state of the last one.
  void skip(const Neighbourhood& item) {
    ++elements_;
    stand_in(item);
  }
  /// The same before it is coded, to try something with its neighbours: it is not counted.
  void stand_in(const Neighbourhood& item);
  /// Values that another codec has coded.
  void keep_values(std::span<const Neighbourhood> items, std::span<const std::uint64_t> bits);

  /// False where there is no memory for it.
  bool begin_tile(const ColumnTile& tile);
  /// Decoding: behind the values of a tile. False where there is no memory for them.
  bool end_tile(std::span<const Neighbourhood> items) {
    return !borrows_ || give_slots_back(items);
  }
  const CodedTile& coded_tile() const { return coded_; }

  // --- what predictions are made of

  /// Before feature() and features().
  void find_matches(TileElement& element) const;
  /// Whether elements that refer to values of these magnitudes may be partners: they differ by so
  /// many units in the last place of a double at most.
  static bool may_be_partners(ScalarType type, std::uint64_t one, std::uint64_t other);
  /// Before feature() and features(). `reference`: bits that the element refers to.
  void find_partner(TileElement& element, std::uint64_t reference) const;
  /// The state of a feature, which must be known.
  double feature(const TileElement& element, std::uint32_t feature) const {
    return feature < kFThird ? slots_.states[element.item.at[feature]]
                             : farther_feature(element, feature);
  }
  /// All features; of those of the neighbourhood the ones in `known`, the others are left as they
  /// are.
  void features(const TileElement& element, std::uint32_t known,
                std::array<double, kFeatures>& states) const;
  /// The state of what an element refers to: any number, the same everywhere.
  double reference_state(std::uint64_t bits) const {
    const double state = translator_.from_value(scalar_as_double(info_->type, bits));
    return is_finite(state) ? state : last_reference_;
  }
  /// What is subtracted from a feature in a difference, but from that of the partner: `own`, the
  /// element's reference_state(), from what has none.
  double reference_feature(const Neighbourhood& item, std::uint32_t feature, double own) const {
    if (feature < kFThird) return slots_.references[item.at[feature]].state;
    if (feature < kFLast) return slots_.references[item.at[feature - kFThird]].third;
    if (feature >= kFMatch) return own;
    return feature == kFLast ? last_reference_ : before_last_reference_;
  }

  // --- how well that went

  // `scale`: of the prediction.
  ResidualContext residual_context(const TileElement& element, std::int32_t scale) const;
  SizesAround sizes_around(const TileElement& element, std::int32_t scale) const;
  /// How many near elements took the second prediction of their class.
  std::uint32_t seconds_near(const Neighbourhood& item) const {
    std::uint32_t count = 0;
    for (std::uint32_t a = 0; a < 3; ++a)
      if ((item.known >> a & 1) != 0) count += slots_.marks[item.at[a]] & kSecond;
    return count;
  }
  /// How many of them were recalled.
  std::uint32_t recalled_near(const Neighbourhood& item) const {
    std::uint32_t count = 0;
    for (std::uint32_t a = 0; a < 3; ++a)
      if ((item.known >> a & 1) != 0 && (slots_.marks[item.at[a]] & kRecalled) != 0) ++count;
    return count;
  }
  /// Values so far, where the domain recalls them.
  RecalledValues& values_so_far() { return so_far_; }
  void add_to_values_so_far(double state) {
    so_far_.add(SortedValues::magnitude_of(translator_.as_value(state)));
  }

  // --- what is kept of an element

  /// `lattice`: what the lattice predicted.
  void keep(const TileElement& element, double state, double lattice);
  void keep_reference(const Neighbourhood& item, double state);
  /// Of an element that is a copy: as large as the one that was coded last.
  void keep_copied(const TileElement& element) { keep_residual(element, last_size_, false, false); }
  void keep_residual(const TileElement& element, ResidualSize size, bool second, bool recalled) {
    slots_.marks[element.item.self] =
        static_cast<std::uint8_t>((second ? kSecond : 0u) | (recalled ? kRecalled : 0u));
    slots_.sizes[element.item.self] = size;
    coded_.sizes[element.i] = last_size_ = size;
  }

  /// Lends what is kept by slot, which is much, and has what is kept of these items put back when
  /// it is gone. The state that lends cannot be used meanwhile.
  class Loan;

 private:
  using Reference = KeptElement::Reference;
  // Marks: whether the second prediction was taken, and whether the value was recalled.
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
  /// What the component before is at this element.
  double other_value(const TileElement& element) const {
    const auto before = element.tile.before;
    return before.empty() || !uses_matches_
               ? 0.0
               : translator_.from_value(before.back()->values[element.i]);
  }

  std::shared_ptr<const ArrayInfo> info_;
  std::size_t component_;
  ValueDomain domain_;
  ValueTranslator translator_;
  bool has_reference_ = false, uses_matches_ = true;
  std::uint64_t elements_ = 0;  // so far
  std::size_t room_ = 0;        // slots of all elements, where some are left out
  std::uint64_t moved_ = 0;     // slots that were translated into another domain, in all

  ColumnSlots slots_;
  // Where memory is tight: that all slots hold the same, but for few; and how many slots there are.
  ColumnMemory* memory_ = nullptr;
  bool is_folded_ = false, borrows_ = false;
  KeptElement common_;
  std::vector<std::pair<std::uint32_t, KeptElement>> apart_;  // by slot
  std::size_t folded_slots_ = 0;
  CodedTile coded_;
  MatchTables matches_;
  RecalledValues so_far_;
  SortedValues references_so_far_;  // with the values that referred to them, as if to positive ones
  // of the elements coded last
  double last_ = 0, before_last_ = 0;
  double last_reference_ = 0, before_last_reference_ = 0;
  ResidualSize last_size_ = 0;
};

class ColumnState::Loan {
 public:
  Loan(ColumnState& lender, std::span<const Neighbourhood> items);
  /// To a copy of the lender.
  void lend(ColumnState& borrower) { borrower.slots_ = std::move(slots_); }
  void give_back(ColumnState& borrower);

 private:
  ColumnState& lender_;
  std::span<const Neighbourhood> items_;
  std::vector<KeptElement> kept_;  // by item
  ColumnSlots slots_;
};

}  // namespace shm
