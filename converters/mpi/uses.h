// PartUses: the vertices that a rank's cells use. For each vertex, it stores whether cells of
// earlier ranks use it, and the last cell of the whole mesh that uses it.
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
  // Returns the index of a vertex. Adds the vertex if it is new. Throws Failure (over_limit) for
  // more than 2^32 - 1 vertices.
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
  std::vector<std::uint32_t> slots_;  // hash table of indices; its size is a power of two
};

struct PartUses {
  VertexTable vertices;
  // `last` and `imported` have one entry for each vertex in `vertices`, at the same index.
  std::vector<std::uint64_t> last;  // last cell of the whole mesh that uses the vertex
  std::vector<bool> imported;       // true if a cell before this rank's range uses the vertex
  std::uint64_t own = 0;            // number of vertices that are not imported

  // Numbers of the vertices that no cell of the mesh uses, ascending. Empty on all ranks except
  // rank `last_rank`, an argument of find_uses().
  std::vector<std::uint64_t> unused;
  // For each block, the number of its cells in the range that was passed to find_uses().
  std::vector<std::uint64_t> block_cells;
};

// Reads the cells in `range` in batches. Calls visit(batch, number of its first cell) for each
// batch.
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

// Finds the vertices that the cells in `range` use, and determines which of these vertices are also
// used by cells of other ranks. Collective: the ranges of the ranks must be consecutive. Throws
// SharedFailure.
PartUses find_uses(Ranks& ranks, MeshSource& mesh, const CellRange& range, std::size_t last_rank);

}  // namespace shm::converters
