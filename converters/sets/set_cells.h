// SetCells: a mesh whose node sets and side sets are cells behind its own, for formats whose groups
// consist of elements: a point for each node, a face or edge for each side.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/spool.h"
#include "mesh/forwarding_mesh.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

class SetCells final : public ForwardingMesh {
 public:
  // `flat`: the mesh is one of two dimensions, so the sides of its triangles and quads are edges.
  SetCells(MeshSource& source, const std::vector<MeshSet>& sets, bool flat, Spool& spool);
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override;
  // Labels of the sets that could not be made cells of, because a side is not known.
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  struct Side {
    std::uint64_t cell, side, place;  // place: among the members of all sets
  };
  void leave_arrays_on_own_blocks();
  void add_nodes(const MeshSet& set);
  void find_sides(const std::vector<MeshSet>& sets, bool flat);
  void add_block(const MeshSet& set, CellShape shape, std::uint32_t nodes);

  PagedArray corners_;                      // of the added cells
  std::vector<std::uint64_t> added_cells_;  // of each added block
  std::uint64_t next_added_ = 0, next_corner_ = 0;
  std::size_t own_blocks_, at_block_;
  std::vector<std::string> left_out_;
};

// The nodes of side `side` (from 1, as Exodus counts) of a cell, in VTK's order; empty when there
// is no such side. `shape` of the result by their number and `dimension`.
struct CellSide {
  CellShape shape = CellShape::other;
  std::vector<std::uint64_t> nodes;
};
CellSide side_of_cell(CellShape shape, std::span<const std::uint64_t> corners, std::uint64_t side,
                      bool flat);
// How many nodes that side has where cells have `nodes_per_cell`; 0 where there is no such side.
std::size_t nodes_of_side(CellShape shape, std::uint32_t nodes_per_cell, std::uint64_t side,
                          bool flat);

}  // namespace shm::converters
