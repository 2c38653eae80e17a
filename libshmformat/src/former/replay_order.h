// ReplayOrder: in which order replay hexahedra introduced their vertices, without any symbols. Who
// compares a file in which some stand with its source goes through its coding order again.
// spec: "Replay hexahedra"
#pragma once

#include <cstdint>

#include "entropy/range_coder.h"
#include "surface/active_surface.h"
#include "surface/cell_topology.h"

namespace shm {

class ReplayOrder {
 public:
  /// `surface` is borrowed.
  explicit ReplayOrder(ActiveSurface& surface) : surface_(&surface) {}

  /// New vertices get slots, as the corners stand; nothing is coded.
  bool code(RangeEncoder&, RangeEncoder&, CellTopology& cell, bool) {
    for (std::uint32_t c = 0; c < 8; ++c) {
      std::uint32_t first = 0;  // corner that has its vertex
      while (cell.numbers[first] != cell.numbers[c]) ++first;
      if (first < c) {
        cell.slots[c] = cell.slots[first];
        cell.last_use[first] |= cell.last_use[c];
        cell.last_use[c] = 0;
      } else if (cell.slots[c] == kNone) {
        cell.slots[c] = surface_->add_vertex();
        cell.new_positions.push_back(c);
      }
    }
    return true;
  }
  // As coders do that find vertices by number: last uses go with the corners.
  void set_number(std::uint32_t, std::uint64_t) {}
  void forget(std::uint32_t) {}

 private:
  ActiveSurface* surface_;
};

}  // namespace shm
