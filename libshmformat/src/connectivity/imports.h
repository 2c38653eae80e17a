// Imports: which of the vertices that a segment introduces are owned by an earlier segment, and
// how the numbers of these are predicted.
// A cut goes along faces, so its vertices are neighbours: as a rule the next vertex is what its
// known neighbours in the cell are.
// spec: "Imports"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "connectivity/stencil.h"
#include "entropy/range_coder.h"
#include "surface/cell_topology.h"

namespace shm {

template <class Coder>
class ImportFlags {
 public:
  /// Comes before the vertices of the cell: nothing is known of the new ones yet.
  void begin_cell(const CellTopology& cell);
  /// Codes whether the new vertex at `position` is imported; the cell's new vertices come in order
  /// of new_positions.
  bool code(Coder& coder, const CellTopology& cell, std::uint32_t position, bool imported);
  /// The stencil at `position` where only imported vertices are known.
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
