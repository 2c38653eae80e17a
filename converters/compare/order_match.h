// Finds the order of the cells in a file in Order::free. Computes every known order of the source
// again, and compares the reordered cells with the file: at which cell each vertex is used for the
// first time, and where some of the cells are. Needs the memory for computing orders
// (free_order.h), and 8 bytes per cell.
#pragma once

#include <cstddef>
#include <optional>

#include "base/progress.h"
#include "mesh/cells.h"
#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "order/free_order.h"

namespace shm::converters {

// Returns a guess: the cells of `source` in the order of `restored`. Skips the first `skipped`
// known orders that fit. Returns nothing if no other order fits. `cells` are the cells of `source`,
// with the same vertex numbers.
std::optional<CellList> matching_order(const Cells& cells, MeshSource& source, MeshSource& restored,
                                       std::size_t skipped = 0, const Progress& progress = {},
                                       const SearchRoom& room = {});

}  // namespace shm::converters
