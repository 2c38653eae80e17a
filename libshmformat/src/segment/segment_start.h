// Where a segment begins.
#pragma once

#include <cstdint>

namespace shm {

struct SegmentStart {
  std::uint32_t segment = 0;
  std::uint64_t first_cell = 0, first_vertex = 0;  ///< cells and vertices of all segments before
};

}  // namespace shm
