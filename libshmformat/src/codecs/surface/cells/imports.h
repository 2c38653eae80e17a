// Imports: codes which of the vertices that a segment introduces are owned by an earlier segment,
// and predicts the numbers of these. A cut goes along faces, so its vertices are neighbours:
// usually a vertex is imported if its known neighbours in the cell are.
// spec: "Imports"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "codecs/shared/stencil.h"
#include "entropy/range_coder.h"
#include "mesh/cell_topology.h"

namespace shm {

template <class Coder>
class ImportFlags {
 public:
  /// Call it before the vertices of a cell: the states of its new vertices become unknown.
  void begin_cell(const CellTopology& cell);
  /// Codes whether the new vertex at `position` is imported. Call it for the new vertices of a cell
  /// in the order of new_positions.
  bool code(Coder& coder, const CellTopology& cell, std::uint32_t position, bool imported);
  /// Returns the stencil at `position` when only imported vertices count as known.
  Stencil stencil(const CellTopology& cell, std::uint32_t position) const;

 private:
  enum State : std::uint8_t { unknown, own, imported };

  State state(const CellTopology& cell, std::uint32_t position) const {
    return state_[cell.slots[position]];
  }
  AdaptiveBit& model(const CellTopology& cell, std::uint32_t position);

  std::vector<State> state_;  // by vertex slot
  std::array<std::array<AdaptiveBit, 27>, 8> at_corner_;
  std::array<AdaptiveBit, 9> at_edge_;
  std::array<std::array<AdaptiveBit, 4>, 32> at_node_;
};

}  // namespace shm
