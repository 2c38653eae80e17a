// Orders of the cells of a mesh that are better for an encoder than the original order. All orders
// are exact functions of the mesh. They use integers, and coordinates only after rounding to
// integers. Ties are resolved by the lower number in the mesh. The same mesh therefore always has
// the same order, whether its cells are in memory or in a spool.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/big_array.h"
#include "mesh/cells.h"
#include "mesh/mesh_source.h"
#include "order/cell_graph.h"

namespace shm::converters {

// Numbers of cells in the mesh, in the new order.
using CellSequence = std::vector<std::uint32_t>;
// Numbers of cells as in Cells, in the new order, possibly in a spool.
using CellList = BigArray<std::uint32_t>;

// The functions below keep their tables and the order in `spool`, or in memory if it is null.

// Breadth-first order over shared faces. Neighbours are visited in the directions of a frame that
// is carried from cell to cell.
CellList breadth_first_order(const CellGraph& graph, Spool* spool = nullptr);

// Sweeps through a block of cells: first straight to the end of a row, then along the row beside
// it, then through the layer above in the same order, as long as rows and layers can be followed.
// Layers are stacked along the shortest (0), the middle (1) or the longest axis (2), measured at
// the first cell of the component.
CellList swept_order(const CellGraph& graph, std::size_t layers_along, Spool* spool = nullptr);

// The next cell is, among the neighbours of all previous cells, the cell that shares most faces
// with them. Of several such cells, the cell whose number of shared faces changed last is chosen.
CellList enclosed_first_order(const CellGraph& graph, Spool* spool = nullptr);

// Order along a Hilbert curve through the centres of cells. Needs 12 bytes per vertex and 60 bytes
// per cell. `mesh`: mesh that has the vertices in the numbering of `cells`. `sort_bytes`: memory
// for a sort if there is a spool.
CellList hilbert_order(const Cells& cells, MeshSource& mesh, Spool* spool = nullptr,
                       std::size_t sort_bytes = 0);

// Inserts each cell that is not a hexahedron directly after the first hexahedron after which all
// its vertices have occurred.
CellList with_others_in_place(const Cells& cells, CellList hexahedra, Spool* spool = nullptr,
                              std::size_t sort_bytes = 0);

}  // namespace shm::converters
