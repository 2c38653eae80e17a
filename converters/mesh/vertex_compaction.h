// Vertex compaction: turns an indexed mesh into a streaming mesh without changing the cell order.
// Makes two passes over the cells. The first pass finds, for each vertex, the last cell that uses
// it. The second pass emits each vertex just before the first cell that needs it, and marks in each
// cell the vertices that are used for the last time. (Isenburg & Lindstrom 2005.)
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

inline constexpr std::uint64_t kNeverUsed = ~std::uint64_t{0};

// Throws Failure (corrupt) unless vertex < vertices. The error message contains the number of the
// cell.
void require_vertex(std::uint64_t cell, std::uint64_t vertex, std::uint64_t vertices);

// Receives the vertices and cells of the streaming mesh.
class CompactedMesh {
 public:
  virtual ~CompactedMesh() = default;
  // Announces the cells of `batch`. Its first cell is cell `first_cell` of the mesh.
  virtual void begin_batch(const CellBatch& batch, std::uint64_t first_cell) = 0;
  // Called for each vertex before the first cell that uses it, in the order of that cell's corners.
  // Vertices that no cell uses follow after all cells, in ascending order, with last_cell ==
  // kNeverUsed.
  virtual void vertex(std::uint64_t number, std::uint64_t last_cell) = 0;
  // Called for cell `index` of the batch. Bit i of `last_use` (i < 64) is set if this cell is the
  // last one that uses the vertex at corner i. If the vertex occurs at several corners of the cell,
  // only the bit of the first of these corners is set. `other_last_uses` contains the numbers of
  // the other vertices whose last use is in this cell; it has them only at corners from 64 on.
  virtual void cell(const CellBatch& batch, std::size_t index, std::uint64_t last_use,
                    std::span<const std::uint64_t> other_last_uses) = 0;
};

// Runs vertex compaction and passes the result to `out`. Needs 4 bytes per vertex, or 8 bytes if
// the mesh has 2^31 cells or more. These bytes are in the spool if there are many vertices.
void stream_compacted(MeshSource& mesh, Spool& spool, CompactedMesh& out,
                      const Progress& progress = {});

}  // namespace shm::converters
