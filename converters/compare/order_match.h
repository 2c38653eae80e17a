// Finds the order in which the cells of a source were encoded in Order::free. Tries each known
// order: sorts the cells of the source in this order, and compares them with the cells of the file.
// Compares the first cell that uses each vertex, and the positions of a sample of the cells. Needs
// the memory for computing an order (free_order.h), and 8 more bytes per cell.
#pragma once

#include <cstddef>
#include <optional>

#include "base/progress.h"
#include "mesh/cells.h"
#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "order/free_order.h"

namespace shm::converters {

// Returns a known order of the cells of `source` that matches the cells of `restored`. Skips the
// first `skipped` orders that match. Returns nothing if no further order matches. `cells` are the
// cells of `source`, with the same vertex numbers.
std::optional<CellList> matching_order(const Cells& cells, MeshSource& source, MeshSource& restored,
                                       std::size_t skipped = 0, const Progress& progress = {},
                                       const SearchRoom& room = {});

}  // namespace shm::converters
