// CellGrouping: groups the cells of a mesh by element block, as Exodus requires. In the mesh, cells
// of different blocks may alternate. One pass over the cells determines the groups. Later passes
// distribute cells and values to the groups in pieces.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <vector>

#include "base/spool.h"
#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

inline constexpr std::uint64_t kPieceElements = std::uint64_t{1} << 15;

struct CellGroup {
  std::uint32_t block;           // index of the mesh's block
  std::uint32_t nodes_per_cell;  // 0: varies
  std::uint64_t cells = 0, nodes = 0;
  // Number of the group's first cell, if all cells are numbered group by group, from 0.
  std::uint64_t first_cell = 0;
};

class CellGrouping {
 public:
  // Each block becomes one group, with one exception: if the cells of a block have different node
  // counts, there is one group per node count, unless `keep_whole` is true or the cells are
  // polygons. Groups that contain a whole block come first, in the order of the blocks.
  CellGrouping(MeshSource& mesh, Spool& spool, bool keep_whole);

  const std::vector<CellGroup>& groups() const { return groups_; }
  // Converts the number of a cell in the mesh to its number when all cells are numbered group by
  // group.
  std::uint64_t position(std::uint64_t cell);

  // Reads the cells of the mesh and distributes them to the groups. Calls put(group, first, cells,
  // nodes, sizes) for pieces of consecutive cells of a group. `first` is the index of the first
  // cell in the group, and `cells` the number of cells. `nodes` contains the node numbers of these
  // cells, which start at 0. `sizes` contains the number of nodes of each cell.
  template <class Put>
  void deal_cells(MeshSource& mesh, Put&& put);
  // Reads the values of a cell array and distributes them to the groups. Calls put(group, first,
  // count, values) for pieces of consecutive cells of a group. `first` is the index of the first
  // cell in the group, and `count` the number of cells.
  template <class Put>
  void deal_values(MeshSource& mesh, std::size_t array, std::uint64_t step, Put&& put);

 private:
  // Consecutive cells that belong to the same group.
  struct Run {
    std::uint64_t first_cell;  // number of the run's first cell in the mesh
    std::uint64_t in_group;
    std::uint64_t group;
  };
  std::uint32_t group_of(std::uint32_t block, std::size_t nodes) const {
    const std::uint32_t whole = whole_blocks_[block];
    return whole != kSplit ? whole : split_.at({block, nodes});
  }
  std::uint64_t end_of(std::uint64_t run) {
    return run + 1 < runs_.size() ? runs_.get<Run>(run + 1).first_cell : cells_;
  }

  static constexpr std::uint32_t kSplit = ~std::uint32_t{0};
  std::vector<CellGroup> groups_;
  // Index of the group of each block; kSplit if the block has several groups.
  std::vector<std::uint32_t> whole_blocks_;
  std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> split_;
  PagedArray runs_;
  std::uint64_t cells_ = 0;
};

template <class Put>
void CellGrouping::deal_cells(MeshSource& mesh, Put&& put) {
  struct Hand {
    std::vector<std::uint64_t> nodes;
    std::vector<std::uint32_t> sizes;
    std::uint64_t done = 0;
  };
  std::vector<Hand> hands(groups_.size());
  std::vector<std::uint32_t> touched;
  CellBatch batch;
  mesh.rewind_cells();
  while (mesh.next_cells(batch, kPieceElements)) {
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto corners = batch.cell(i);
      const std::uint32_t group = group_of(batch.blocks[i], corners.size());
      Hand& hand = hands[group];
      if (hand.sizes.empty()) touched.push_back(group);
      hand.nodes.insert(hand.nodes.end(), corners.begin(), corners.end());
      hand.sizes.push_back(static_cast<std::uint32_t>(corners.size()));
    }
    for (const std::uint32_t group : touched) {
      Hand& hand = hands[group];
      put(group, hand.done, hand.sizes.size(), hand.nodes, hand.sizes);
      hand.done += hand.sizes.size();
      hand.nodes.clear();
      hand.sizes.clear();
      // The buffer of each group may grow to the size of a full batch. If there are many groups,
      // free the buffers after each batch, because thousands of such buffers would need too much
      // memory.
      if (groups_.size() > 16) hand.nodes.shrink_to_fit();
    }
    touched.clear();
  }
}

template <class Put>
void CellGrouping::deal_values(MeshSource& mesh, std::size_t array, std::uint64_t step, Put&& put) {
  struct Hand {
    std::uint64_t first = 0;
    std::vector<std::byte> values;
  };
  const std::size_t stride = mesh.info().array_stride(array);
  if (stride == 0) return;
  std::vector<bool> covers;
  for (const CellGroup& group : groups_)
    covers.push_back(mesh.info().schema.array_covers(array, group.block));
  const std::uint64_t elements = mesh.info().array_elements(array);
  std::vector<std::byte> values(std::min(kPieceElements, elements) * stride);
  std::map<std::uint64_t, Hand> hands;
  // `read` is the number of elements read so far. `values` contains the most recent batch of `held`
  // elements. The first `used` elements of this batch have been distributed.
  std::uint64_t read = 0, held = 0, used = 0;
  for (std::uint64_t r = 0; r < runs_.size(); ++r) {
    const Run run = runs_.get<Run>(r);
    if (!covers[run.group]) continue;
    const std::uint64_t count = end_of(r) - run.first_cell;
    for (std::uint64_t done = 0; done < count;) {
      if (used == held) {
        for (const auto& [group, hand] : hands)
          put(static_cast<std::uint32_t>(group), hand.first, hand.values.size() / stride,
              hand.values.data());
        hands.clear();
        held = std::min(kPieceElements, elements - read);
        if (held == 0) return;
        mesh.read_array(array, step, read, held, values.data());
        read += held;
        used = 0;
      }
      const std::uint64_t take = std::min(count - done, held - used);
      auto [place, fresh] = hands.try_emplace(run.group);
      if (fresh) place->second.first = run.in_group + done;
      const std::byte* begin = values.data() + used * stride;
      place->second.values.insert(place->second.values.end(), begin, begin + take * stride);
      used += take;
      done += take;
    }
  }
  for (const auto& [group, hand] : hands)
    put(static_cast<std::uint32_t>(group), hand.first, hand.values.size() / stride,
        hand.values.data());
}

}  // namespace shm::converters::exodus
