#include "mesh/cell_table.h"

#include <algorithm>

#include "mesh/vertex_compaction.h"

namespace shm::converters {
namespace {}  // namespace

CellTable::CellTable(const MeshInfo& info) : vertices_(info.vertices) {
  const auto& blocks = info.schema.blocks;
  for (const BlockInfo& block : blocks) hexahedral_.push_back(holds_hexahedra(block));
  const bool uniform = !blocks.empty() && blocks.front().nodes_per_cell != 0 &&
                       std::all_of(blocks.begin(), blocks.end(), [&](const BlockInfo& block) {
                         return block.nodes_per_cell == blocks.front().nodes_per_cell;
                       });
  if (uniform)
    uniform_ = blocks.front().nodes_per_cell;
  else
    begin_.push_back(0);
}

std::optional<CellTable> CellTable::read(MeshSource& mesh, const Progress& progress) {
  const MeshInfo& info = mesh.info();
  const std::uint64_t cells = info.cells();
  if (cells >= kMostCells || info.vertices >= kMostVertices) return std::nullopt;
  CellTable table(info);
  CellBatch batch;
  std::vector<std::uint32_t> corners;
  for (mesh.rewind_cells(); mesh.next_cells(batch, kCellsAtOnce);) {
    for (std::size_t i = 0; i < batch.size(); ++i) {
      corners.clear();
      for (const std::uint64_t v : batch.cell(i)) {
        require_vertex(table.size(), v, info.vertices);
        corners.push_back(static_cast<std::uint32_t>(v));
      }
      table.append(batch.blocks[i], corners);
    }
    // Reserve memory only after the first batch has been read, because a damaged file may state
    // implausible block sizes.
    if (table.size() == batch.size() && table.begin_.empty())
      table.corners_.reserve(cells * table.uniform_);
    if (progress) progress("reading cells", table.size(), cells);
  }
  return table;
}

void CellTable::append(std::uint32_t block, std::span<const std::uint32_t> corners) {
  corners_.insert(corners_.end(), corners.begin(), corners.end());
  if (!begin_.empty()) begin_.push_back(corners_.size());
  if (hexahedral_.size() > 1) blocks_.push_back(block);
  ++size_;
}

}  // namespace shm::converters
