#include "steps/sparse_elements.h"

#include <algorithm>
#include <utility>

#include "base/lists.h"

namespace shm {

void SparseGroup::unfold(std::uint32_t covered, TiledItems& out) const {
  out.clear();
  out.tile_begin.clear();
  std::size_t item = 0, skip = 0;
  for (const Tile& tile : tiles) {
    out.tile_begin.push_back(out.items.size());
    out.left_out.push_back(std::uint64_t{tile.uncovered} - (tile.skipped_end - skip));
    for (; skip < tile.skipped_end; ++skip) {
      out.items.emplace_back().self = skipped[skip];
      out.blocks.push_back(kNone);
    }
    for (; item < tile.items_end; ++item) {
      out.items.push_back(items[item]);
      out.blocks.push_back(covered);
    }
  }
  out.tile_begin.push_back(out.items.size());
  out.left_out.push_back(uncovered_behind);
}

/// Returns true if the array covers `block`. Stores the most recent result, because consecutive
/// elements usually belong to the same block.
bool Coverage::operator()(std::uint32_t block) {
  if (block != last_) {
    last_ = block;
    covers_last_ = std::binary_search(blocks_.begin(), blocks_.end(), block);
  }
  return covers_last_;
}

/// Adds a group. A column codes each tile in two stages: it skips the uncovered elements, then it
/// codes the covered elements. Skipping an element means that the state of the most recently coded
/// element is stored in the slot of the skipped element. No element is coded until the next tile
/// with covered elements, so the state stays the same. Therefore an uncovered element may also be
/// skipped at that next tile, even if the tile belongs to a later group. An element need not be
/// skipped at all if its slot is reused before any covered element refers to the slot.
void SparseGroupBuilder::add_group(const TiledItems& all, std::uint32_t slots,
                                   std::span<const std::uint64_t> numbers) {
  SparseGroup& to = out_->emplace_back();
  to.all_slots = slots;
  const auto covers = [&](std::size_t i) { return all.blocks.empty() || covers_(all.blocks[i]); };
  for (std::size_t t = 0; t < all.tile_begin.size() && !all.items.empty(); ++t) {
    const std::size_t begin = all.tile_begin[t];
    const std::size_t end =
        t + 1 < all.tile_begin.size() ? all.tile_begin[t + 1] : all.items.size();
    bool any = false;
    for (std::size_t i = begin; i < end; ++i) {
      if (covers(i)) {
        any = true;
        continue;
      }
      at_slot(by_slot_, all.items[i].self).skipped = tiles_;
      ++to.uncovered_behind;
    }
    if (!any) continue;
    for (std::size_t i = begin; i < end; ++i)
      if (covers(i)) add_covered(all.items[i], to);
    to.tiles.push_back(
        {static_cast<std::uint32_t>(to.items.size()), 0, std::exchange(to.uncovered_behind, 0)});
    ++tiles_;
  }
  const bool of_all = numbers.size() == all.blocks.size();
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (!of_all || covers(i)) push_tightly(to.numbers, numbers[i]);
  bytes_ += to.bytes();
}

void SparseGroupBuilder::add_covered(const Neighbourhood& item, SparseGroup& to) {
  expect_more(to.items, 1);
  Neighbourhood& sparse = to.items.emplace_back(item);
  for (std::size_t i = 0; i < sparse.at.size(); ++i) {
    if ((item.known >> i & 1) == 0) {
      sparse.at[i] = 0;
      continue;
    }
    Slot& slot = at_slot(by_slot_, item.at[i]);
    sparse.at[i] = renumbered(slot);
    if (slot.skipped != kNone)
      looked_at_.push_back(std::uint64_t{slot.skipped} << 32 | slot.number);
    slot.skipped = kNone;
  }
  Slot& self = at_slot(by_slot_, item.self);
  sparse.self = renumbered(self);
  self.skipped = kNone;
}

void SparseGroupBuilder::end_segment() {
  const auto groups = std::span(*out_).subspan(first_group_);
  put_skipped(groups);
  number_by_first_use(groups);
  for (const SparseGroup& group : groups)
    bytes_ += group.skipped.capacity() * sizeof(std::uint32_t);
  first_group_ = out_->size();
  by_slot_.clear();
  looked_at_.clear();
  slots_ = tiles_ = 0;
}

void SparseGroupBuilder::put_skipped(std::span<SparseGroup> groups) {
  std::sort(looked_at_.begin(), looked_at_.end());
  std::size_t next = 0;
  std::uint32_t tile = 0;
  for (SparseGroup& group : groups) {
    const std::size_t begin = next;
    for (SparseGroup::Tile& ends : group.tiles) {
      while (next < looked_at_.size() && looked_at_[next] >> 32 == tile) ++next;
      ends.skipped_end = static_cast<std::uint32_t>(next - begin);
      ++tile;
    }
    group.skipped.reserve(next - begin);
    for (std::size_t i = begin; i < next; ++i)
      group.skipped.push_back(static_cast<std::uint32_t>(looked_at_[i]));
  }
}

/// Renumbers slots in the order of their first use. A group and all earlier groups then use only
/// the slots from 0 to SparseGroup::slots - 1.
void SparseGroupBuilder::number_by_first_use(std::span<SparseGroup> groups) const {
  std::vector<std::uint32_t> new_slots(slots_, kNone);
  std::uint32_t slots = 0;
  const auto number = [&](std::uint32_t& slot) {
    if (new_slots[slot] == kNone) new_slots[slot] = slots++;
    slot = new_slots[slot];
  };
  for (SparseGroup& group : groups) {
    for (std::uint32_t& slot : group.skipped) number(slot);
    for (Neighbourhood& item : group.items) {
      for (std::size_t i = 0; i < item.at.size(); ++i)
        if ((item.known >> i & 1) != 0) number(item.at[i]);
      number(item.self);
    }
    group.slots = slots;
  }
}

}  // namespace shm
