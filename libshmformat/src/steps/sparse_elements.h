// Sparse elements: the elements that a column (the coder of an array) needs if the array covers
// only a few elements of the mesh. These are the covered elements, and those uncovered elements
// from which covered elements are predicted. With these elements, a column produces the same values
// as with all elements. SparseGroupBuilder receives the groups that have covered elements, in
// order. It produces the same groups without the elements that are not needed. These groups need 60
// bytes of memory for each covered element, and at most 4 bytes for each slot to which a covered
// element refers.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/surface/values/column_coder.h"

namespace shm {

/// The elements of one group that a column (the coder of an array) needs.
struct SparseGroup {
  /// One tile. `items_end` and `skipped_end` are the indices in `items` and `skipped` after the
  /// last entry of the tile. `uncovered` is the number of uncovered elements in this tile and in
  /// preceding tiles without covered elements.
  struct Tile {
    std::uint32_t items_end = 0, skipped_end = 0, uncovered = 0;
  };

  std::vector<Neighbourhood> items;    ///< covered elements, with renumbered slots
  std::vector<std::uint32_t> skipped;  ///< slots of uncovered elements
  std::vector<Tile> tiles;             ///< tiles with covered elements
  std::vector<std::uint64_t> numbers;  ///< numbers of the covered elements, if known
  /// Number of slots (after renumbering) that this group and earlier groups use.
  std::uint32_t slots = 0;
  /// Upper bound on the original slots (before renumbering) of all elements of this group and of
  /// earlier groups: each slot is less than this number.
  std::uint32_t all_slots = 0;
  std::uint32_t uncovered_behind = 0;  ///< number of uncovered elements after the last tile

  std::size_t bytes() const {
    return sizeof(SparseGroup) + items.capacity() * sizeof(Neighbourhood) +
           skipped.capacity() * sizeof(std::uint32_t) + tiles.capacity() * sizeof(Tile) +
           numbers.capacity() * sizeof(std::uint64_t);
  }
  /// Converts the group to the form that a column reads. All covered elements get the block number
  /// `covered`, so the column's array must cover this block.
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

/// Builds the sparse groups of a mesh, segment by segment. At the end of each segment, it frees its
/// data about slots.
class SparseGroupBuilder {
 public:
  /// Creates a builder that appends to `out`. `out` and `blocks` must outlive this object.
  SparseGroupBuilder(std::span<const std::uint32_t> blocks, std::vector<SparseGroup>& out)
      : covers_(blocks), out_(&out) {}

  /// Adds the next group that has covered elements. The list of items or the list of blocks in
  /// `all` may be empty. Every slot in the items must be less than `slots`. `numbers` contains the
  /// numbers of all elements or of the covered elements, or is empty.
  void add_group(const TiledItems& all, std::uint32_t slots,
                 std::span<const std::uint64_t> numbers);
  /// Ends a segment. Must be called after the groups of each segment.
  void end_segment();
  /// Returns the size in bytes of the groups built so far, and of the data that is stored until the
  /// end of the segment.
  std::size_t bytes() const { return bytes_ + looked_at_.size() * sizeof(std::uint64_t); }

 private:
  /// Data about one slot. The slot is identified by its original number in the mesh.
  struct Slot {
    std::uint32_t number = kNone;  ///< number of the slot after renumbering
    /// If the most recent element in the slot is uncovered: index of the tile at which that element
    /// is skipped, counting only tiles with covered elements. Otherwise kNone.
    std::uint32_t skipped = kNone;
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
  /// The uncovered elements to which covered elements refer, as `tile << 32 | slot`. A column skips
  /// such an element before it codes the covered elements of the tile.
  std::vector<std::uint64_t> looked_at_;
};

}  // namespace shm
