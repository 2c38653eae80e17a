#include "sets/set_cells.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "base/failure.h"

namespace shm::converters {
namespace {

constexpr std::size_t kPiece = 16384;  // number of cells that are read together

}  // namespace

SetCells::SetCells(MeshSource& source, const std::vector<MeshSet>& sets, bool flat, Spool& spool)
    : ForwardingMesh(source),
      corners_(spool, sizeof(std::uint64_t)),
      own_blocks_(source.info().schema.blocks.size()),
      at_block_(own_blocks_) {
  info_ = source.info();
  for (const MeshSet& set : sets)
    if (set.kind == MeshSet::Kind::nodes) add_nodes(set);
  find_sides(sets, flat);
  if (info_.schema.blocks.size() > own_blocks_) leave_arrays_on_own_blocks();
}

// Restricts arrays that cover all blocks to the original blocks, because the added cells have no
// values.
void SetCells::leave_arrays_on_own_blocks() {
  constexpr std::size_t kMostListed = std::size_t{1} << 24;
  std::size_t listed = 0;
  for (ArrayInfo& array : info_.schema.arrays) {
    if (array.location != Location::cell || !array.blocks.empty()) continue;
    listed += own_blocks_;
    if (listed > kMostListed)
      throw Failure(
          Error{.code = ErrorCode::over_limit,
                .detail = "there are too many cell arrays and blocks to convert sets to cells",
                .section = "sets"});
    for (std::uint32_t b = 0; b < own_blocks_; ++b) array.blocks.push_back(b);
  }
}

void SetCells::add_block(const MeshSet& set, const CellKind& kind) {
  info_.schema.blocks.push_back(
      BlockInfo{set.id, short_name_of(set), kind.shape, kind.nodes, kind.scheme});
  info_.block_cells.push_back(0);
}

void SetCells::add_nodes(const MeshSet& set) {
  add_block(set, {CellShape::vertex, NodeScheme::lagrange, 1});
  info_.block_cells.back() = set.members.size();
  for (const std::uint64_t node : set.members)
    corners_.append(1, reinterpret_cast<const std::byte*>(&node));
}

// Finds the sides of all side sets in one pass over the cells.
void SetCells::find_sides(const std::vector<MeshSet>& sets, bool flat) {
  struct Wanted {
    std::uint64_t cell;
    std::size_t set, place;
    auto operator<=>(const Wanted&) const = default;
  };
  SideFinder finder;
  std::vector<Wanted> wanted;
  std::vector<std::vector<CellSide>> found(sets.size());
  for (std::size_t s = 0; s < sets.size(); ++s) {
    if (sets[s].kind != MeshSet::Kind::sides) continue;
    found[s].resize(sets[s].members.size());
    for (std::size_t i = 0; i < sets[s].members.size(); ++i)
      wanted.push_back({sets[s].members[i], s, i});
  }
  std::sort(wanted.begin(), wanted.end());
  std::size_t next = 0;
  std::uint64_t cell = 0;
  CellBatch batch;
  source_.rewind_cells();
  while (next < wanted.size() && source_.next_cells(batch, kPiece)) {
    for (std::size_t i = 0; i < batch.size(); ++i, ++cell) {
      for (; next < wanted.size() && wanted[next].cell == cell; ++next) {
        const Wanted& member = wanted[next];
        const std::int32_t side = sets[member.set].sides[member.place];
        found[member.set][member.place] =
            finder.side_of_cell(info_.schema.blocks[batch.blocks[i]], batch.cell(i),
                                static_cast<std::uint64_t>(side), flat);
      }
    }
  }
  for (std::size_t s = 0; s < sets.size(); ++s) {
    if (sets[s].kind != MeshSet::Kind::sides) continue;
    const auto unknown = [](const CellSide& side) { return side.nodes.empty(); };
    if (std::any_of(found[s].begin(), found[s].end(), unknown)) {
      left_out_.push_back(label_of(sets[s]));
      continue;
    }
    std::map<CellKind, std::vector<const CellSide*>> kinds;
    for (const CellSide& side : found[s]) kinds[side.kind].push_back(&side);
    for (const auto& [kind, list] : kinds) {
      add_block(sets[s], kind);
      info_.block_cells.back() = list.size();
      for (const CellSide* side : list)
        corners_.append(side->nodes.size(), reinterpret_cast<const std::byte*>(side->nodes.data()));
    }
  }
}

void SetCells::rewind_cells() {
  source_.rewind_cells();
  next_added_ = next_corner_ = 0;
  at_block_ = own_blocks_;
}

bool SetCells::next_cells(CellBatch& out, std::size_t max_cells) {
  if (at_block_ == own_blocks_ && next_added_ == 0 && source_.next_cells(out, max_cells))
    return true;
  out.clear();
  while (out.size() < max_cells && at_block_ < info_.schema.blocks.size()) {
    if (next_added_ == info_.block_cells[at_block_]) {
      ++at_block_;
      next_added_ = 0;
      continue;
    }
    const std::uint32_t nodes = info_.schema.blocks[at_block_].nodes_per_cell;
    out.blocks.push_back(static_cast<std::uint32_t>(at_block_));
    const std::size_t size = out.corners.size();
    out.corners.resize(size + nodes);
    corners_.read(next_corner_, nodes, reinterpret_cast<std::byte*>(out.corners.data() + size));
    out.corner_begin.push_back(out.corners.size());
    next_corner_ += nodes;
    ++next_added_;
  }
  return out.size() > 0;
}

}  // namespace shm::converters
