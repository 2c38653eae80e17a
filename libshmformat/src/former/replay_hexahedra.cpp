#include "former/replay_hexahedra.h"

#include <algorithm>
#include <bit>

#include "bytes/lists.h"

namespace shm {
namespace {

constexpr std::uint64_t kEarlierCells = 256;  // frozen: part of the format
constexpr std::uint64_t kLeastSlots = 1024;

constexpr std::uint8_t bit(std::uint32_t i) { return static_cast<std::uint8_t>(1u << i); }

}  // namespace

bool ReplayHexahedra::code(RangeDecoder& symbols, RangeDecoder&, CellTopology& cell, bool) {
  Numbers number{};
  std::uint8_t marks = 0;
  next_ = strays_ = 0;
  if (!keep_) largest_ = surface_->next_id() - 1;
  beside_now_ = beside_of(distances_[0]);
  const bool model_hit = reaches(distances_[0]) && past(distances_[0]).guessed;
  const Guess first = guess(distances_[0], distances_[0], beside_now_);
  const bool hit = symbols.bit(hit_[model_hit ? 1 : 0][hits_]);
  hits_ = (hits_ << 1 | (hit ? 1u : 0u)) & 7;
  if (hit) {
    number = first.number;
    marks = first.marks;
    if (!resolve(cell, number)) return false;
  } else if (!code_miss(symbols, cell, number, marks)) {
    return false;
  }
  finish(cell, number, marks);
  return true;
}

/// What is expected of a cell that stands to the one `beside` before as the one `distance` before
/// stood to its own; the shift between the two is taken `over` a distance.
auto ReplayHexahedra::guess(std::uint64_t distance, std::uint64_t over, std::uint64_t beside) const
    -> Guess {
  if (kept() == 0) return {};
  Guess it;
  if (!reaches(distance) || over + beside > kept()) {
    it.number = numbers(1);
    it.marks = past(1).marks;
    return it;
  }
  const Past& model = past(distance);
  it.number = numbers(distance);
  const Numbers here = numbers(beside), there = numbers(over + beside);
  for (std::size_t c = 0; c < 8; ++c) it.number[c] += here[c] - there[c];
  std::uint64_t next = largest_ + 1;
  for (std::uint32_t left = model.next; left != 0; left &= left - 1)
    it.number[static_cast<std::size_t>(std::countr_zero(left))] = next++;
  it.marks = model.marks;
  if (marks_shift_)
    it.marks ^= static_cast<std::uint8_t>(past(beside).marks ^ past(over + beside).marks);
  return it;
}

// --- what is not as expected

bool ReplayHexahedra::code_miss(RangeDecoder& symbols, CellTopology& cell, Numbers& number,
                                std::uint8_t& marks) {
  Choice choice;
  const std::uint64_t before = distances_[0];
  if (!code_choice_of_guess(symbols, choice)) return false;
  const Guess it = guess(distances_[0], choice.old_shift ? before : distances_[0], beside_now_);
  if (symbols.bit(as_guessed_[choice.place]))
    number = it.number;
  else if (!code_corners(symbols, it, number))
    return false;
  if (!resolve(cell, number)) return false;
  code_marks(symbols, it.marks, marks);
  return true;
}

bool ReplayHexahedra::code_choice_of_guess(RangeDecoder& symbols, Choice& choice) {
  choice.place = code_tree(symbols, place_[last_place_], 0);
  if (choice.place == kFollowStrays && may_follow_ && !follows_strays_) {
    follows_strays_ = true;
    followers_.resize(std::size_t{1} << kFollowerBits);
    choice.place = code_tree(symbols, place_[last_place_], 0);
  }
  if (choice.place > kDistances) return false;
  last_place_ = choice.place;
  choice.beside = code_tree(symbols, beside_[choice.place], 0);
  const std::uint64_t before = distances_[0];
  const std::uint64_t distance =
      choice.place == kDistances
          ? before + static_cast<std::uint64_t>(code_signed(symbols, distance_, 0))
          : distances_[choice.place];
  beside_now_ = beside_of(distance, choice.beside);
  if (choice.beside > 1 && !reaches(beside_now_)) return false;
  if (choice.place == 0) return true;
  if (!reaches(distance)) return false;
  choice.old_shift = symbols.bit(old_shift_);
  if (choice.old_shift && !reaches(before)) return false;
  for (std::uint32_t i = std::min(choice.place, kDistances - 1); i > 0; --i)
    distances_[i] = distances_[i - 1];
  distances_[0] = distance;
  return true;
}

bool ReplayHexahedra::code_corners(RangeDecoder& symbols, const Guess& guess, Numbers& number) {
  std::uint32_t differ = 0, state = 0;
  std::uint64_t step = 0;
  const Numbers previous = kept() > 0 ? numbers(1) : Numbers{};
  const std::uint8_t likely = follows_strays_ ? likely_strays() : std::uint8_t{0};
  for (std::uint32_t c = 0; c < 8; ++c) {
    if (symbols.bit(same_[likely >> c & 1][c][state])) {
      number[c] = guess.number[c];
      state = differ > 0 ? 1 : 0;
      continue;
    }
    const std::uint64_t moved = guess.number[c] + step;
    const std::uint64_t expected = differ > 0 || !follows_strays_ ? moved : next_stray(c);
    const std::uint32_t kind = code_tree(symbols, kind_[c][last_kind_], 0);
    last_kind_ = kind;
    switch (kind) {
      case kExpected: number[c] = expected; break;
      case kBeyond: number[c] = largest_ + 1; break;
      case kTop: number[c] = top_[c] + 1; break;
      case kPrevious: number[c] = previous[code_tree(symbols, previous_[c], 0)]; break;
      case kEarlier: {
        const std::uint64_t age = code_number(symbols, age_[c], 0);
        if (age >= kEarlierCells || age + 2 > kept()) return false;
        number[c] = numbers(age + 2)[code_tree(symbols, earlier_[c], 0)];
        break;
      }
      case kFromPrevious:
      case kStep: {
        auto& model = step_[kind == kFromPrevious ? 2 : differ > 0 ? 1 : 0];
        number[c] = (kind == kStep ? moved : previous[c]) +
                    static_cast<std::uint64_t>(code_signed(symbols, model, 0));
        break;
      }
      default: return false;
    }
    step = number[c] - guess.number[c];
    top_[c] = std::max(top_[c], number[c]);
    strays_ |= bit(c);
    ++differ;
    state = 2;
  }
  return true;
}

void ReplayHexahedra::code_marks(RangeDecoder& symbols, std::uint8_t expected,
                                 std::uint8_t& marks) {
  if (symbols.bit(marks_as_guessed_)) {
    marks = expected;
    return;
  }
  std::uint8_t coded = 0;
  for (std::uint32_t c = 0; c < 8; ++c) {
    if (symbols.bit(mark_[c][expected >> c & 1])) coded |= bit(c);
  }
  marks = coded;
}

// --- from numbers to vertices

bool ReplayHexahedra::resolve(CellTopology& cell, const Numbers& number) {
  // Corners that are no vertices yet.
  std::uint32_t left = kept() == 0 ? 0xffu : look_up_hints(cell, number);
  for (; left != 0; left &= left - 1)
    if (!resolve_corner(cell, number, static_cast<std::uint32_t>(std::countr_zero(left))))
      return false;
  return true;
}

/// The common case, in short: each vertex where the corner's was found last time. Returns the
/// corners where it is not.
std::uint32_t ReplayHexahedra::look_up_hints(CellTopology& cell, const Numbers& number) const {
  std::uint32_t failed = 0;
  for (std::uint32_t c = 0; c < 8; ++c) {
    const Source& source = sources_[c][0];
    const std::uint32_t slot = slots_[source.distance][source.corner];
    const Named& named = named_[slot];
    cell.slots[c] = slot;
    failed |= std::uint32_t{!named.known || named.number != number[c]} << c;
  }
  return failed;
}

bool ReplayHexahedra::resolve_corner(CellTopology& cell, const Numbers& number,
                                     std::uint32_t corner) {
  std::uint32_t slot = find(number[corner], corner);
  if (slot == kNone) {
    if (!keep_ && number[corner] != surface_->next_id()) return false;
    slot = surface_->add_vertex();
    if (number[corner] == largest_ + 1) next_ |= bit(corner);
    set_number(slot, number[corner]);
    cell.new_positions.push_back(corner);
  }
  cell.slots[corner] = slot;
  return true;
}

/// The vertex of a corner that is not where it was found last time.
std::uint32_t ReplayHexahedra::find(std::uint64_t number, std::uint32_t corner) {
  const std::uint32_t slot = find_anywhere(number);
  if (slot == kNone) return slot;  // as a rule: one that the cell introduces
  auto& sources = sources_[corner];
  std::swap(sources[0], sources[1]);
  if (sources[0].distance <= slots_.kept() &&
      slots_[sources[0].distance][sources[0].corner] == slot)
    return slot;
  for (std::size_t n = 0; n <= kDistances; ++n) {
    const std::uint64_t distance = n == 0 ? 1 : distances_[n - 1];
    if (distance == 0 || distance >= slots_.kept()) continue;
    const Slots& slots = slots_[distance];
    const auto at = std::find(slots.begin(), slots.end(), slot);
    if (at == slots.end()) continue;
    sources[0] = {static_cast<std::uint32_t>(distance),
                  static_cast<std::uint8_t>(at - slots.begin())};
    break;
  }
  return slot;
}

std::uint32_t ReplayHexahedra::find_anywhere(std::uint64_t number) const {
  if (keep_) return by_number_.find(number);
  return number >= surface_->next_id() ? kNone : surface_->slot_of(number);
}

void ReplayHexahedra::set_number(std::uint32_t slot, std::uint64_t number) {
  make_room(named_, slot);
  if (largest_ + 1 <= number) largest_ = number;
  const bool known = !keep_ || by_number_.insert(number, slot);
  named_[slot] = {number, known};
}

void ReplayHexahedra::forget(std::uint32_t slot) {
  if (slot >= named_.size() || !named_[slot].known) return;
  named_[slot].known = false;
  if (keep_) by_number_.erase(named_[slot].number);
}

// --- afterwards

void ReplayHexahedra::finish(CellTopology& cell, const Numbers& number, std::uint8_t marks) {
  // Which guess of marks was right, where the two differ.
  if (reaches(distances_[0]) && distances_[0] + beside_now_ <= kept()) {
    const std::uint8_t moved = static_cast<std::uint8_t>(past(beside_now_).marks ^
                                                         past(distances_[0] + beside_now_).marks);
    const std::uint8_t away = static_cast<std::uint8_t>(marks ^ past(distances_[0]).marks);
    if (moved != 0 && (away == 0 || away == moved)) marks_shift_ = away != 0;
  }
  // In a cell that was as guessed those of its model cell go on.
  if (strays_ == 0) strays_ = likely_strays();
  if (follows_strays_) follow_strays(number);
  Past& it = remember(cell, number);
  it.strays = strays_;
  it.next = next_;
  it.marks = marks;
  it.guessed = (hits_ & 1) != 0;
  it.beside = static_cast<std::uint32_t>(beside_now_);
  if (keep_) cell.original = number;
  // A vertex that stands at several corners ends once.
  std::fill_n(cell.last_use.begin(), 8, std::uint8_t{0});
  for (std::uint32_t left = marks; left != 0; left &= left - 1) {
    const auto c = static_cast<std::uint32_t>(std::countr_zero(left));
    bool first = true;
    for (std::uint32_t j = 0; j < c; ++j) first = first && cell.slots[j] != cell.slots[c];
    cell.last_use[c] = first ? 1 : 0;
  }
}

std::size_t ReplayHexahedra::place_of_follower(std::uint64_t step, std::size_t corner) {
  constexpr std::uint64_t kFactor = 0x9e3779b97f4a7c15u;
  return static_cast<std::size_t>(((step * kFactor) ^ corner) * kFactor >> (64 - kFollowerBits));
}

void ReplayHexahedra::follow_strays(const Numbers& number) {
  for (std::uint32_t left = strays_; left != 0; left &= left - 1) {
    const auto c = static_cast<std::size_t>(std::countr_zero(left));
    const std::uint64_t step = number[c] - last_stray_;
    followers_[place_of_follower(stray_step_, c)] = step;
    last_stray_ = number[c];
    stray_step_ = step;
  }
}

/// A place for the hexahedron at hand, with its numbers. The ring grows with the mesh and with its
/// active surface: what is farther back has nothing in common with what comes. Vertices that live
/// were used a layer ago at most, as a rule; so of slots fewer do.
auto ReplayHexahedra::remember(const CellTopology& cell, const Numbers& number) -> Past& {
  const std::uint64_t active = surface_->active_vertices();
  const std::uint64_t least = std::clamp(4 * active, kReplayLeast, kReplayWindow);
  std::uint64_t all = 0;
  for (std::uint64_t it : number) all |= it;
  if (all >> 32 != 0 && upper_.kept() == 0) upper_.begin_as(pasts_);
  if (all >> 32 != 0 || upper_.kept() > 0) {
    Halves& upper = upper_.push(least);
    for (std::size_t c = 0; c < 8; ++c) upper[c] = static_cast<std::uint32_t>(number[c] >> 32);
  }
  Slots& slots = slots_.push(std::clamp(active + active / 4, kLeastSlots, kReplayWindow));
  std::copy_n(cell.slots.begin(), 8, slots.begin());
  Past& it = pasts_.push(least);
  for (std::size_t c = 0; c < 8; ++c) it.number[c] = static_cast<std::uint32_t>(number[c]);
  return it;
}

}  // namespace shm
