// Neighbourhoods of the nodes of cells of order 3 and higher.
// spec: "Grid nodes"
#include <algorithm>
#include <bit>

#include "codecs/shared/neighbourhood.h"
#include "mesh/node_layout.h"

namespace shm {

/// Finds the neighbours of a node of a grid: the nodes up to three steps back along the rows of its
/// cell. The rows are coded in this direction, so these nodes are known.
void NeighbourFinder::look_along_rows(Neighbourhood& item, const CellTopology& cell,
                                      std::uint32_t position) const {
  const NodeGrid& grid = cell.layout->grid;
  const NodeGrid::Place place = grid.places[position];
  item.kind = Neighbourhood::grid_node;
  std::uint32_t known = 0;
  const auto is_reversed = [&](std::uint32_t a) { return (cell.reversed >> a & 1) != 0; };
  for (std::uint32_t a = 0; a < 3; ++a)
    if (place[a] == (is_reversed(a) ? 0 : grid.order))
      item.corner = static_cast<std::uint8_t>(item.corner | 1u << a);
  const auto take = [&](std::size_t index, std::uint32_t node) {
    item.at[index] = cell.slots[node < cell.layout->corners ? cell.framed[node] : node];
    known |= 1u << index;
  };
  const auto take_back = [&](std::size_t index, const std::array<std::uint32_t, 3>& back) {
    NodeGrid::Place from = place;
    for (std::uint32_t a = 0; a < 3; ++a)  // a place outside the grid has a coordinate above p
      from[a] = static_cast<std::uint8_t>(is_reversed(a) ? place[a] + back[a] : place[a] - back[a]);
    const std::uint32_t node = grid.position(from);
    if (node != NodeGrid::kNowhere) take(index, node);
  };
  constexpr std::array<std::uint32_t, 3> kIndex = {0, kAtBeyond, kAtFarther};
  for (std::uint32_t a = 0; a < 3; ++a) {
    std::array<std::uint32_t, 3> back{};
    back[a] = 1;
    take_back(a, back);
  }
  const MidNode& node = cell.layout->mid[position];
  if (node.kind == MidNode::edge && std::popcount(known) < 2) {
    // A node of an edge whose neighbours are all on this edge. Its end ahead is known, too.
    known = 0;
    const NodeGrid::Place first = grid.places[node.corner[0]], second = grid.places[node.corner[1]];
    std::uint32_t axis = 2;  // rows lead along the last axis on which the ends differ
    while (first[axis] == second[axis]) --axis;
    const bool is_ahead = (first[axis] < second[axis]) != is_reversed(axis);
    const NodeGrid::Place& from = is_ahead ? first : second;
    const NodeGrid::Place& to = is_ahead ? second : first;
    const std::uint32_t step = is_ahead ? node.step[0] : grid.order - node.step[0];
    for (std::uint32_t back = 1; back <= std::min(step, 3u); ++back) {
      NodeGrid::Place at{};
      for (std::uint32_t a = 0; a < 3; ++a)
        at[a] =
            static_cast<std::uint8_t>(from[a] + (to[a] - from[a]) / static_cast<int>(grid.order) *
                                                    static_cast<int>(step - back));
      take(kIndex[back - 1], grid.position(at));
    }
    take(kAtDiagonal, grid.position(to));
    item.corner = static_cast<std::uint8_t>(std::min(grid.order - step, 7u));
  } else {
    for (std::uint32_t a = 0; a < 3; ++a)
      for (std::uint32_t steps = 2; steps <= 3; ++steps) {
        std::array<std::uint32_t, 3> back{};
        back[a] = steps;
        take_back(kIndex[steps - 1] + a, back);
      }
    take_back(kAtDiagonal, {1, 1, 0});
    take_back(kAtDiagonal + 1, {1, 0, 1});
    take_back(kAtDiagonal + 2, {0, 1, 1});
    take_back(kAtOpposite, {1, 1, 1});
  }
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((known >> a & 1) != 0 && vertices_[item.at[a]].full) known |= Neighbourhood::kThird << a;
  item.known = static_cast<std::uint16_t>(known);
}

}  // namespace shm
