// SparseElements: what the column of an array that covers few of the elements needs of them: the
// covered ones, and of the others those whose slots a covered one looks at. The column of these
// gives the very values that the column of all would give.
// in:    elements of the groups that have covered ones, in order       out: the same without most
// keeps: of each covered element 60 bytes, and 4 for each slot that it looks at at most
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "values/value_column.h"

namespace shm {

/// Of one group.
struct SparseGroup {
  /// Ends in `items` and in `skipped`; how many elements are not covered, in it and in those
  /// without covered ones before it.
  struct Tile {
    std::uint32_t items_end = 0, skipped_end = 0, uncovered = 0;
  };

  std::vector<Neighbourhood> items;    ///< covered; slots are numbered anew
  std::vector<std::uint32_t> skipped;  ///< slots of elements that are not covered
  std::vector<Tile> tiles;             ///< those with covered elements
  std::vector<std::uint64_t> numbers;  ///< of the covered ones, where they are known
  std::uint32_t slots = 0;             ///< above every one that is named up to here
  std::uint32_t all_slots = 0;         ///< of all elements up to here
  std::uint32_t uncovered_behind = 0;  ///< elements behind the last tile

  std::size_t bytes() const {
    return sizeof(SparseGroup) + items.capacity() * sizeof(Neighbourhood) +
           skipped.capacity() * sizeof(std::uint32_t) + tiles.capacity() * sizeof(Tile) +
           numbers.capacity() * sizeof(std::uint64_t);
  }
  /// As a column that covers block `covered` takes them.
  void unfold(std::uint32_t covered, TiledItems& out) const;
};

/// What an array covers.
class Coverage {
 public:
  /// `blocks` ascend and are borrowed.
  explicit Coverage(std::span<const std::uint32_t> blocks) : blocks_(blocks) {}
  bool operator()(std::uint32_t block);

 private:
  std::span<const std::uint32_t> blocks_;
  std::uint32_t last_ = kNone;
  bool covers_last_ = false;
};

/// Makes the groups of one segment after the other. What it keeps by slot goes with it.
class SparseGroupBuilder {
 public:
  /// `out` is borrowed, and so are `blocks`.
  SparseGroupBuilder(std::span<const std::uint32_t> blocks, std::vector<SparseGroup>& out)
      : covers_(blocks), out_(&out) {}

  /// The next group that has covered elements. Of `all` either items or blocks may be missing.
  /// `slots`: above every one that an item names. `numbers`: of all elements, or of the covered
  /// ones, or none.
  void add_group(const TiledItems& all, std::uint32_t slots,
                 std::span<const std::uint64_t> numbers);
  /// Behind the groups of each segment.
  void end_segment();
  /// Of what it has made, and keeps until the end of the segment.
  std::size_t bytes() const { return bytes_ + looked_at_.size() * sizeof(LookedAt); }

 private:
  /// By slot as the mesh numbers them.
  struct Slot {
    std::uint32_t number = kNone;   ///< anew
    std::uint32_t skipped = kNone;  ///< before which tile an uncovered element took it, if one did
  };
  /// An uncovered element that a covered one looks at: before the covered ones of a tile.
  struct LookedAt {
    std::uint32_t tile, slot;
  };

  void add_covered(const Neighbourhood& item, SparseGroup& to);
  void put_skipped(std::span<SparseGroup> groups);
  void number_by_first_use(std::span<SparseGroup> groups) const;
  std::uint32_t renumbered(Slot& slot) {
    if (slot.number == kNone) slot.number = slots_++;
    return slot.number;
  }

  Coverage covers_;
  std::vector<SparseGroup>* out_;
  std::size_t bytes_ = 0;
  // of the segment at hand
  std::size_t first_group_ = 0;
  std::vector<Slot> by_slot_;
  std::uint32_t slots_ = 0, tiles_ = 0;
  std::vector<LookedAt> looked_at_;
};

}  // namespace shm
