// PartUses: the vertices of some cells of a mesh, and their first and last uses in the whole mesh,
// including cells of other ranks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "exodus/parts/owners.h"
#include "exodus/parts/part_files.h"
#include "exodus/parts/ranks.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Assigns indices 0, 1, 2, ... to vertex numbers in the order in which they are added. Needs 16 to
// 24 bytes per vertex.
class VertexTable {
 public:
  static constexpr std::uint32_t kAbsent = ~std::uint32_t{0};

  std::uint32_t find(std::uint64_t number) const {
    if (slots_.empty()) return kAbsent;
    return slots_[slot_of(number)];
  }
  // Returns the index of a vertex, which is added if it is new. Throws Failure (over_limit) for
  // more than 2^32 - 2 vertices.
  std::uint32_t find_or_add(std::uint64_t number);
  const std::vector<std::uint64_t>& numbers() const { return numbers_; }

 private:
  std::size_t slot_of(std::uint64_t number) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = static_cast<std::size_t>((number * 0x9e3779b97f4a7c15u) >> 20) & mask;
    while (slots_[slot] != kAbsent && numbers_[slots_[slot]] != number) slot = (slot + 1) & mask;
    return slot;
  }
  void grow();

  std::vector<std::uint64_t> numbers_;
  std::vector<std::uint32_t> slots_;  // hash table; its size is a power of two
};

struct PartUses {
  VertexTable vertices;
  // Properties of vertices, by index in the table:
  std::vector<std::uint64_t> last;  // the last cell of the mesh that uses the vertex
  std::vector<bool> imported;       // true if a cell before the range uses the vertex
  std::uint64_t own = 0;            // number of vertices that are not imported

  // Only on rank `last_rank`: the vertices that no cell of the mesh uses, ascending.
  std::vector<std::uint64_t> unused;
  // Number of cells of each block in the range.
  std::vector<std::uint64_t> block_cells;
};

// Calls visit(batch, first cell number) for all batches of cells in the range.
template <class Visit>
void for_cells(MeshSource& mesh, const CellRange& range, Visit&& visit) {
  constexpr std::uint64_t kBatchCells = 8192;
  CellBatch batch;
  mesh.seek_cells(range.first);
  for (std::uint64_t cell = range.first; cell < range.end; cell += batch.size()) {
    if (!mesh.next_cells(batch, std::min(kBatchCells, range.end - cell)))
      throw Failure(ErrorCode::corrupt, "has fewer cells than its header counts");
    visit(batch, cell);
  }
}

// Finds the uses of the vertices of the cells in `range`. Collective: ranks must have consecutive
// ranges. Throws SharedFailure.
PartUses find_uses(Ranks& ranks, MeshSource& mesh, const CellRange& range, std::size_t last_rank);

}  // namespace shm::converters
