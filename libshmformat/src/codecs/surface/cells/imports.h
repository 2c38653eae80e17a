// Imports: codes which new vertices of a segment are owned by an earlier segment (imported), and
// predicts the numbers of these vertices. The cut between two segments runs along faces, so
// imported vertices are neighbours of each other. A vertex is usually imported if its known
// neighbours in the cell are imported.
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
  /// Begins a cell: resets the state of its new vertices to `unknown`. Call this function before
  /// calling code() for these vertices.
  void begin_cell(const CellTopology& cell);
  /// Codes whether the new vertex at `position` is imported. Call it for the new vertices of a cell
  /// in the order of new_positions.
  bool code(Coder& coder, const CellTopology& cell, std::uint32_t position, bool imported);
  /// Returns the stencil (the neighbours that predict a value) of the vertex at `position`. Only
  /// imported vertices count as known.
  Stencil stencil(const CellTopology& cell, std::uint32_t position) const;

 private:
  enum State : std::uint8_t { unknown, own, imported };

  State state(const CellTopology& cell, std::uint32_t position) const {
    return state_[cell.slots[position]];
  }
  AdaptiveBit& model(const CellTopology& cell, std::uint32_t position);

  std::vector<State> state_;  // import states by vertex slot
  std::array<std::array<AdaptiveBit, 27>, 8> at_corner_;
  std::array<AdaptiveBit, 9> at_edge_;
  std::array<std::array<AdaptiveBit, 4>, 32> at_node_;
};

}  // namespace shm
