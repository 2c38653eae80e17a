#include "exodus/grouping.h"

#include <utility>

namespace shm::converters::exodus {

CellGrouping::CellGrouping(MeshSource& mesh, Spool& spool, bool keep_whole)
    : runs_(spool, sizeof(Run)) {
  const auto& blocks = mesh.info().schema.blocks;
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    const bool whole =
        keep_whole || blocks[b].nodes_per_cell != 0 || blocks[b].shape == CellShape::polygon;
    whole_blocks_.push_back(whole ? static_cast<std::uint32_t>(groups_.size()) : kSplit);
    if (whole) groups_.push_back({b, blocks[b].nodes_per_cell});
  }
  CellBatch batch;
  std::uint64_t last = kSplit;
  mesh.rewind_cells();
  while (mesh.next_cells(batch, kPieceElements)) {
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const std::size_t nodes = batch.corner_begin[i + 1] - batch.corner_begin[i];
      const std::uint32_t block = batch.blocks[i];
      if (whole_blocks_[block] == kSplit &&
          split_.try_emplace({block, nodes}, static_cast<std::uint32_t>(groups_.size())).second)
        groups_.push_back({block, static_cast<std::uint32_t>(nodes)});
      const std::uint32_t index = group_of(block, nodes);
      CellGroup& group = groups_[index];
      if (index != last) {
        const Run run{cells_, group.cells, index};
        runs_.append(1, reinterpret_cast<const std::byte*>(&run));
        last = index;
      }
      ++group.cells;
      group.nodes += nodes;
      ++cells_;
    }
  }
  std::uint64_t first = 0;
  for (CellGroup& group : groups_) {
    group.first_cell = first;
    first += group.cells;
  }
}

std::uint64_t CellGrouping::position(std::uint64_t cell) {
  // Binary search: the run that contains the cell is in runs_[low, high).
  std::uint64_t low = 0, high = runs_.size();
  while (high - low > 1) {
    const std::uint64_t middle = low + (high - low) / 2;
    (runs_.get<Run>(middle).first_cell <= cell ? low : high) = middle;
  }
  const Run run = runs_.get<Run>(low);
  return groups_[run.group].first_cell + run.in_group + (cell - run.first_cell);
}

}  // namespace shm::converters::exodus
