// SideTable: stores sides of volume cells that another cell may share. A side is a cycle of vertex
// slots, in either direction. The table stores each side under the first vertex of its cycle; in
// the code, the side "hangs" at this vertex. least_cycle() chooses the same first vertex for every
// cell that has the side. The side stays in the table until take() is called for that vertex, so
// that a third cell with the same side finds the side, too. If many sides hang at one vertex, they
// are stored in a hash table, so that a hostile file cannot make searches slow.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/lists.h"
#include "base/number_map.h"

namespace shm {

class SideTable {
 public:
  struct Side {
    std::uint32_t next = kNone;  ///< next side at the same vertex
    std::uint32_t cell = kNone;  ///< record of the first cell that has the side

    /// Vertices after the first vertex: two for a triangle, three for a quadrilateral. If the cycle
    /// is longer or repeats a vertex, this array contains kNone and the index of the cycle in
    /// long_.
    std::array<std::uint32_t, 3> rest{kNone, kNone, kNone};
    std::uint16_t number = 0;  ///< number of the side within its cell
    bool is_reversed = false;  ///< true if the cycle is clockwise when seen from outside
    bool is_shared = false;    ///< true: a second cell has the side
  };
  using Rest = std::array<std::uint32_t, 3>;

  /// Returns the side whose cycle is `first` followed by `rest` (with kNone at the end for a
  /// triangle), or null if no such side exists. The pointer is valid until the next call to add().
  Side* find(std::uint32_t first, const Rest& rest) {
    if (first >= hung_.size()) return nullptr;
    for (std::uint32_t i = hung_[first].first; i != kNone; i = sides_[i].next)
      if (are_same(sides_[i].rest, rest)) return &sides_[i];
    return hung_[first].more == kNone ? nullptr : find_hashed(first, rest, {});
  }
  /// Returns the side with this cycle, which may have any length, or null if no such side exists.
  Side* find_long(std::span<const std::uint32_t> cycle);

  /// Adds a side. Precondition: find() returned null for this side.
  Side& add(std::uint32_t first, const Rest& rest) {
    const std::uint32_t side = new_side();
    sides_[side].rest = rest;
    return hang(first, side);
  }
  Side& add_long(std::span<const std::uint32_t> cycle);

  /// Calls visit(side, cycle) for all sides that hang at a vertex (are stored under it), and
  /// removes these sides. The cycle is valid during the call. `visit` must not use the table.
  template <class Visit>
  void take(std::uint32_t first, Visit&& visit) {
    if (first >= hung_.size()) return;
    for (const bool hashed : {false, true}) {
      std::uint32_t i = hashed ? hung_[first].more : hung_[first].first;
      while (i != kNone) {
        const std::uint32_t next = sides_[i].next;
        visit(std::as_const(sides_[i]), cycle_of(first, sides_[i]));
        if (hashed) forget_hash(first, i);
        free_side(i);
        i = next;
      }
    }
    hung_[first] = {};
  }

  std::size_t size() const { return sides_.size() - free_.size(); }
  /// Returns a number that is greater than every slot under which a side is stored.
  std::uint32_t slots() const { return static_cast<std::uint32_t>(hung_.size()); }
  /// Returns the number of bytes of memory that the table uses.
  std::uint64_t memory() const;

 private:
  /// Maximum number of sides at a vertex that are stored in a list, which is searched linearly.
  /// Further sides at the vertex are stored in a hash table.
  static constexpr std::uint32_t kMostListed = 32;
  struct Hung {
    std::uint32_t first = kNone, more = kNone;
    std::uint32_t listed = 0;  // length of the list that begins with side `first`
  };
  /// List links of a hashed side.
  struct Link {
    std::uint32_t next = kNone;  // index of the next side in the same chain of heads_
    std::uint32_t first = kNone;
  };

  /// Compares two cycles. This is faster than ==, which calls memcmp().
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

  std::vector<Hung> hung_;  // sides stored under each vertex slot
  std::vector<Side> sides_;
  std::vector<std::uint32_t> free_;
  std::vector<std::vector<std::uint32_t>> long_;
  std::vector<std::uint32_t> free_long_;
  std::uint64_t long_bytes_ = 0;
  // First side of each chain of the hash table. The number of chains is a power of two.
  std::vector<std::uint32_t> heads_;
  std::vector<Link> links_;  // for each hashed side: its link; indexed by side
  std::size_t hashed_ = 0;
  Scatter scatter_;
  std::array<std::uint32_t, 4> short_{};  // cycle that take() passes to visit()
};

/// Brings a cycle into a form that does not depend on its start and direction. Among the rotations
/// of the cycle and of its reverse, chooses the rotation with the lexicographically least keys.
/// Returns true if the cycle was reversed. `keys[i]` belongs to `cycle[i]`; two keys are equal if
/// and only if the vertices are equal. Both lists are reordered.
bool least_cycle(std::vector<std::uint32_t>& cycle, std::vector<std::uint64_t>& keys);

}  // namespace shm
