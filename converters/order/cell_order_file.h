// A text file with an order of cells. Each line has the number of the next cell, counted from 0.
#pragma once

#include <cstdint>
#include <string>

#include "order/cell_orders.h"

namespace shm::converters {

// Reads an order of cells. Throws Failure, which names file and line, unless the file contains each
// number below `cells` exactly once and nothing more. The code is truncated if numbers are missing
// at the end, otherwise corrupt.
CellSequence read_cell_order(const std::string& path, std::uint64_t cells);

}  // namespace shm::converters
