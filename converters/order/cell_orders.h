// Orders of the cells of a mesh that a coder likes better than the one it came in.
// All are exact functions of the mesh: integers, and coordinates only where they are rounded to
// integers first; ties go to the lower number that the mesh has. So who has the mesh can find the
// same order again, with its cells in memory or in a spool.
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

// Number of the n-th cell in the new order.
using CellSequence = std::vector<std::uint32_t>;
// The same, as Cells count them, maybe in a spool.
using CellList = BigArray<std::uint32_t>;

// What follows keeps its tables and the order in `spool`; null: in memory.

// Breadth-first over shared faces, neighbours in the directions of a frame that is carried along.
CellList breadth_first_order(const CellGraph& graph, Spool* spool = nullptr);

// As a block of cells is swept: straight on to the end of a row, then the row beside, then the
// layer above in the same order, wherever rows and layers can be followed. Layers follow each other
// along the shortest (0), the middle (1) or the longest axis (2), as seen where a component begins.
CellList swept_order(const CellGraph& graph, std::size_t layers_along, Spool* spool = nullptr);

// Next comes, of all cells beside those that have come, the one that shares most faces with them;
// the one that waits longest among equals.
CellList enclosed_first_order(const CellGraph& graph, Spool* spool = nullptr);

// Along a Hilbert curve through the cells' centres. 12 bytes a vertex, 60 a cell. `mesh`: with the
// vertices that the cells know. `sort_bytes`: memory for a sort, with a spool.
CellList hilbert_order(const Cells& cells, MeshSource& mesh, Spool* spool = nullptr,
                       std::size_t sort_bytes = 0);

// Moves what is no hexahedron to behind the cell that brings the last of its vertices.
CellList with_others_in_place(const Cells& cells, CellList hexahedra, Spool* spool = nullptr,
                              std::size_t sort_bytes = 0);

}  // namespace shm::converters
