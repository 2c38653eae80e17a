// Imports: codes which of the vertices that a segment introduces are owned by an earlier segment,
// and predicts their numbers. A cut runs along faces, so imported vertices are neighbours of each
// other: usually a vertex is imported if its known neighbours in the cell are imported.
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
  /// Prepares the vertices of a cell: the import states of its new vertices become unknown. Call it
  /// before code() for these vertices.
  void begin_cell(const CellTopology& cell);
  /// Codes whether the new vertex at `position` is imported. Call it for the new vertices of a cell
  /// in the order of new_positions.
  bool code(Coder& coder, const CellTopology& cell, std::uint32_t position, bool imported);
  /// Returns the stencil of the vertex at `position` if only imported vertices count as known.
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
