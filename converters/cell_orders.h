// Orders of the cells of a mesh that a coder likes better than the one it came in.
// All are exact functions of the mesh: integers, and coordinates only where they are rounded to
// integers first; ties go to the lower number. So who has the mesh can find the same order again.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "cell_graph.h"
#include "cell_table.h"
#include "mesh_source.h"

namespace shm::converters {

// Number of the n-th cell in the new order.
using CellSequence = std::vector<std::uint32_t>;

// Breadth-first over shared faces, neighbours in the directions of a frame that is carried along.
CellSequence breadth_first_order(const CellGraph& graph);

// As a block of cells is swept: straight on to the end of a row, then the row beside, then the
// layer above in the same order, wherever rows and layers can be followed. Layers follow each other
// along the shortest (0), the middle (1) or the longest axis (2), as seen where a component begins.
CellSequence swept_order(const CellGraph& graph, std::size_t layers_along);

// Next comes, of all cells beside those that have come, the one that shares most faces with them;
// the one that waits longest among equals.
CellSequence enclosed_first_order(const CellGraph& graph);

// Along a Hilbert curve through the cells' centres. 28 bytes a vertex and cell.
CellSequence hilbert_order(const CellTable& cells, MeshSource& mesh);

// Moves what is no hexahedron to behind the cell that brings the last of its vertices.
CellSequence with_others_in_place(const CellTable& cells, const CellSequence& hexahedra);

}  // namespace shm::converters
