// Vertex compaction: turns an indexed mesh into a streaming one without changing the cell order.
// Two passes over the cells: the first finds for each vertex the last cell that uses it, the
// second hands out each vertex just before the first cell that needs it and marks with each cell
// which vertices are used for the last time. (Isenburg & Lindstrom 2005.)
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

inline constexpr std::uint64_t kNeverUsed = ~std::uint64_t{0};

// Throws corrupt, naming the cell, unless vertex < vertices.
void require_vertex(std::uint64_t cell, std::uint64_t vertex, std::uint64_t vertices);

// Hears the streaming mesh.
class CompactedMesh {
 public:
  virtual ~CompactedMesh() = default;
  // The cells of `batch` come next; the first of them is cell `first_cell` of the mesh.
  virtual void begin_batch(const CellBatch& batch, std::uint64_t first_cell) = 0;
  // Comes before the first cell that uses it, in corner order of that cell; vertices that no
  // cell uses come after all cells, in ascending number, with last_cell == kNeverUsed.
  virtual void vertex(std::uint64_t number, std::uint64_t last_cell) = 0;
  // Cell `index` of the batch. Bit i of `last_use` (i < 64): corner i is used here for the last
  // time; for a vertex that stands at several corners only its first corner is marked.
  // `finalized` counts the vertices used for the last time, also those beyond corner 63.
  virtual void cell(const CellBatch& batch, std::size_t index, std::uint64_t last_use,
                    std::uint64_t finalized) = 0;
};

// Memory: 4 bytes a vertex (8 from 2^31 cells on), in the spool when there are many.
void stream_compacted(MeshSource& mesh, Spool& spool, CompactedMesh& out,
                      const Progress& progress = {});

}  // namespace shm::converters
