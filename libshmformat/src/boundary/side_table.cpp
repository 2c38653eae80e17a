#include "boundary/side_table.h"

#include <algorithm>
#include <utility>

namespace shm {

namespace {

/// Returns the start of the lexicographically least rotation of `keys`. Like Booth's algorithm, the
/// function needs linear time, but it needs no table: it compares two candidate rotations at a
/// time.
std::size_t least_rotation(std::span<const std::uint64_t> keys) {
  const std::size_t size = keys.size();
  std::size_t a = 0, b = 1, same = 0;
  while (a < size && b < size && same < size) {
    const std::uint64_t of_a = keys[(a + same) % size], of_b = keys[(b + same) % size];
    if (of_a == of_b) {
      ++same;
      continue;
    }
    (of_a > of_b ? a : b) += same + 1;
    if (a == b) ++b;
    same = 0;
  }
  return std::min(a, b);
}

}  // namespace

bool least_cycle(std::vector<std::uint32_t>& cycle, std::vector<std::uint64_t>& keys) {
  const auto rotate = [](auto& list, std::size_t to) {
    std::rotate(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(to), list.end());
  };
  const std::size_t forward = least_rotation(keys);
  rotate(cycle, forward);
  rotate(keys, forward);
  std::vector<std::uint64_t> other(keys.rbegin(), keys.rend());
  const std::size_t backward = least_rotation(other);
  rotate(other, backward);
  if (!(other < keys)) return false;
  std::reverse(cycle.begin(), cycle.end());
  rotate(cycle, backward);
  keys = std::move(other);
  return true;
}

std::uint64_t SideTable::memory() const {
  return hung_.capacity() * sizeof(Hung) + sides_.capacity() * sizeof(Side) +
         (free_.capacity() + free_long_.capacity() + heads_.capacity()) * sizeof(std::uint32_t) +
         links_.capacity() * sizeof(Link) + long_.capacity() * sizeof(std::vector<std::uint32_t>) +
         long_bytes_;
}

std::uint32_t SideTable::new_side() {
  if (free_.empty()) {
    push_tightly(sides_, Side());
    return static_cast<std::uint32_t>(sides_.size() - 1);
  }
  const std::uint32_t side = free_.back();
  free_.pop_back();
  sides_[side] = Side();
  return side;
}

void SideTable::free_side(std::uint32_t side) {
  if (is_long(sides_[side])) {
    const std::uint32_t long_index = sides_[side].rest[1];
    long_bytes_ -= long_[long_index].capacity() * sizeof(std::uint32_t);
    shm::let_go(long_[long_index]);
    push_tightly(free_long_, long_index);
  }
  push_tightly(free_, side);
}

SideTable::Side& SideTable::hang(std::uint32_t first, std::uint32_t side) {
  Hung& hung = at_slot(hung_, first);
  if (hung.listed < kMostListed) {
    ++hung.listed;
    sides_[side].next = std::exchange(hung.first, side);
    return sides_[side];
  }
  sides_[side].next = std::exchange(hung.more, side);
  at_slot(links_, side).first = first;
  add_hash(side);
  return sides_[side];
}

// --- longer cycles

SideTable::Side* SideTable::find_long(std::span<const std::uint32_t> cycle) {
  const std::uint32_t first = cycle.front();
  if (first >= hung_.size()) return nullptr;
  for (std::uint32_t i = hung_[first].first; i != kNone; i = sides_[i].next)
    if (is_long(sides_[i]) && std::ranges::equal(long_cycle(sides_[i]), cycle)) return &sides_[i];
  return hung_[first].more == kNone ? nullptr : find_hashed(first, {kNone, kNone, kNone}, cycle);
}

SideTable::Side& SideTable::add_long(std::span<const std::uint32_t> cycle) {
  const std::uint32_t side = new_side();
  auto long_index = static_cast<std::uint32_t>(long_.size());
  if (free_long_.empty()) {
    expect_more(long_, 1);
    long_.emplace_back();
  } else {
    long_index = free_long_.back();
    free_long_.pop_back();
  }
  long_[long_index].assign(cycle.begin(), cycle.end());
  long_bytes_ += long_[long_index].capacity() * sizeof(std::uint32_t);
  sides_[side].rest = {kNone, long_index, kNone};
  return hang(cycle.front(), side);
}

std::span<const std::uint32_t> SideTable::cycle_of(std::uint32_t first, const Side& side) {
  if (is_long(side)) return long_cycle(side);
  short_ = {first, side.rest[0], side.rest[1], side.rest[2]};
  return std::span(short_).first(side.rest[2] == kNone ? 3 : 4);
}

// --- many sides at one vertex

std::size_t SideTable::home(std::uint32_t first, const Rest& rest,
                            std::span<const std::uint32_t> cycle) const {
  std::uint64_t sum = scatter_(first);
  const auto add = [&](std::uint32_t slot) { sum = scatter_(sum << 32 | slot); };
  if (rest[0] == kNone)
    for (const std::uint32_t slot : cycle) add(slot);
  else
    for (const std::uint32_t slot : rest) add(slot);
  return static_cast<std::size_t>(sum) & (heads_.size() - 1);
}

std::size_t SideTable::home_of(std::uint32_t side) const {
  const Side& entry = sides_[side];
  return home(links_[side].first, entry.rest,
              is_long(entry) ? long_cycle(entry) : std::span<const std::uint32_t>());
}

SideTable::Side* SideTable::find_hashed(std::uint32_t first, const Rest& rest,
                                        std::span<const std::uint32_t> cycle) {
  for (std::uint32_t i = heads_[home(first, rest, cycle)]; i != kNone; i = links_[i].next) {
    Side& side = sides_[i];
    if (links_[i].first != first) continue;
    const bool same = rest[0] != kNone
                          ? are_same(side.rest, rest)
                          : is_long(side) && std::ranges::equal(long_cycle(side), cycle);
    if (same) return &side;
  }
  return nullptr;
}

void SideTable::add_hash(std::uint32_t side) {
  if (hashed_ >= heads_.size()) {
    const std::vector<std::uint32_t> old = std::exchange(
        heads_, std::vector<std::uint32_t>(heads_.empty() ? 64 : heads_.size() * 2, kNone));
    for (const std::uint32_t head : old)
      for (std::uint32_t i = head; i != kNone;) {
        const std::uint32_t next = links_[i].next;
        links_[i].next = std::exchange(heads_[home_of(i)], i);
        i = next;
      }
  }
  links_[side].next = std::exchange(heads_[home_of(side)], side);
  ++hashed_;
}

void SideTable::forget_hash(std::uint32_t first, std::uint32_t side) {
  const Side& hashed = sides_[side];
  std::uint32_t* link = &heads_[home(
      first, hashed.rest, is_long(hashed) ? long_cycle(hashed) : std::span<const std::uint32_t>())];
  while (*link != side) link = &links_[*link].next;
  *link = links_[side].next;
  --hashed_;
}

}  // namespace shm
