// SideTable: sides of volume cells of which it is not known yet whether another cell has them.
// A side is a cycle of vertex slots in either direction. It hangs at the first vertex of the cycle,
// which must be the same one whichever cell brings it (least_cycle()), and stays there until it is
// taken with that vertex, so that a third cell finds it, too.
// Where many sides hang at one vertex they are found by a hash, so that no file makes searches
// long.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bytes/lists.h"
#include "surface/number_map.h"

namespace shm {

class SideTable {
 public:
  struct Side {
    std::uint32_t next = kNone;  ///< at the same vertex
    std::uint32_t cell = kNone;  ///< the record of the first cell that has it
    /// The vertices behind the first one; of a triangle two. Of a longer cycle, and of one with a
    /// vertex more than once, kNone and which of long_ it is.
    std::array<std::uint32_t, 3> rest{kNone, kNone, kNone};
    std::uint16_t number = 0;  ///< of the side in its cell
    bool is_reversed = false;  ///< seen from outside the cycle goes clockwise
    bool is_shared = false;    ///< a second cell has it
  };
  using Rest = std::array<std::uint32_t, 3>;

  /// The side whose cycle is `first` and then `rest`, kNone behind the second one of a triangle.
  /// Null where there is none. Valid until the next call of add().
  Side* find(std::uint32_t first, const Rest& rest) {
    if (first >= hung_.size()) return nullptr;
    for (std::uint32_t at = hung_[first].first; at != kNone; at = sides_[at].next)
      if (are_same(sides_[at].rest, rest)) return &sides_[at];
    return hung_[first].more == kNone ? nullptr : find_hashed(first, rest, {});
  }
  /// Any cycle.
  Side* find_long(std::span<const std::uint32_t> cycle);

  /// Must hold: find() found none.
  Side& add(std::uint32_t first, const Rest& rest) {
    const std::uint32_t side = new_side();
    sides_[side].rest = rest;
    return hang(first, side);
  }
  Side& add_long(std::span<const std::uint32_t> cycle);

  /// Calls visit(side, cycle) for all that hang at a vertex, which are then gone. The cycle lives
  /// during the call, which may call nothing else of the table.
  template <class Visit>
  void take(std::uint32_t first, Visit&& visit) {
    if (first >= hung_.size()) return;
    for (const bool hashed : {false, true}) {
      std::uint32_t at = hashed ? hung_[first].more : hung_[first].first;
      while (at != kNone) {
        const std::uint32_t next = sides_[at].next;
        visit(std::as_const(sides_[at]), cycle_of(first, sides_[at]));
        if (hashed) forget_hash(first, at);
        free_side(at);
        at = next;
      }
    }
    hung_[first] = {};
  }

  std::size_t size() const { return sides_.size() - free_.size(); }
  /// Behind the largest slot at which a side may hang.
  std::uint32_t slots() const { return static_cast<std::uint32_t>(hung_.size()); }
  /// Bytes that it takes.
  std::uint64_t memory() const;

 private:
  /// Sides that are looked through; others at the vertex are hashed.
  static constexpr std::uint32_t kMostListed = 32;
  struct Hung {
    std::uint32_t first = kNone, more = kNone;
    std::uint32_t listed = 0;  // in the list that begins with `first`
  };
  /// Of a hashed side.
  struct Link {
    std::uint32_t next = kNone;  // with the same place in heads_
    std::uint32_t first = kNone;
  };

  /// Not ==, which calls memcmp().
  static bool are_same(const Rest& a, const Rest& b) {
    return a[1] == b[1] && a[0] == b[0] && a[2] == b[2];
  }
  std::uint32_t new_side();
  void free_side(std::uint32_t side);
  Side& hang(std::uint32_t first, std::uint32_t side);
  std::span<const std::uint32_t> cycle_of(std::uint32_t first, const Side& side);
  std::span<const std::uint32_t> long_cycle(const Side& side) const { return long_[side.rest[1]]; }
  static bool is_long(const Side& side) { return side.rest[0] == kNone; }

  Side* find_hashed(std::uint32_t first, const Rest& rest, std::span<const std::uint32_t> cycle);
  std::size_t home(std::uint32_t first, const Rest& rest,
                   std::span<const std::uint32_t> cycle) const;
  std::size_t home_of(std::uint32_t side) const;
  void add_hash(std::uint32_t side);
  void forget_hash(std::uint32_t first, std::uint32_t side);

  std::vector<Hung> hung_;  // by slot
  std::vector<Side> sides_;
  std::vector<std::uint32_t> free_;
  std::vector<std::vector<std::uint32_t>> long_;
  std::vector<std::uint32_t> free_long_;
  std::uint64_t long_bytes_ = 0;
  std::vector<std::uint32_t> heads_;  // of chains of hashed sides; as many as a power of two
  std::vector<Link> links_;           // by side
  std::size_t hashed_ = 0;
  Scatter scatter_;
  std::array<std::uint32_t, 4> short_{};  // the cycle that take() gives
};

/// Puts a cycle so that it is the same wherever it begins and whichever way it goes: of its
/// rotations, and those of its reverse, the one whose keys come first. Whether it was reversed.
/// `keys[i]` belongs to `cycle[i]`, equal where and only where vertices are; both are moved.
bool least_cycle(std::vector<std::uint32_t>& cycle, std::vector<std::uint64_t>& keys);

}  // namespace shm
