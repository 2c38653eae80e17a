// A file with an order of cells: text, in each line the number of the cell that comes next, from 0.
#pragma once

#include <cstdint>
#include <string>

#include "order/cell_orders.h"

namespace shm::converters {

// Throws Failure, naming file and line, unless the file holds each number below `cells` exactly
// once and nothing else: corrupt, or truncated where numbers are missing at its end.
CellSequence read_cell_order(const std::string& path, std::uint64_t cells);

}  // namespace shm::converters
