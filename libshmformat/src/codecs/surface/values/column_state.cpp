#include "codecs/surface/values/column_state.h"

#include <algorithm>
#include <bit>

namespace shm {
namespace {

/// Returns a residual size relative to the scale of a prediction.
std::uint32_t relative(ResidualSize size, std::int32_t scale) {
  return size == 0 ? 0u : static_cast<std::uint32_t>(std::clamp<std::int32_t>(size - scale, 1, 64));
}

}  // namespace

ColumnState::ColumnState(std::shared_ptr<const ArrayInfo> info, std::size_t component)
    : info_(std::move(info)),
      component_(component),
      domain_{is_float(info_->type)
                  ? (info_->quantization.bits > 0 ? DomainKind::quantized : DomainKind::floats)
                  : DomainKind::integers,
              0, false, true},
      translator_(*info_, component, domain_) {}

void ColumnState::change_domain(const ValueDomain& domain) {
  const ValueTranslator next(*info_, component_, domain);
  if (!domain.has_states_of(domain_)) {
    moved_ += room_ > 0 ? room_ : is_folded_ ? folded_slots_ : slots_.states.size();
    const auto translate = [&](double state) {
      const double moved = next.from_value(translator_.as_value(state));
      return is_finite(moved) ? moved : 0.0;
    };
    for (double& state : slots_.states) state = translate(state);
    for (Reference& reference : slots_.references) reference = {translate(reference.state), 0.0};
    const auto translate_kept = [&](KeptElement& kept) {
      kept.state = translate(kept.state);
      kept.third = 0.0;
      if (has_reference_) kept.reference = {translate(kept.reference.state), 0.0};
    };
    translate_kept(common_);
    for (auto& [slot, kept] : apart_) translate_kept(kept);
    for (double* state : {&last_, &before_last_, &last_reference_, &before_last_reference_})
      *state = translate(*state);
    std::fill(slots_.thirds.begin(), slots_.thirds.end(), 0.0);
  }
  domain_ = domain;
  translator_ = next;
}

void ColumnSlots::make_room(std::uint32_t slot, bool has_reference) {
  if (slot < states.size()) return;
  shm::make_room(states, slot);
  const std::size_t last = states.size() - 1;
  shm::make_room(thirds, last);
  shm::make_room(sizes, last);
  shm::make_room(marks, last);
  if (has_reference) shm::make_room(references, last);
}

// --- tight memory

namespace {

bool same(const KeptElement& a, const KeptElement& b) {
  const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value); };
  return bits(a.state) == bits(b.state) && bits(a.third) == bits(b.third) && a.size == b.size &&
         a.marks == b.marks && bits(a.reference.state) == bits(b.reference.state) &&
         bits(a.reference.third) == bits(b.reference.third);
}

constexpr std::size_t kMostApart = 32;

}  // namespace

std::uint64_t ColumnState::bytes_of_slots(std::size_t slots) const {
  const std::size_t each =
      2 * sizeof(double) + sizeof(ResidualSize) + 1 + (has_reference_ ? sizeof(Reference) : 0);
  return std::uint64_t{slots} * each;
}

/// Allocates memory for a slot, within the memory budget. Only slots of earlier elements are read,
/// and these have been allocated before. Precondition: the column does not borrow slots.
bool ColumnState::make_room_in_memory(std::uint32_t slot) {
  if (memory_->is_refused()) return false;
  if (is_folded_) {
    folded_slots_ = std::max(folded_slots_, size_with_room(folded_slots_, slot));
    return true;
  }
  const std::size_t now = slots_.states.size(), then = size_with_room(now, slot);
  if (memory_->is_tight() && fold()) {
    folded_slots_ = then;
    return true;
  }
  if (!memory_->take(bytes_of_slots(then - now))) return false;
  slots_.make_room(slot, has_reference_);
  return true;
}

/// Saves memory if nearly all slots have the same contents: stores these contents once, and the
/// exceptions in a short list. If there are too many exceptions, returns false and changes nothing.
bool ColumnState::fold() {
  const std::size_t count = slots_.states.size();
  common_ = count == 0 ? KeptElement() : slots_.at(static_cast<std::uint32_t>(count - 1));
  apart_.clear();
  for (std::uint32_t s = 0; s < count; ++s) {
    const KeptElement kept = slots_.at(s);
    if (same(kept, common_)) continue;
    if (apart_.size() == kMostApart) {
      apart_.clear();
      return false;
    }
    apart_.emplace_back(s, kept);
  }
  memory_->give_back(bytes_of_slots(count));
  slots_ = {};
  folded_slots_ = count;
  is_folded_ = true;
  return true;
}

/// Allocates all slots again. Does nothing if the memory budget does not allow this.
void ColumnState::unfold() {
  if (!memory_->take(bytes_of_slots(folded_slots_))) return;
  is_folded_ = false;
  if (folded_slots_ > 0) {
    const auto last = static_cast<std::uint32_t>(folded_slots_ - 1);
    slots_.make_room(last, has_reference_);
    for (std::uint32_t s = 0; s <= last; ++s) slots_.set(s, common_);
  }
  for (const auto& [slot, kept] : apart_) slots_.set(slot, kept);
  apart_.clear();
}

/// Borrows the set of slots that the columns of a segment share. Fills in the slots of `items` and
/// of their neighbours.
void ColumnState::borrow_slots(std::span<const Neighbourhood> items) {
  slots_ = std::move(memory_->for_tile_);
  borrows_ = true;
  if (has_reference_ && slots_.references.size() < slots_.states.size())
    slots_.references.resize(slots_.states.size());
  if (folded_slots_ > 0)
    slots_.make_room(static_cast<std::uint32_t>(folded_slots_ - 1), has_reference_);
  for (const Neighbourhood& item : items) {
    slots_.set(item.self, common_);
    for (const std::uint32_t slot : item.at)
      if (slot < folded_slots_) slots_.set(slot, common_);
  }
  for (const auto& [slot, kept] : apart_) slots_.set(slot, kept);
}

bool ColumnState::give_slots_back(std::span<const Neighbourhood> items) {
  borrows_ = false;
  ColumnSlots borrowed = std::move(slots_);
  slots_ = {};
  // After the first tile, use the contents of the tile's final element as common_, the contents
  // that most slots are assumed to have.
  if (elements_ == items.size() && !items.empty()) common_ = borrowed.at(items.back().self);
  for (const Neighbourhood& item : items) {
    const KeptElement kept = borrowed.at(item.self);
    if (is_folded_)
      keep_apart(item.self, kept);
    else
      slots_.set(item.self, kept);
    if (memory_->is_refused()) return false;
  }
  memory_->for_tile_ = std::move(borrowed);
  return true;
}

/// Sets the contents of a slot. Precondition: is_folded_.
void ColumnState::keep_apart(std::uint32_t slot, const KeptElement& kept) {
  const auto position =
      std::lower_bound(apart_.begin(), apart_.end(), slot,
                       [](const auto& entry, std::uint32_t s) { return entry.first < s; });
  const bool is_there = position != apart_.end() && position->first == slot;
  if (same(kept, common_)) {
    if (is_there) apart_.erase(position);
    return;
  }
  if (is_there)
    position->second = kept;
  else
    apart_.insert(position, {slot, kept});
  if (apart_.size() > kMostApart) unfold();
}

// --- updates

void ColumnState::stand_in(const Neighbourhood& item) {
  if (!make_room(item.self)) return;
  if (is_folded_ && !borrows_) {
    KeptElement kept;
    kept.state = last_;
    if (has_reference_) kept.reference = {last_reference_, 0.0};
    return keep_apart(item.self, kept);
  }
  slots_.states[item.self] = last_;
  slots_.thirds[item.self] = 0.0;
  slots_.sizes[item.self] = 0;
  slots_.marks[item.self] = 0;
  if (has_reference_) slots_.references[item.self] = {last_reference_, 0.0};
}

void ColumnState::keep_values(std::span<const Neighbourhood> items,
                              std::span<const std::uint64_t> bits) {
  if (memory_ != nullptr) {
    std::uint32_t most_slot = 0;
    for (const Neighbourhood& item : items) most_slot = std::max(most_slot, item.self);
    if (!items.empty() && !make_room(most_slot)) return;
    if (is_folded_) borrow_slots(items);
  }
  for (std::size_t i = 0; i < items.size(); ++i) {
    const double value = translator_.from_value(scalar_as_double(info_->type, bits[i]));
    skip(items[i]);
    if (is_finite(value)) slots_.states[items[i].self] = value;
    before_last_ = last_;
    last_ = slots_.states[items[i].self];
    last_size_ = 0;
    if (!has_reference_) continue;
    slots_.references[items[i].self] = {last_, 0.0};
    before_last_reference_ = last_reference_;
    last_reference_ = last_;
  }
  end_tile(items);
}

bool ColumnState::begin_tile(const ColumnTile& tile) {
  elements_ += tile.items.size();
  coded_.sizes.resize(tile.items.size());
  if (uses_matches_) {
    coded_.values.resize(tile.items.size());
    matches_.expect(tile.items.size());
  }
  std::uint32_t most_slot = 0;
  for (const Neighbourhood& item : tile.items) most_slot = std::max(most_slot, item.self);
  if (!make_room(most_slot)) return false;
  if (is_folded_) borrow_slots(tile.items);
  return true;
}

void ColumnState::find_matches(TileElement& element) const {
  if (!uses_matches_) return;
  const Neighbourhood& item = element.item;
  const auto before = element.tile.before;
  std::array<MatchTables::Key, kMatchKinds> keys;
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((item.known >> a & 1) != 0) keys[0].add(slots_.states[item.at[a]]);
  keys[1].add(last_);
  keys[1].add(before_last_);
  for (std::size_t c = 0; c < before.size() && c < 2; ++c)
    keys[2].add(before[before.size() - 1 - c]->values[element.i]);
  element.places = {keys[0].place(), keys[1].place(), keys[2].place()};
}

bool ColumnState::may_be_partners(ScalarType type, std::uint64_t one, std::uint64_t other) {
  const std::uint64_t reach = std::uint64_t{1} << (type == ScalarType::float32 ? 37 : 24);
  return (one < other ? other - one : one - other) <= reach;
}

void ColumnState::find_partner(TileElement& element, std::uint64_t reference) const {
  if (!domain_.partners) return;
  const double then = scalar_as_double(info_->type, reference);
  if (!is_finite(then)) return;
  element.key = {SortedValues::magnitude_of(then), true, then < 0};
  const auto* found = references_so_far_.nearest(element.key.magnitude);
  if (found == nullptr) return;
  if (!may_be_partners(info_->type, element.key.magnitude, found->magnitude)) return;
  const auto magnitude = std::bit_cast<double>(found->magnitude);
  const auto state = [&](double value) {
    const double translated = translator_.from_value(element.key.negative ? -value : value);
    return is_finite(translated) ? translated : 0.0;
  };
  element.partner = {true, state(found->value), state(magnitude)};
}

double ColumnState::farther_feature(const TileElement& element, std::uint32_t feature) const {
  if (feature < kFLast) return slots_.thirds[element.item.at[feature - kFThird]];
  if (feature == kFPartner) return element.partner.state;
  if (feature == kFOther) return other_value(element);
  if (feature >= kFMatch) return match(feature - kFMatch, element);
  return feature == kFLast ? last_ : before_last_;
}

void ColumnState::features(const TileElement& element, std::uint32_t known,
                           std::array<double, kFeatures>& states) const {
  const Neighbourhood& item = element.item;
  for (std::uint32_t f = 0; f < kFThird; ++f)
    if ((known >> f & 1) != 0) states[f] = slots_.states[item.at[f]];
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((known >> (kFThird + a) & 1) != 0) states[kFThird + a] = slots_.thirds[item.at[a]];
  states[kFLast] = last_;
  states[kFBeforeLast] = before_last_;
  states[kFPartner] = element.partner.state;
  if (!uses_matches_) return;
  for (std::uint32_t m = 0; m < kMatchKinds; ++m) states[kFMatch + m] = match(m, element);
  states[kFOther] = other_value(element);
}

ResidualContext ColumnState::residual_context(const TileElement& element,
                                              std::int32_t scale) const {
  const Neighbourhood& item = element.item;
  std::uint32_t sum = 0, count = 0;
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((item.known >> a & 1) != 0) {
      sum += relative(slots_.sizes[item.at[a]], scale);
      ++count;
    }
  const std::uint32_t mean = count == 0   ? relative(last_size_, scale)
                             : count == 1 ? sum
                             : count == 2 ? (sum + 1) / 2
                                          : (sum + 1) / 3;
  const auto before = element.tile.before;
  return {mean, before.empty() ? 0u : before.back()->sizes[element.i] == 0 ? 1u : 2u};
}

SizesAround ColumnState::sizes_around(const TileElement& element, std::int32_t scale) const {
  SizesAround sizes;
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((element.item.known >> a & 1) != 0)
      sizes.near[a] = relative(slots_.sizes[element.item.at[a]], scale) + 1;
  sizes.last = relative(last_size_, scale);
  const auto before = element.tile.before;
  if (!before.empty()) sizes.before = relative(before.back()->sizes[element.i], scale) + 1;
  if (before.size() >= 2)
    sizes.two_before = relative(before[before.size() - 2]->sizes[element.i], scale) + 1;
  return sizes;
}

void ColumnState::keep(const TileElement& element, double state, double lattice) {
  const Neighbourhood& item = element.item;
  slots_.thirds[item.self] = item.has_rule() ? state - lattice : 0.0;
  slots_.states[item.self] = state;
  before_last_ = last_;
  last_ = state;
  if (element.key.is) {
    const double value = translator_.as_value(state);
    references_so_far_.add(element.key.magnitude, element.key.negative ? -value : value);
  }
  if (!uses_matches_) return;
  coded_.values[element.i] = translator_.as_value(state);
  matches_.remember(element.places, coded_.values[element.i]);
}

void ColumnState::keep_reference(const Neighbourhood& item, double state) {
  const auto at = [&](std::uint32_t feature) { return reference_feature(item, feature, state); };
  const double third = item.has_rule() ? state - Predictor(item.traits(), at).lattice() : 0.0;
  slots_.references[item.self] = {state, third};
  before_last_reference_ = last_reference_;
  last_reference_ = state;
}

}  // namespace shm
