// Sides of cells, for side sets: their shapes and nodes.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "shm/schema.h"

namespace shm::converters {

// Shape, node scheme and number of nodes of cells
struct CellKind {
  CellShape shape = CellShape::other;
  NodeScheme scheme = NodeScheme::lagrange;
  std::uint32_t nodes = 0;
  auto operator<=>(const CellKind&) const = default;
};

// Kind of one side of a cell, and the nodes of the side in the order of the mesh model. `nodes` is
// empty if the cell has no such side.
struct CellSide {
  CellKind kind;
  std::vector<std::uint64_t> nodes;
};

// Finds the nodes of the sides of cells. Sides are numbered from 1, as in Exodus. `flat`: true if
// the mesh is two-dimensional; the sides of its triangles and quads are then edges.
class SideFinder {
 public:
  CellSide side_of_cell(const BlockInfo& block, std::span<const std::uint64_t> corners,
                        std::uint64_t side, bool flat);
  // Returns the number of nodes on a side of the cells of a block, or 0 if the cells have no such
  // side.
  std::size_t nodes_of_side(const BlockInfo& block, std::uint64_t side, bool flat);

  // The nodes of a side, as positions in the node list of its cell
  struct SideNodes {
    CellKind kind;
    std::vector<std::uint16_t> at;
  };

 private:
  const SideNodes& find(const CellKind& cell, std::uint64_t side, bool flat);

  std::map<std::tuple<CellKind, std::uint64_t, bool>, SideNodes> known_;
};

}  // namespace shm::converters
