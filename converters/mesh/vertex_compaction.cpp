#include "mesh/vertex_compaction.h"

#include <string>

#include "base/failure.h"
#include "base/spool.h"

namespace shm::converters {
namespace {

// State of a vertex in the table: 0 if no cell read so far uses the vertex, otherwise 2 * (1 +
// number of the last cell that uses it). The bit kEmitted is added when the vertex has been
// emitted. When the vertex is finalized, only this bit remains.
constexpr std::uint64_t kEmitted = 1;
constexpr std::uint64_t last_in(std::uint64_t cell) { return 2 * (cell + 1); }

void find_last_uses(MeshSource& mesh, NumberTable& table, const Progress& progress) {
  const std::uint64_t vertices = mesh.info().vertices, cells = mesh.info().cells();
  CellBatch batch;
  std::uint64_t first_cell = 0;
  for (mesh.rewind_cells(); mesh.next_cells(batch, kCellsAtOnce); first_cell += batch.size()) {
    for (std::size_t i = 0; i < batch.size(); ++i)
      for (const std::uint64_t v : batch.cell(i)) {
        require_vertex(first_cell + i, v, vertices);
        table.set(v, last_in(first_cell + i));
      }
    if (progress) progress("finding last uses", first_cell + batch.size(), cells);
  }
}

}  // namespace

void require_vertex(std::uint64_t cell, std::uint64_t vertex, std::uint64_t vertices) {
  if (vertex < vertices) return;
  throw Failure(Error{.code = ErrorCode::corrupt,
                      .detail = "uses vertex " + std::to_string(vertex) + " of " +
                                std::to_string(vertices) + " (counted from 0)",
                      .section = "cell " + std::to_string(cell)});
}

void stream_compacted(MeshSource& mesh, Spool& spool, CompactedMesh& out,
                      const Progress& progress) {
  const std::uint64_t vertices = mesh.info().vertices, cells = mesh.info().cells();
  NumberTable table(spool, vertices, last_in(cells) | kEmitted);
  find_last_uses(mesh, table, progress);

  CellBatch batch;
  std::vector<std::uint64_t> other_last_uses;
  std::uint64_t first_cell = 0;
  for (mesh.rewind_cells(); mesh.next_cells(batch, kCellsAtOnce); first_cell += batch.size()) {
    out.begin_batch(batch, first_cell);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto corners = batch.cell(i);
      std::uint64_t last_use = 0;
      other_last_uses.clear();
      for (const std::uint64_t v : corners) {
        const std::uint64_t entry = table.get(v);
        if (entry & kEmitted) continue;
        out.vertex(v, entry / 2 - 1);
        table.set(v, entry | kEmitted);
      }
      for (std::size_t c = 0; c < corners.size(); ++c) {
        if (table.get(corners[c]) != (kEmitted | last_in(first_cell + i))) continue;
        table.set(corners[c], kEmitted);
        if (c < 64)
          last_use |= std::uint64_t{1} << c;
        else
          other_last_uses.push_back(corners[c]);
      }
      out.cell(batch, i, last_use, other_last_uses);
    }
    if (progress) progress("streaming cells", first_cell + batch.size(), cells);
  }
  for (std::uint64_t v = 0; v < vertices; ++v)
    if (table.get(v) == 0) out.vertex(v, kNeverUsed);
}

}  // namespace shm::converters
