// Which order a file in Order::free has its cells in, found by making every known order of its
// source again, and comparing when each cell's vertices come for the first time, and where some of
// the cells lie.
// Memory: as for making orders (free_order.h), and 8 bytes a cell.
#pragma once

#include <cstddef>
#include <optional>

#include "base/progress.h"
#include "mesh/cells.h"
#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "order/free_order.h"

namespace shm::converters {

// A guess: cells of `source` in the order of `restored`; after the first `skipped` known orders
// that fit. Nothing where no further one does. `cells`: those of `source`, which has the vertices
// that they know.
std::optional<CellList> matching_order(const Cells& cells, MeshSource& source, MeshSource& restored,
                                       std::size_t skipped = 0, const Progress& progress = {},
                                       const SearchRoom& room = {});

}  // namespace shm::converters
