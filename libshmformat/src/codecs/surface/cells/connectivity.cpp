#include "codecs/surface/cells/connectivity.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace shm {

template <class Coder>
Connectivity<Coder>::Connectivity(const Schema& schema) : schema_(&schema) {
  for (const BlockInfo& block : schema.blocks)
    if (!is_hexahedral(block) && !others_) others_ = std::make_unique<CellCorners<Coder>>(surface_);
  layouts_.resize(schema.blocks.size());
}

template <class Coder>
void Connectivity<Coder>::set_codec(ConnectivityCodec codec) {
  const OpenFaces* const open = others_ ? &others_->faces() : nullptr;
  has_codec_ = true;
  switch (codec) {
    case ConnectivityCodec::paper:
      hexahedra_ = std::make_unique<PaperHexahedra<Coder>>(surface_);
      break;
    case ConnectivityCodec::automatic:
    case ConnectivityCodec::shifts:
    case ConnectivityCodec::patterns:  // shifts and patterns need no surface
    case ConnectivityCodec::rows:
      hexahedra_ = std::make_unique<RowHexahedra<Coder>>(surface_, open);
      break;
    case ConnectivityCodec::mixed:
      hexahedra_ = std::make_unique<MixedRows<Coder>>(surface_, open);
      break;
    case ConnectivityCodec::replay:
      hexahedra_ = std::make_unique<ReplayHexahedra<Coder>>(surface_, schema_->order == Order::keep,
                                                            schema_->earlier_values);
      break;
  }
  finds_by_number_ =
      with_hexahedra([]<class Hexahedra>(Hexahedra&) { return FindsByNumber<Hexahedra>; });
}

template <class Coder>
void Connectivity<Coder>::set_number(std::uint32_t slot, std::uint64_t number) {
  with_hexahedra([&]<class Hexahedra>(Hexahedra& hexahedra) {
    if constexpr (FindsByNumber<Hexahedra>) hexahedra.set_number(slot, number);
  });
}

template <class Coder>
bool Connectivity<Coder>::code_cell(Coder& symbols, Coder& corner_order, const StoredCell& stored,
                                    CellTopology& cell) {
  if (!has_codec_) set_codec(ConnectivityCodec::rows);
  if constexpr (!Coder::kDecodes) {
    cell.block = stored.block;
    cell.slots = stored.slots;
    cell.last_use = stored.last_use;
  }
  if (!code_block(symbols, cell)) return false;
  const BlockInfo& block = schema_->blocks[cell.block];
  cell.hexahedral = is_hexahedral(block);
  cell.new_positions.clear();
  cell.face_mask = 0;
  cell.cell_slot = kNone;
  cell.by_faces = false;
  cell.layout = layouts_[cell.block].get(block);
  if (cell.layout != nullptr && !mid_nodes_) mid_nodes_.emplace(surface_);
  cell.rows = nullptr;
  for (std::uint8_t i = 0; i < 8; ++i) cell.stored_corner[i] = i;
  if constexpr (!Coder::kDecodes) sort_numbers(stored);
  if (block.shape == CellShape::faces && !code_polyhedron(symbols, stored, cell)) return false;
  if (cell.hexahedral && !code_hexahedron(symbols, corner_order, stored, cell)) return false;
  if (cell.layout != nullptr && cell.layout->is_grid()) cell.begin_grid();
  if constexpr (!Coder::kDecodes)
    for (const std::uint32_t position : cell.new_positions)
      fill_farther_repeats(stored, cell, position);
  const std::uint32_t corners = cell.hexahedral ? 8
                                : block.shape == CellShape::hexahedron
                                    ? 0
                                    : corner_count(block.shape, cell.slots.size());
  if (!cell.hexahedral && corners > 0 &&
      !others_->code(symbols, stored, cell, block.shape,
                     [&](std::uint32_t i) { add_vertex(stored, cell, i); }))
    return false;
  // node_ids_ is used only for cells that have nodes other than corners.
  if (!cell.by_faces && cell.slots.size() > corners && !code_nodes(symbols, stored, cell, corners))
    return false;
  // Skip the corners of a hexahedron if its coder finds vertices by number: such a coder needs no
  // use counts and has already coded the last uses.
  const std::size_t done = cell.hexahedral && finds_by_number_ ? 8 : 0;
  for (std::size_t i = done; i < cell.slots.size(); ++i) surface_.count_use(cell.slots[i]);
  if (others_) {
    others_->take_note(cell, corners > 0 ? block.shape : CellShape::other, order_matters(block));
    cell.shape = block.shape;
    cell.corners = corners;
    cell.behind = cell.by_faces ? polyhedra_->behind() : others_->faces().behind();
  }
  if (cell.slots.size() > done) code_last_use(symbols, cell);
  return true;
}

template <class Coder>
void Connectivity<Coder>::finish_cell(const CellTopology& cell) {
  const auto finalize = [&](std::size_t i) {
    const std::uint32_t slot = cell.slots[i];
    if (finds_by_number_)
      with_hexahedra([&]<class Hexahedra>(Hexahedra& hexahedra) {
        if constexpr (FindsByNumber<Hexahedra>) hexahedra.forget(slot);
      });
    if (others_) others_->forget(slot);
    if (mid_nodes_) mid_nodes_->forget(slot);
    if (polyhedra_) polyhedra_->forget(slot);
    surface_.finalize(slot);
  };
  std::size_t i = 0;
  // Check eight positions at a time, since usually at most one of them is marked as last use.
  for (; i + 8 <= cell.slots.size(); i += 8) {
    std::uint32_t marks = 0;
    for (std::size_t k = 0; k < 8; ++k) marks |= std::uint32_t{cell.last_use[i + k]} << k;
    for (; marks != 0; marks &= marks - 1)
      finalize(i + static_cast<std::size_t>(std::countr_zero(marks)));
  }
  for (; i < cell.slots.size(); ++i)
    if (cell.last_use[i] != 0) finalize(i);
  if (cell.hexahedral && !finds_by_number_) surface_.end_cell();
}

template <class Coder>
bool Connectivity<Coder>::code_hexahedron(Coder& symbols, Coder& corner_order,
                                          const StoredCell& stored, CellTopology& cell) {
  const bool in_order = order_matters(schema_->blocks[cell.block]);
  return with_hexahedra([&](auto& hexahedra) {
    return hexahedra.code(symbols, corner_order, stored, cell, in_order);
  });
}

/// Codes a polyhedron: either its faces and nodes, or only its number of nodes.
template <class Coder>
bool Connectivity<Coder>::code_polyhedron(Coder& symbols, const StoredCell& stored,
                                          CellTopology& cell) {
  if (!polyhedra_) polyhedra_ = std::make_unique<Polyhedra<Coder>>(surface_);
  const std::uint64_t number = others_->faces().next_number();
  if (!polyhedra_->code(symbols, stored, cell, number,
                        [&](std::uint32_t i) { add_vertex(stored, cell, i); }))
    return false;
  if (!cell.by_faces) return code_count(symbols, cell);
  if constexpr (Coder::kDecodes) {
    const std::uint32_t stated = schema_->blocks[cell.block].nodes_per_cell;
    if (stated != 0 && cell.slots.size() != stated) return false;
    cell.last_use.assign(cell.slots.size(), 0);
  }
  return true;
}

template <class Coder>
bool Connectivity<Coder>::code_block(Coder& symbols, CellTopology& cell) {
  if (schema_->blocks.size() > 1 && !symbols.bit(same_block_, cell.block == last_block_)) {
    const std::uint64_t block = code_number(symbols, block_number_, cell.block);
    if (block >= schema_->blocks.size()) return false;
    cell.block = static_cast<std::uint32_t>(block);
  } else {
    cell.block = last_block_;
  }
  if (cell.block >= schema_->blocks.size()) return false;
  last_block_ = cell.block;
  // The faces of a polyhedron determine its number of nodes.
  return schema_->blocks[cell.block].shape == CellShape::faces || code_count(symbols, cell);
}

template <class Coder>
bool Connectivity<Coder>::code_count(Coder& symbols, CellTopology& cell) {
  std::uint64_t count = schema_->blocks[cell.block].nodes_per_cell;
  if (count == 0) count = code_number(symbols, node_count_, cell.slots.size());
  if (count > kMaxNodesPerCell) return false;
  if constexpr (Coder::kDecodes) {
    if (cell.slots.size() != count) {
      cell.slots.resize(static_cast<std::size_t>(count));
      cell.last_use.resize(static_cast<std::size_t>(count));
    }
    std::fill(cell.slots.begin(), cell.slots.end(), kNone);
    std::fill(cell.last_use.begin(), cell.last_use.end(), std::uint8_t{0});
  }
  return true;
}

/// Codes the nodes that are not corners. If the layout of nodes is known, a node is predicted from
/// its position in the cell. Otherwise its id is coded relative to the id at the same rank in the
/// previous cell of the block. The rank of a node is its index in the order of coding.
template <class Coder>
bool Connectivity<Coder>::code_nodes(Coder& symbols, const StoredCell& stored, CellTopology& cell,
                                     std::uint32_t first) {
  auto& last = node_ids_[cell.block];
  std::uint64_t shift = 0;  // id of the previous node, minus the id at the same rank in the
                            // previous cell of the block
  const std::size_t count = cell.slots.size();
  for (std::uint32_t rank = 0; rank < count; ++rank) {
    const std::uint32_t i = cell.ranked_position(rank);
    if (rank >= first) {
      const MidNode* node = cell.layout == nullptr ? nullptr : cell.layout->at(i);
      if (node != nullptr) {
        if (rank == cell.layout->corners) begin_layout(cell);
        if constexpr (!Coder::kDecodes)
          if (const std::uint32_t same = earlier_rank(stored, cell, rank); same != kNone)
            cell.slots[i] = cell.slots[cell.ranked_position(same)];
      }
      if (node == nullptr || !mid_nodes_->code(symbols, cell, *node, i)) {
        if (!code_node(symbols, stored, cell, rank, shift)) return false;
      } else if (cell.slots[i] == kNone) {
        add_vertex(stored, cell, i);
      }
      if (node != nullptr) mid_nodes_->note(cell, *node, i);
    }
    const std::uint64_t id = surface_.vertex(cell.slots[i]).id;
    if (rank >= last.size())
      last.push_back(id);
    else if (rank >= first)
      last[rank] = id;
  }
  return true;
}

/// Encoding: searches the kMaxLastUse ranks before `rank` for the vertex at `rank`. Returns the
/// lowest rank with this vertex, or kNone if the vertex does not occur there.
template <class Coder>
std::uint32_t Connectivity<Coder>::earlier_rank(const StoredCell& stored, const CellTopology& cell,
                                                std::uint32_t rank) {
  const auto number = [&](std::uint32_t r) {
    return stored.numbers[cell.stored_position(cell.ranked_position(r))];
  };
  for (std::uint32_t r = rank > kMaxLastUse ? rank - kMaxLastUse : 0; r < rank; ++r)
    if (number(r) == number(rank)) return r;
  return kNone;
}

/// Encoding: sorts the positions of a cell's nodes by vertex number. This is needed only for cells
/// with more than kMaxLastUse nodes.
template <class Coder>
void Connectivity<Coder>::sort_numbers(const StoredCell& stored) {
  positions_.clear();
  if (stored.numbers.size() <= kMaxLastUse) return;
  for (std::uint32_t i = 0; i < stored.numbers.size(); ++i)
    positions_.push_back({stored.numbers[i], i});
  std::sort(positions_.begin(), positions_.end());
}

/// Encoding: copies the slot of the new vertex at position `i` to later positions of the cell that
/// have the same vertex number. This is needed only at a distance of more than kMaxLastUse ranks,
/// since repetitions at smaller distances are coded by the models. The positions of a grid are not
/// sorted by rank; there, the slot is copied to all positions that are not corners.
template <class Coder>
void Connectivity<Coder>::fill_farther_repeats(const StoredCell& stored, CellTopology& cell,
                                               std::uint32_t i) {
  if (positions_.empty()) return;
  const std::uint64_t number = stored.numbers[cell.stored_position(i)];
  const std::pair<std::uint64_t, std::uint32_t> from{
      number, cell.rows != nullptr ? cell.layout->corners : i + kMaxLastUse};
  for (auto it = std::lower_bound(positions_.begin(), positions_.end(), from);
       it != positions_.end() && it->first == number; ++it)
    cell.slots[it->second] = cell.slots[i];
}

/// Prepares the layout of a cell's nodes. Call it before the first node that is not a corner.
template <class Coder>
void Connectivity<Coder>::begin_layout(CellTopology& cell) {
  for (std::uint8_t i = 0; i < 8; ++i) cell.framed[cell.stored_corner[i]] = i;
  mid_nodes_->begin_cell(cell);
}

/// Introduces a new vertex at `position`.
template <class Coder>
void Connectivity<Coder>::add_vertex(const StoredCell& stored, CellTopology& cell,
                                     std::uint32_t position) {
  cell.new_positions.push_back(position);
  const std::uint32_t slot = cell.slots[position] = surface_.add_vertex();
  if (finds_by_number_ && schema_->order != Order::keep) set_number(slot, surface_.vertex(slot).id);
  // The models code repeats of a vertex only up to a distance of kMaxLastUse ranks. At a greater
  // distance, the vertex is found by its number.
  if constexpr (!Coder::kDecodes) fill_farther_repeats(stored, cell, position);
}

template <class Coder>
bool Connectivity<Coder>::code_node(Coder& symbols, const StoredCell& stored, CellTopology& cell,
                                    std::uint32_t rank, std::uint64_t& shift) {
  const auto& last = node_ids_[cell.block];
  const std::uint32_t i = cell.ranked_position(rank);
  while (nodes_.size() <= std::min<std::uint32_t>(rank, 31))
    nodes_.push_back(std::make_unique<NodeModel>());
  NodeModel& model = *nodes_[std::min<std::uint32_t>(rank, 31)];
  const std::uint64_t expected = (rank < last.size()          ? last[rank]
                                  : rank > 0 && !last.empty() ? last.back()
                                                              : 0) +
                                 shift;
  std::uint32_t repeats = kNone;
  if constexpr (!Coder::kDecodes) repeats = earlier_rank(stored, cell, rank);
  const bool is_new =
      symbols.bit(model.is_new[last_new_], cell.slots[i] == kNone && repeats == kNone);
  last_new_ = is_new;
  if (is_new) {
    add_vertex(stored, cell, i);
  } else if (rank > 0 && symbols.bit(model.repeated, repeats != kNone)) {
    const std::uint64_t back = code_number(symbols, model.repeat, rank - 1 - repeats);
    if (back >= rank) return false;
    cell.slots[i] = cell.slots[cell.ranked_position(rank - 1 - static_cast<std::uint32_t>(back))];
  } else {
    std::uint64_t id = 0;
    if constexpr (!Coder::kDecodes) id = surface_.vertex(cell.slots[i]).id;
    id = expected + static_cast<std::uint64_t>(
                        code_signed(symbols, model.step, static_cast<std::int64_t>(id - expected)));
    cell.slots[i] = surface_.slot_of(id);
    if (cell.slots[i] == kNone) return false;
    if (rank < last.size()) shift = id - last[rank];
  }
  return true;
}

/// Codes the last uses of corners, if the cell's coder has models for them. Returns the number of
/// corners whose last uses have been coded.
template <class Coder>
std::size_t Connectivity<Coder>::code_last_use_of_corners(Coder& symbols, CellTopology& cell) {
  if (cell.hexahedral)
    return with_hexahedra([&]<class Hexahedra>(Hexahedra& hexahedra) -> std::size_t {
      if constexpr (CodesLastUse<Hexahedra, Coder>) hexahedra.code_last_use(symbols, cell);
      return CodesLastUse<Hexahedra, Coder> || FindsByNumber<Hexahedra> ? 8 : 0;
    });
  const CellShape shape = schema_->blocks[cell.block].shape;
  if (shape == CellShape::hexahedron) return 0;
  const std::uint32_t corners = corner_count(shape, cell.slots.size());
  if (corners > 0) others_->code_last_use(symbols, cell, shape);
  return corners;
}

template <class Coder>
void Connectivity<Coder>::code_last_use(Coder& symbols, CellTopology& cell) {
  if (cell.by_faces) return polyhedra_->code_last_use(symbols, cell);
  std::size_t i = code_last_use_of_corners(symbols, cell);
  const std::size_t end = cell.rows != nullptr
                              ? cell.slots.size()
                              : std::min<std::size_t>(cell.slots.size(), kMaxLastUse);
  for (; i < end; ++i) {
    const auto begin = cell.slots.begin();
    if (std::find(begin, begin + static_cast<std::ptrdiff_t>(i), cell.slots[i]) !=
        begin + static_cast<std::ptrdiff_t>(i)) {
      cell.last_use[i] = 0;
      continue;
    }
    if (const MidNode* node = cell.layout == nullptr ? nullptr : cell.layout->at(i)) {
      cell.last_use[i] =
          mid_nodes_->code_last_use(symbols, cell, *node, static_cast<std::uint32_t>(i),
                                    cell.last_use[i] != 0)
              ? 1
              : 0;
      continue;
    }
    const auto& vertex = surface_.vertex(cell.slots[i]);
    const bool corner = cell.hexahedral && i < 8;
    auto& model = last_use_[corner ? 1 : 0][std::min<std::uint32_t>(vertex.face_count, 5)]
                           [std::min<std::uint32_t>(vertex.uses, 8)];
    auto& before = last_finalized_[i % 8];
    before = symbols.bit(model[before], cell.last_use[i] != 0) ? 1 : 0;
    cell.last_use[i] = before;
  }
}

template class Connectivity<RangeEncoder>;
template class Connectivity<RangeDecoder>;

}  // namespace shm
