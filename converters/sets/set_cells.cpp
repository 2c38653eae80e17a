#include "sets/set_cells.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "base/failure.h"

namespace shm::converters {
namespace {

constexpr std::size_t kPiece = 16384;  // number of cells that are read together
using Corners = std::vector<std::uint8_t>;

// Corners of each side of a cell. The sides are numbered as in the Exodus manual.
const std::vector<Corners>& sides_of(CellShape shape, bool flat) {
  static const std::vector<Corners> none,
      triangle = {{0, 1}, {1, 2}, {2, 0}}, quad = {{0, 1}, {1, 2}, {2, 3}, {3, 0}},
      shell3 = {{0, 1, 2}, {0, 2, 1}, {0, 1}, {1, 2}, {2, 0}},
      shell4 = {{0, 1, 2, 3}, {0, 3, 2, 1}, {0, 1}, {1, 2}, {2, 3}, {3, 0}},
      tetrahedron = {{0, 1, 3}, {1, 2, 3}, {0, 3, 2}, {0, 2, 1}},
      pyramid = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {0, 3, 2, 1}},
      wedge = {{0, 1, 4, 3}, {1, 2, 5, 4}, {0, 3, 5, 2}, {0, 2, 1}, {3, 4, 5}},
      hexahedron = {{0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6},
                    {0, 4, 7, 3}, {0, 3, 2, 1}, {4, 5, 6, 7}};
  switch (shape) {
    case CellShape::triangle: return flat ? triangle : shell3;
    case CellShape::quad: return flat ? quad : shell4;
    case CellShape::tetrahedron: return tetrahedron;
    case CellShape::pyramid: return pyramid;
    case CellShape::wedge: return wedge;
    case CellShape::hexahedron: return hexahedron;
    default: return none;
  }
}

// Corners of the edges of a cell, in VTK's order. In second-order cells, each of these edges has a
// node at its midpoint.
const std::vector<Corners>& edges_of(CellShape shape) {
  static const std::vector<Corners> none,
      triangle = {{0, 1}, {1, 2}, {2, 0}}, quad = {{0, 1}, {1, 2}, {2, 3}, {3, 0}},
      tetrahedron = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}},
      pyramid = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}},
      wedge = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}},
      hexahedron = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                    {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
  switch (shape) {
    case CellShape::triangle: return triangle;
    case CellShape::quad: return quad;
    case CellShape::tetrahedron: return tetrahedron;
    case CellShape::pyramid: return pyramid;
    case CellShape::wedge: return wedge;
    case CellShape::hexahedron: return hexahedron;
    default: return none;
  }
}

// Corners of each face that can have a node at its centre. In a cell's list of nodes, the nodes at
// face centres come after the nodes at edge midpoints.
const std::vector<Corners>& middles_of(CellShape shape) {
  static const std::vector<Corners> none, quad = {{0, 1, 2, 3}}, triangle = {{0, 1, 2}},
                                          pyramid = {{0, 1, 2, 3}},
                                          wedge = {{0, 1, 3, 4}, {1, 2, 4, 5}, {0, 2, 3, 5}},
                                          hexahedron = {{0, 3, 4, 7}, {1, 2, 5, 6}, {0, 1, 4, 5},
                                                        {2, 3, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}};
  switch (shape) {
    case CellShape::triangle: return triangle;
    case CellShape::quad: return quad;
    case CellShape::pyramid: return pyramid;
    case CellShape::wedge: return wedge;
    case CellShape::hexahedron: return hexahedron;
    default: return none;
  }
}

std::size_t corners_of(CellShape shape) {
  switch (shape) {
    case CellShape::triangle: return 3;
    case CellShape::quad:
    case CellShape::tetrahedron: return 4;
    case CellShape::pyramid: return 5;
    case CellShape::wedge: return 6;
    case CellShape::hexahedron: return 8;
    default: return 0;
  }
}

}  // namespace

CellSide side_of_cell(CellShape shape, std::span<const std::uint64_t> corners, std::uint64_t side,
                      bool flat) {
  CellSide found;
  const auto& sides = sides_of(shape, flat);
  const std::size_t first_edge = corners_of(shape);
  if (side < 1 || side > sides.size() || corners.size() < first_edge) return found;
  const Corners& around = sides[side - 1];
  for (const std::uint8_t corner : around) found.nodes.push_back(corners[corner]);
  found.shape = around.size() == 2   ? CellShape::line
                : around.size() == 3 ? CellShape::triangle
                                     : CellShape::quad;
  const auto& edges = edges_of(shape);
  if (corners.size() < first_edge + edges.size()) return found;
  const std::size_t count = around.size() == 2 ? 1 : around.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t a = around[i], b = around[(i + 1) % around.size()];
    const auto edge = std::find_if(edges.begin(), edges.end(), [&](const Corners& e) {
      return (e[0] == a && e[1] == b) || (e[0] == b && e[1] == a);
    });
    found.nodes.push_back(corners[first_edge + static_cast<std::size_t>(edge - edges.begin())]);
  }
  Corners sorted = around;
  std::sort(sorted.begin(), sorted.end());
  const auto& middles = middles_of(shape);
  const auto middle = std::find(middles.begin(), middles.end(), sorted);
  const std::size_t place =
      first_edge + edges.size() + static_cast<std::size_t>(middle - middles.begin());
  // The node at the centre is added only if the side is a quad, because no type of second-order
  // triangle with a node at its centre exists in both Gmsh and Exodus.
  if (middle != middles.end() && place < corners.size() && around.size() == 4)
    found.nodes.push_back(corners[place]);
  return found;
}

std::size_t nodes_of_side(CellShape shape, std::uint32_t nodes_per_cell, std::uint64_t side,
                          bool flat) {
  // Only the first 27 nodes of a cell can be on its sides.
  constexpr std::uint32_t kMostNodes = 27;
  if (side < 1 || side > sides_of(shape, flat).size()) return 0;
  const std::vector<std::uint64_t> corners(std::min(nodes_per_cell, kMostNodes));
  return side_of_cell(shape, corners, side, flat).nodes.size();
}

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

void SetCells::add_block(const MeshSet& set, CellShape shape, std::uint32_t nodes) {
  info_.schema.blocks.push_back(BlockInfo{set.id, short_name_of(set), shape, nodes});
  info_.block_cells.push_back(0);
}

void SetCells::add_nodes(const MeshSet& set) {
  add_block(set, CellShape::vertex, 1);
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
            side_of_cell(info_.schema.blocks[batch.blocks[i]].shape, batch.cell(i),
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
    std::map<std::pair<CellShape, std::size_t>, std::vector<const CellSide*>> kinds;
    for (const CellSide& side : found[s]) kinds[{side.shape, side.nodes.size()}].push_back(&side);
    for (const auto& [kind, list] : kinds) {
      add_block(sets[s], kind.first, static_cast<std::uint32_t>(kind.second));
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
