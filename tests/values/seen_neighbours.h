// Records the neighbours that a NeighbourFinder returns for each new vertex and each cell, as
// vertex and cell numbers.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "codecs/shared/neighbourhood.h"

namespace shm {

struct Seen {
  std::uint64_t element = 0, cell = 0;
  Neighbourhood around;
  /// Numbers of the neighbours. The neighbours of a vertex are vertices, the neighbours of a cell
  /// are cells.
  std::array<std::uint64_t, 13> at{};

  bool knows(std::uint32_t bits) const { return around.knows(bits); }
};

class SeenNeighbours {
 public:
  std::vector<Seen> vertices, cells;

 protected:
  /// Adds the cell with number `number` and these vertices. `live` is the number of vertices on the
  /// active surface.
  void add(const CellTopology& cell, std::uint64_t number,
           std::span<const std::uint64_t> vertex_numbers, bool as_stored, std::uint64_t live,
           Reach reach) {
    finder_.begin_cell(cell, as_stored, live);
    for (std::uint32_t position : cell.new_positions) {
      vertex_in_[cell.slots[position]] = vertex_numbers[position];
      note(vertices, finder_.vertex(cell, position, reach), number, vertex_in_);
    }
    const Neighbourhood around = finder_.cell(cell, reach);
    cell_at_[around.self] = number;
    note(cells, around, number, cell_at_);
    finder_.end_cell(cell);
  }

 private:
  using Owners = std::map<std::uint32_t, std::uint64_t>;  // owner of each slot
  static void note(std::vector<Seen>& seen, const Neighbourhood& around, std::uint64_t cell,
                   const Owners& owner) {
    Seen it{owner.at(around.self), cell, around, {}};
    for (std::uint32_t i = 0; i < 13; ++i)
      if (around.knows(1u << i)) it.at[i] = owner.at(around.at[i]);
    seen.push_back(it);
  }

  NeighbourFinder finder_{true};
  Owners vertex_in_, cell_at_;
};

}  // namespace shm
