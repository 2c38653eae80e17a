#include "codecs/surface/cells/replay_hexahedra.h"

#include <algorithm>
#include <bit>

#include "base/lists.h"

namespace shm {
namespace {

// A corner may be coded as a reference to the same vertex in an earlier cell. This is the number of
// earlier cells that can be referred to. Frozen: part of the format
constexpr std::uint64_t kEarlierCells = 256;
constexpr std::uint64_t kLeastSlots = 1024;
constexpr std::uint32_t kRepeatedStrays =
    4;  // encoder: predicts strays (mispredicted corners) as soon as this number of cells had a
        // stray at the same corner as their model cell
constexpr std::uint64_t kSearch =
    64;  // encoder: new distances are tried up to this far from the most recently used distance

constexpr std::uint8_t bit(std::uint32_t i) { return static_cast<std::uint8_t>(1u << i); }

}  // namespace

template <class Coder>
bool ReplayHexahedra<Coder>::code(Coder& symbols, Coder&, const StoredCell& stored,
                                  CellTopology& cell, bool) {
  Numbers number;
  std::uint8_t marks = 0;
  if constexpr (!Coder::kDecodes)
    take(stored, number, marks);
  else
    number.fill(0);
  next_ = strays_ = 0;
  if (!keep_) largest_ = surface_->next_id() - 1;
  beside_now_ = beside_of(distances_[0]);
  const bool model_hit = reaches(distances_[0]) && past(distances_[0]).guessed;
  const Guess first = guess(distances_[0], distances_[0], beside_now_);
  const bool hit =
      symbols.bit(hit_[model_hit ? 1 : 0][hits_], first.number == number && first.marks == marks);
  hits_ = (hits_ << 1 | (hit ? 1u : 0u)) & 7;
  if (hit) {
    number = first.number;
    marks = first.marks;
    if (!resolve(stored, cell, number)) return false;
  } else if (!code_miss(symbols, stored, cell, number, marks)) {
    return false;
  }
  if (!Coder::kDecodes && clash_) return false;
  finish(cell, number, marks);
  return true;
}

/// Returns the expected vertex numbers and last uses of the current cell. Let number[k] be the
/// vertex numbers of the cell k cells back. The expected numbers are number[distance] +
/// number[beside] - number[beside + over].
template <class Coder>
auto ReplayHexahedra<Coder>::guess(std::uint64_t distance, std::uint64_t over,
                                   std::uint64_t beside) const -> Guess {
  if (kept() == 0) return {};
  Guess expected;
  if (!reaches(distance) || over + beside > kept()) {
    expected.number = numbers(1);
    expected.marks = past(1).marks;
    return expected;
  }
  const Past& model = past(distance);
  expected.number = numbers(distance);
  const Numbers here = numbers(beside), there = numbers(over + beside);
  for (std::size_t c = 0; c < 8; ++c) expected.number[c] += here[c] - there[c];
  std::uint64_t next = largest_ + 1;
  for (std::uint32_t left = model.next; left != 0; left &= left - 1)
    expected.number[static_cast<std::size_t>(std::countr_zero(left))] = next++;
  expected.marks = model.marks;
  if (marks_shift_)
    expected.marks ^= static_cast<std::uint8_t>(past(beside).marks ^ past(over + beside).marks);
  return expected;
}

/// Encoder: sets `number` to the vertex numbers of the corners, and `marks` to the set of corners
/// whose vertices no later cell uses.
template <class Coder>
void ReplayHexahedra<Coder>::take(const StoredCell& stored, Numbers& number,
                                  std::uint8_t& marks) const {
  for (std::uint32_t c = 0; c < 8; ++c) marks |= static_cast<std::uint8_t>(stored.last_use[c] << c);
  if (keep_) {
    number = stored.original;
    return;
  }
  std::uint64_t next = surface_->next_id();
  for (std::uint32_t c = 0; c < 8; ++c) {
    if (stored.slots[c] != kNone) {
      number[c] = surface_->vertex(stored.slots[c]).id;
    } else {
      std::uint32_t same = 0;
      while (same < c && (stored.slots[same] != kNone || stored.numbers[same] != stored.numbers[c]))
        ++same;
      number[c] = same < c ? number[same] : next++;
    }
  }
}

// --- cells that are not as expected

template <class Coder>
bool ReplayHexahedra<Coder>::code_miss(Coder& symbols, const StoredCell& stored, CellTopology& cell,
                                       Numbers& number, std::uint8_t& marks) {
  Choice choice;
  if constexpr (!Coder::kDecodes) {
    choice = choose(stored, number, marks);
    misses_.resize(kMissSlots);
    misses_[step_key(number)] = sequence_;
  }
  const std::uint64_t before = distances_[0];
  if (!code_choice_of_guess(symbols, choice)) return false;
  const Guess expected =
      guess(distances_[0], choice.old_shift ? before : distances_[0], beside_now_);
  if (symbols.bit(as_guessed_[choice.place], expected.number == number))
    number = expected.number;
  else if (!code_corners(symbols, expected, number))
    return false;
  if (!resolve(stored, cell, number)) return false;
  code_marks(symbols, expected.marks, marks);
  return true;
}

/// Encoder: returns the guess with the smallest coding cost.
template <class Coder>
auto ReplayHexahedra<Coder>::choose(const StoredCell& stored, const Numbers& number,
                                    std::uint8_t marks) const -> Choice {
  Choice best;
  std::uint32_t least = ~0u;
  const auto rate = [&](const Choice& choice, std::uint32_t cost) {
    const std::uint64_t distance =
        choice.place < kDistances ? distances_[choice.place] : choice.distance;
    if (choice.place != 0 && !reaches(distance)) return;
    if (choice.old_shift && !reaches(distances_[0])) return;
    const Guess expected = guess(distance, choice.old_shift ? distances_[0] : distance,
                                 beside_of(distance, choice.beside));
    for (std::size_t c = 0; c < 8; ++c) cost += expected.number[c] != number[c] ? 8 : 0;
    cost += expected.marks != marks ? 7 : 0;
    if (cost >= least) return;
    least = cost;
    best = choice;
  };
  rate({}, 0);
  for (std::uint32_t place = 1; place < kDistances; ++place) {
    rate({place, 0, false, 0}, 3);
    rate({place, 0, true, 0}, 4);
  }
  if (least <= 7) return best;
  for (std::uint32_t place = 0; place < kDistances; ++place)
    for (std::uint32_t beside = 1; beside < 2 + kDistances; ++beside)
      if (beside == 1 || reaches(distances_[beside - 2]))
        rate({place, 0, false, beside}, place == 0 ? 2 : 4);
  if (least <= 7) return best;
  const auto try_new = [&](std::uint64_t distance, std::uint32_t cost) {
    if (!reaches(distance)) return;
    rate({kDistances, distance, false, 0}, cost);
    rate({kDistances, distance, true, 0}, cost);
  };
  // Try the distances to the cells that introduced the vertices of this cell. If cells are numbered
  // row by row, these cells include the cells below and beside this cell.
  for (std::uint32_t c = 0; c < 8; ++c)
    if (stored.slots[c] < introduced_.size()) try_new(sequence_ - introduced_[stored.slots[c]], 12);
  // For meshes with repeated parts: try the distance to the most recent mispredicted cell with the
  // same step. The step is the difference between the vertex numbers of a cell and those of the
  // cell before it.
  if (!misses_.empty()) try_new(sequence_ - misses_[step_key(number)], 12);
  // For layers with holes: try distances that are slightly larger or smaller than the distance used
  // most recently.
  if (!reaches(distances_[0])) return best;
  const auto first = [&](std::uint64_t distance) { return numbers(distance)[0]; };
  const std::uint64_t moved = number[0] - first(1);
  const std::uint64_t shift = first(1) - first(distances_[0] + 1);
  for (std::uint64_t away = 1; away <= kSearch && least > 10; ++away)
    for (std::uint64_t distance : {distances_[0] + away, distances_[0] - away})
      if (reaches(distance) &&
          (number[0] == first(distance) + shift || moved == first(distance) - first(distance + 1)))
        try_new(distance, 10);
  return best;
}

/// Encoder: returns a hash of the step, which is the difference between the numbers of this cell
/// and those of the previous cell.
template <class Coder>
std::size_t ReplayHexahedra<Coder>::step_key(const Numbers& number) const {
  if (kept() == 0) return 0;
  const Numbers last = numbers(1);
  std::uint64_t key = 0;
  for (std::size_t c = 0; c < 8; ++c) key = (key ^ (number[c] - last[c])) * 0x9e3779b97f4a7c15u;
  return static_cast<std::size_t>(key >> 54);
}

template <class Coder>
bool ReplayHexahedra<Coder>::code_choice_of_guess(Coder& symbols, Choice& choice) {
  const bool may_begin = may_follow_ && !follows_strays_;
  const bool begins = !Coder::kDecodes && may_begin && repeated_strays_ >= kRepeatedStrays;
  std::uint32_t place =
      code_tree(symbols, place_[last_place_], begins ? kFollowStrays : choice.place);
  if (place == kFollowStrays && may_begin) {
    follows_strays_ = true;
    followers_.resize(std::size_t{1} << kFollowerBits);
    place = code_tree(symbols, place_[last_place_], choice.place);
  }
  if (place > kDistances) return false;
  choice.place = place;
  last_place_ = choice.place;
  choice.beside = code_tree(symbols, beside_[choice.place], choice.beside);
  const std::uint64_t before = distances_[0];
  std::uint64_t distance = choice.distance;
  if (choice.place == kDistances)
    distance = before + static_cast<std::uint64_t>(code_signed(
                            symbols, distance_, static_cast<std::int64_t>(distance - before)));
  else
    distance = distances_[choice.place];
  beside_now_ = beside_of(distance, choice.beside);
  if (choice.beside > 1 && !reaches(beside_now_)) return false;
  if (choice.place == 0) return true;
  if (!reaches(distance)) return false;
  choice.old_shift = symbols.bit(old_shift_, choice.old_shift);
  if (choice.old_shift && !reaches(before)) return false;
  for (std::uint32_t i = std::min(choice.place, kDistances - 1); i > 0; --i)
    distances_[i] = distances_[i - 1];
  distances_[0] = distance;
  return true;
}

template <class Coder>
bool ReplayHexahedra<Coder>::code_corners(Coder& symbols, const Guess& guess, Numbers& number) {
  std::uint32_t differ = 0, state = 0;
  std::uint64_t step = 0;
  const Numbers previous = kept() > 0 ? numbers(1) : Numbers{};
  const std::uint8_t likely = follows_strays_ ? likely_strays() : std::uint8_t{0};
  for (std::uint32_t c = 0; c < 8; ++c) {
    if (symbols.bit(same_[likely >> c & 1][c][state], number[c] == guess.number[c])) {
      number[c] = guess.number[c];
      state = differ > 0 ? 1 : 0;
      continue;
    }
    const std::uint64_t moved = guess.number[c] + step;
    const std::uint64_t expected = differ > 0 || !follows_strays_ ? moved : next_stray(c);
    std::uint32_t kind = kStep, corner = 0;
    std::uint64_t age = 0;
    if constexpr (!Coder::kDecodes) {
      const auto corner_of = [&](const Numbers& list) {
        return static_cast<std::uint32_t>(std::find(list.begin(), list.end(), number[c]) -
                                          list.begin());
      };
      if (number[c] == expected && (differ > 0 || follows_strays_)) {
        kind = kExpected;
      } else if (number[c] == largest_ + 1) {
        kind = kBeyond;
      } else if (number[c] == top_[c] + 1) {
        kind = kTop;
      } else if ((corner = corner_of(previous)) < 8) {
        kind = kPrevious;
      } else {
        const auto far = [](std::uint64_t d) {
          return static_cast<std::int64_t>(d) < 0 ? 0 - d : d;
        };
        const std::uint64_t a = far(number[c] - previous[c]), b = far(number[c] - moved);
        if (a < b) kind = kFromPrevious;
        if (std::min(a, b) > 7)
          for (std::uint64_t n = 0; n < kEarlierCells && n + 2 <= kept(); ++n)
            if ((corner = corner_of(numbers(n + 2))) < 8) {
              kind = kEarlier;
              age = n;
              break;
            }
      }
    }
    kind = code_tree(symbols, kind_[c][last_kind_], kind);
    last_kind_ = kind;
    switch (kind) {
      case kExpected: number[c] = expected; break;
      case kBeyond: number[c] = largest_ + 1; break;
      case kTop: number[c] = top_[c] + 1; break;
      case kPrevious: number[c] = previous[code_tree(symbols, previous_[c], corner)]; break;
      case kEarlier:
        age = code_number(symbols, age_[c], age);
        if (age >= kEarlierCells || age + 2 > kept()) return false;
        number[c] = numbers(age + 2)[code_tree(symbols, earlier_[c], corner)];
        break;
      case kFromPrevious:
      case kStep: {
        const std::uint64_t from = kind == kStep ? moved : previous[c];
        auto& model = step_[kind == kFromPrevious ? 2 : differ > 0 ? 1 : 0];
        number[c] = from + static_cast<std::uint64_t>(code_signed(
                               symbols, model, static_cast<std::int64_t>(number[c] - from)));
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

template <class Coder>
void ReplayHexahedra<Coder>::code_marks(Coder& symbols, std::uint8_t expected,
                                        std::uint8_t& marks) {
  if (symbols.bit(marks_as_guessed_, marks == expected)) {
    marks = expected;
    return;
  }
  std::uint8_t coded = 0;
  for (std::uint32_t c = 0; c < 8; ++c) {
    if (symbols.bit(mark_[c][expected >> c & 1], marks >> c & 1)) coded |= bit(c);
  }
  marks = coded;
}

// --- from numbers to vertices

template <class Coder>
bool ReplayHexahedra<Coder>::resolve(const StoredCell& stored, CellTopology& cell,
                                     const Numbers& number) {
  std::uint32_t left = 0;  // set of corners whose vertices have not been found yet
  if constexpr (Coder::kDecodes) {
    left = kept() == 0 ? 0xffu : look_up_hints(cell, number);
  } else {
    for (std::uint32_t c = 0; c < 8; ++c) left |= std::uint32_t{stored.slots[c] == kNone} << c;
  }
  for (; left != 0; left &= left - 1)
    if (!resolve_corner(stored, cell, number, static_cast<std::uint32_t>(std::countr_zero(left))))
      return false;
  return true;
}

/// Handles the common case: for each corner, looks for the vertex at the source (corner of an
/// earlier cell) that was right most recently. Returns the set of corners whose vertices are not at
/// this source.
template <class Coder>
std::uint32_t ReplayHexahedra<Coder>::look_up_hints(CellTopology& cell,
                                                    const Numbers& number) const {
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

template <class Coder>
bool ReplayHexahedra<Coder>::resolve_corner(const StoredCell& stored, CellTopology& cell,
                                            const Numbers& number, std::uint32_t corner) {
  std::uint32_t slot = kNone;
  if constexpr (Coder::kDecodes) {
    slot = find(number[corner], corner);
  } else {
    for (std::uint32_t c = 0; c < corner && slot == kNone; ++c)  // a new vertex of the current cell
      if (stored.numbers[c] == stored.numbers[corner]) slot = cell.slots[c];
  }
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

/// Decoder: finds the vertex of a corner if it is not at the source (corner of an earlier cell)
/// that was right most recently.
template <class Coder>
std::uint32_t ReplayHexahedra<Coder>::find(std::uint64_t number, std::uint32_t corner) {
  const std::uint32_t slot = find_anywhere(number);
  if (slot == kNone) return slot;  // usually a vertex that this cell introduces
  auto& sources = sources_[corner];
  std::swap(sources[0], sources[1]);
  if (sources[0].distance <= slots_.kept() &&
      slots_[sources[0].distance][sources[0].corner] == slot)
    return slot;
  for (std::size_t n = 0; n <= kDistances; ++n) {
    const std::uint64_t distance = n == 0 ? 1 : distances_[n - 1];
    if (distance == 0 || distance >= slots_.kept()) continue;
    const Slots& slots = slots_[distance];
    const auto found = std::find(slots.begin(), slots.end(), slot);
    if (found == slots.end()) continue;
    sources[0] = {static_cast<std::uint32_t>(distance),
                  static_cast<std::uint8_t>(found - slots.begin())};
    break;
  }
  return slot;
}

template <class Coder>
std::uint32_t ReplayHexahedra<Coder>::find_anywhere(std::uint64_t number) const {
  if (keep_) return by_number_.find(number);
  return number >= surface_->next_id() ? kNone : surface_->slot_of(number);
}

template <class Coder>
void ReplayHexahedra<Coder>::set_number(std::uint32_t slot, std::uint64_t number) {
  make_room(named_, slot);
  if constexpr (!Coder::kDecodes) at_slot(introduced_, slot) = sequence_;
  if (largest_ + 1 <= number) largest_ = number;
  const bool known = !keep_ || by_number_.insert(number, slot);
  named_[slot] = {number, known};
  clash_ |= !known;
}

template <class Coder>
void ReplayHexahedra<Coder>::forget(std::uint32_t slot) {
  if (slot >= named_.size() || !named_[slot].known) return;
  named_[slot].known = false;
  if (keep_) by_number_.erase(named_[slot].number);
}

// --- afterwards

template <class Coder>
void ReplayHexahedra<Coder>::finish(CellTopology& cell, const Numbers& number, std::uint8_t marks) {
  // Which corners are marked as last use can be guessed in two ways. If the two guesses differ,
  // record which one was right.
  if (reaches(distances_[0]) && distances_[0] + beside_now_ <= kept()) {
    const std::uint8_t moved = static_cast<std::uint8_t>(past(beside_now_).marks ^
                                                         past(distances_[0] + beside_now_).marks);
    const std::uint8_t away = static_cast<std::uint8_t>(marks ^ past(distances_[0]).marks);
    if (moved != 0 && (away == 0 || away == moved)) marks_shift_ = away != 0;
  }
  if (!follows_strays_ && (strays_ & likely_strays()) != 0) ++repeated_strays_;
  // If no corner was mispredicted, copy the set of strays (mispredicted corners) from the model
  // cell, the earlier cell that this cell repeats.
  if (strays_ == 0) strays_ = likely_strays();
  if (follows_strays_) follow_strays(number);
  Past& record = remember(cell, number);
  record.strays = strays_;
  record.next = next_;
  record.marks = marks;
  record.guessed = (hits_ & 1) != 0;
  record.beside = static_cast<std::uint32_t>(beside_now_);
  if (keep_) cell.original = number;
  // If a vertex occurs at several corners, only one of them is marked as last use.
  std::fill_n(cell.last_use.begin(), 8, std::uint8_t{0});
  for (std::uint32_t left = marks; left != 0; left &= left - 1) {
    const auto c = static_cast<std::uint32_t>(std::countr_zero(left));
    bool first = true;
    for (std::uint32_t j = 0; j < c; ++j) first = first && cell.slots[j] != cell.slots[c];
    cell.last_use[c] = first ? 1 : 0;
  }
}

template <class Coder>
std::size_t ReplayHexahedra<Coder>::place_of_follower(std::uint64_t step, std::size_t corner) {
  constexpr std::uint64_t kFactor = 0x9e3779b97f4a7c15u;
  return static_cast<std::size_t>(((step * kFactor) ^ corner) * kFactor >> (64 - kFollowerBits));
}

template <class Coder>
void ReplayHexahedra<Coder>::follow_strays(const Numbers& number) {
  for (std::uint32_t left = strays_; left != 0; left &= left - 1) {
    const auto c = static_cast<std::size_t>(std::countr_zero(left));
    const std::uint64_t step = number[c] - last_stray_;
    followers_[place_of_follower(stray_step_, c)] = step;
    last_stray_ = number[c];
    stray_step_ = step;
  }
}

/// Adds the current hexahedron to the ring of earlier cells, and stores its vertex numbers there.
/// Returns the new entry. The ring holds about four cells per vertex of the active surface; cells
/// further back do not help prediction. The ring of vertex slots can be smaller, since most live
/// vertices were used within the most recent layer of cells.
template <class Coder>
auto ReplayHexahedra<Coder>::remember(const CellTopology& cell, const Numbers& number) -> Past& {
  const std::uint64_t active = surface_->active_vertices();
  const std::uint64_t least = std::clamp(4 * active, kReplayLeast, kReplayWindow);
  std::uint64_t all = 0;
  for (std::uint64_t one : number) all |= one;
  if (all >> 32 != 0 && upper_.kept() == 0) upper_.begin_as(pasts_);
  if (all >> 32 != 0 || upper_.kept() > 0) {
    Halves& upper = upper_.push(least);
    for (std::size_t c = 0; c < 8; ++c) upper[c] = static_cast<std::uint32_t>(number[c] >> 32);
  }
  if constexpr (Coder::kDecodes) {
    Slots& slots = slots_.push(std::clamp(active + active / 4, kLeastSlots, kReplayWindow));
    std::copy_n(cell.slots.begin(), 8, slots.begin());
  }
  ++sequence_;
  Past& record = pasts_.push(least);
  for (std::size_t c = 0; c < 8; ++c) record.number[c] = static_cast<std::uint32_t>(number[c]);
  return record;
}

template class ReplayHexahedra<RangeEncoder>;
template class ReplayHexahedra<RangeDecoder>;

}  // namespace shm
