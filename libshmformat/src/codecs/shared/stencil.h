// Stencil: the live vertices from which the number of a new vertex is predicted, and the formula of
// the prediction. The formulas are the spectral prediction rules of the paper (section 3.2, Table
// 1), extended to every combination of known corners.
// spec: "Stencils"
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/cell_topology.h"
#include "mesh/hexahedron.h"

namespace shm {

struct Stencil {
  enum Kind : std::uint8_t {
    last,  ///< predicted number: the number of the most recently coded vertex; 0 for the first
           ///< vertex
    copy,  ///< predicted number: at[0]
    parallelogram,  ///< predicted number: at[0] + at[1] - at[2]
    lorenzo,        ///< predicted number: at[0] + at[1] + at[2] - at[3] - at[4] - at[5] + at[6]
  };
  Kind kind = last;
  std::array<std::uint32_t, 7> at{};  ///< slots of the vertices in the formula

  /// Returns the number of entries of `at` that this kind uses.
  std::uint32_t size() const {
    constexpr std::array<std::uint8_t, 4> kSize = {0, 1, 3, 7};
    return kSize[kind];
  }
};

/// Returns the predicted number, modulo 2^64. `numbers`: vertex numbers, indexed by slot. Returns 0
/// for the kind `last`.
std::uint64_t spectral(const Stencil& stencil, const std::vector<std::uint64_t>& numbers);

/// Returns the stencil of the new vertex at `position`. `known`: bit i is set if the node at
/// position i of the cell already has a number; there are bits for the first 64 positions only.
Stencil stencil_of(const CellTopology& cell, std::uint32_t position, std::uint64_t known);

/// Calls `visit(position, stencil, known)` for each new vertex of a cell. `positions`: the
/// new_positions of the cell, in the order in which their vertices are coded.
template <class Visit>
void for_each_new_vertex(const CellTopology& cell, std::span<const std::uint32_t> positions,
                         Visit&& visit) {
  if (positions.empty()) return;
  // A vertex may occur at several positions of the cell. All these positions become known when the
  // vertex is coded.
  const auto positions_of = [&](std::uint32_t slot) {
    std::uint64_t found = 0;
    for (std::size_t i = 0; i < cell.slots.size() && i < 64; ++i)
      if (cell.slots[i] == slot) found |= std::uint64_t{1} << i;
    return found;
  };
  std::uint64_t known = ~std::uint64_t{0};
  for (std::uint32_t position : positions) known &= ~positions_of(cell.slots[position]);
  for (std::uint32_t position : positions) {
    visit(position, stencil_of(cell, position, known), known);
    known |= positions_of(cell.slots[position]);
  }
}

}  // namespace shm
