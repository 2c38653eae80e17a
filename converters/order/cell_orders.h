// Functions that order the cells of a mesh so that the mesh compresses better. The result is the
// same on every machine, and does not depend on whether the cells are in memory or on disk (in a
// spool). This is because all computations use integers (coordinates are rounded to integers
// first), and ties are resolved by the lower cell number.
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

// Cell numbers of the mesh, in a new order.
using CellSequence = std::vector<std::uint32_t>;
// Cell numbers of a Cells object, in a new order. The list may be on disk, in a spool.
using CellList = BigArray<std::uint32_t>;

// The functions below store their tables and the result in `spool` (temporary storage, on disk if
// large). If `spool` is null, everything is in memory.

// Returns the order of a breadth-first search across shared faces. Each cell has a frame
// (directions ahead, beside and above), which it inherits from the cell from which it was reached.
// The neighbours of a cell are visited in the order of these directions.
CellList breadth_first_order(const CellGraph& graph, Spool* spool = nullptr);

// Returns the order of a sweep through the cells: cell after cell along a row, row after row
// through a layer, and layer after layer, as long as rows and layers can be followed.
// `layers_along` selects the axis along which layers are stacked: 0 is the shortest axis, 1 the
// middle axis, and 2 the longest axis. The axes are measured at the first cell of each connected
// component.
CellList swept_order(const CellGraph& graph, std::size_t layers_along, Spool* spool = nullptr);

// Returns a greedy order: the next cell is the cell that shares the most faces with the cells
// before it. If several cells share equally many faces, the next cell is the one whose number of
// shared faces increased most recently.
CellList enclosed_first_order(const CellGraph& graph, Spool* spool = nullptr);

// Returns the order of the cells along a Hilbert curve through their centres. Needs 12 bytes per
// vertex and 60 bytes per cell. The vertices of `mesh` must have the same numbers as in `cells`.
// `sort_bytes` is the memory limit for sorting; it is ignored if `spool` is null.
CellList hilbert_order(const Cells& cells, MeshSource& mesh, Spool* spool = nullptr,
                       std::size_t sort_bytes = 0);

// Returns the list `hexahedra` with all other cells of the mesh inserted. Each of these cells is
// inserted as soon as preceding hexahedra have used all its vertices. Cells with a vertex that no
// hexahedron uses come last.
CellList with_others_in_place(const Cells& cells, CellList hexahedra, Spool* spool = nullptr,
                              std::size_t sort_bytes = 0);

}  // namespace shm::converters
