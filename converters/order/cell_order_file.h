// Reads a text file that contains an order of cells. Each line contains the number of one cell,
// counted from 0.
#pragma once

#include <cstdint>
#include <string>

#include "order/cell_orders.h"

namespace shm::converters {

// Reads an order of cells. The file must contain each number below `cells` exactly once, and no
// other text. Otherwise throws Failure, which names the file and the line. Its code is
// ErrorCode::truncated if the file has too few numbers, and ErrorCode::corrupt otherwise.
CellSequence read_cell_order(const std::string& path, std::uint64_t cells);

}  // namespace shm::converters
