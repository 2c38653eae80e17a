#include "codecs/surface/cells/imports.h"

#include <algorithm>

#include "base/lists.h"
#include "entropy/range_coder.h"
#include "mesh/hexahedron.h"

namespace shm {
template <class Coder>
void ImportFlags<Coder>::begin_cell(const CellTopology& cell) {
  for (std::uint32_t position : cell.new_positions) {
    at_slot(state_, cell.slots[position]) = unknown;
  }
}

template <class Coder>
AdaptiveBit& ImportFlags<Coder>::model(const CellTopology& cell, std::uint32_t position) {
  if (cell.hexahedral && position < 8) {
    const std::uint32_t bits = kCornerBits[position];
    std::size_t context = 0;
    for (std::uint32_t edge : {1u, 2u, 4u})
      context = context * 3 + state(cell, kCornerBits[bits ^ edge]);
    return at_corner_[position][context];
  }
  if (cell.hexahedral && position < 20 && cell.slots.size() >= 20 && !cell.layout->is_grid()) {
    const auto& edge = kEdgeCorners[position - 8];
    return at_edge_[3u * state(cell, cell.framed_position(edge[0])) +
                    state(cell, cell.framed_position(edge[1]))];
  }
  // Bit 0 is set if the segment owns at least one known node of the cell; bit 1 is set if at least
  // one is imported
  std::size_t context = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(cell.slots.size(), 64); ++i)
    if (const State other = state_[cell.slots[i]]; other != unknown) context |= other;
  return at_node_[std::min<std::uint32_t>(position, 31)][context];
}

template <class Coder>
bool ImportFlags<Coder>::code(Coder& coder, const CellTopology& cell, std::uint32_t position,
                              bool is_imported) {
  is_imported = coder.bit(model(cell, position), is_imported);
  state_[cell.slots[position]] = is_imported ? imported : own;
  return is_imported;
}

template <class Coder>
Stencil ImportFlags<Coder>::stencil(const CellTopology& cell, std::uint32_t position) const {
  std::uint64_t known = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(cell.slots.size(), 64); ++i)
    if (i != position && cell.slots[i] != cell.slots[position] && state_[cell.slots[i]] == imported)
      known |= std::uint64_t{1} << i;
  return stencil_of(cell, position, known);
}

template class ImportFlags<RangeEncoder>;
template class ImportFlags<RangeDecoder>;

}  // namespace shm
