// SetCells: a mesh whose node sets and side sets become additional cells: a point for each node,
// and a face or edge for each side. It is used for formats whose groups consist of elements.
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
  // `flat`: true if the mesh is two-dimensional, so that the sides of its triangles and quads are
  // edges.
  SetCells(MeshSource& source, const std::vector<MeshSet>& sets, bool flat, Spool& spool);
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override;
  // Returns the labels of the sets that could not be converted to cells because a side is unknown.
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  struct Side {
    std::uint64_t cell, side, place;  // place: position among the members of all sets
  };
  void leave_arrays_on_own_blocks();
  void add_nodes(const MeshSet& set);
  void find_sides(const std::vector<MeshSet>& sets, bool flat);
  void add_block(const MeshSet& set, CellShape shape, std::uint32_t nodes);

  PagedArray corners_;                      // corners of the added cells
  std::vector<std::uint64_t> added_cells_;  // number of cells in each added block
  std::uint64_t next_added_ = 0, next_corner_ = 0;
  std::size_t own_blocks_, at_block_;
  std::vector<std::string> left_out_;
};

// Shape and nodes of side `side` of a cell, in VTK's order. Sides are numbered from 1, as in
// Exodus. The list of nodes is empty if the cell has no such side.
struct CellSide {
  CellShape shape = CellShape::other;
  std::vector<std::uint64_t> nodes;
};
CellSide side_of_cell(CellShape shape, std::span<const std::uint64_t> corners, std::uint64_t side,
                      bool flat);
// Returns the number of nodes of a side of cells with `nodes_per_cell` nodes, or 0 if there is no
// such side.
std::size_t nodes_of_side(CellShape shape, std::uint32_t nodes_per_cell, std::uint64_t side,
                          bool flat);

}  // namespace shm::converters
