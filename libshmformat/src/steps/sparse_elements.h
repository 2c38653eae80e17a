// SparseElements: the elements that a column needs for an array on few elements. These are the
// elements that the array covers, and the other elements to whose slots a covered element refers. A
// column over these elements produces the same values as a column over all elements. The builder
// receives the groups that have covered elements, in order. It produces the same groups without the
// elements that are not needed. It needs 60 bytes of memory for each covered element, and at most 4
// for each slot to which a covered element refers.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/surface/values/column_coder.h"

namespace shm {

/// The elements of one group that a column needs.
struct SparseGroup {
  /// End positions of the tile in `items` and in `skipped`. `uncovered` is the number of uncovered
  /// elements in the tile and in the preceding tiles without covered elements.
  struct Tile {
    std::uint32_t items_end = 0, skipped_end = 0, uncovered = 0;
  };

  std::vector<Neighbourhood> items;    ///< covered elements, with renumbered slots
  std::vector<std::uint32_t> skipped;  ///< slots of uncovered elements
  std::vector<Tile> tiles;             ///< tiles with covered elements
  std::vector<std::uint64_t> numbers;  ///< numbers of the covered elements, if known
  std::uint32_t slots = 0;  ///< upper bound of the slots used in this group and in earlier groups
  /// Upper bound of the slots of all elements of this group and of earlier groups.
  std::uint32_t all_slots = 0;
  std::uint32_t uncovered_behind = 0;  ///< number of uncovered elements after the last tile

  std::size_t bytes() const {
    return sizeof(SparseGroup) + items.capacity() * sizeof(Neighbourhood) +
           skipped.capacity() * sizeof(std::uint32_t) + tiles.capacity() * sizeof(Tile) +
           numbers.capacity() * sizeof(std::uint64_t);
  }
  /// Expands the group to items for a column that covers the block `covered`.
  void unfold(std::uint32_t covered, TiledItems& out) const;
};

/// Decides whether a block is among the blocks that an array covers.
class Coverage {
 public:
  /// Creates an object for an array that covers `blocks`. `blocks` must be in ascending order and
  /// outlive this object.
  explicit Coverage(std::span<const std::uint32_t> blocks) : blocks_(blocks) {}
  bool operator()(std::uint32_t block);

 private:
  std::span<const std::uint32_t> blocks_;
  std::uint32_t last_ = kNone;
  bool covers_last_ = false;
};

/// Builds the sparse groups of a mesh, segment after segment. At the end of each segment it frees
/// the data that it stores by slot.
class SparseGroupBuilder {
 public:
  /// Creates a builder that appends to `out`. `out` and `blocks` must outlive this object.
  SparseGroupBuilder(std::span<const std::uint32_t> blocks, std::vector<SparseGroup>& out)
      : covers_(blocks), out_(&out) {}

  /// Adds the next group that has covered elements. Either the items or the blocks of `all` may be
  /// missing. `slots` is larger than every slot in the items. `numbers` are the numbers of all
  /// elements or of the covered elements, or empty.
  void add_group(const TiledItems& all, std::uint32_t slots,
                 std::span<const std::uint64_t> numbers);
  /// Ends a segment. Must be called after the groups of each segment.
  void end_segment();
  /// Returns the size in bytes of the groups built so far, and of the data that is stored until the
  /// end of the segment.
  std::size_t bytes() const { return bytes_ + looked_at_.size() * sizeof(LookedAt); }

 private:
  /// Data of a slot, stored by the original number of the slot in the mesh.
  struct Slot {
    std::uint32_t number = kNone;   ///< number of the slot after renumbering
    std::uint32_t skipped = kNone;  ///< tile before which an uncovered element used the slot; kNone
                                    ///< if no uncovered element uses the slot
  };
  /// Uncovered element to which a covered element refers. A column skips this element before it
  /// codes the covered elements of a tile.
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
  // Data of the current segment.
  std::size_t first_group_ = 0;
  std::vector<Slot> by_slot_;
  std::uint32_t slots_ = 0, tiles_ = 0;
  std::vector<LookedAt> looked_at_;
};

}  // namespace shm
