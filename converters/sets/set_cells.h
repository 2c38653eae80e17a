// SetCells: a mesh whose node sets and side sets become additional cells. A node becomes a point,
// and a side becomes a face or an edge. It is used for formats in which only elements can form
// groups.
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
  // Returns the labels of the sets that could not be converted to cells, because they contain a
  // side number that the cell does not have.
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  struct Side {
    // `place` is the position of the side among the members of all sets.
    std::uint64_t cell, side, place;
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

// Shape of a side of a cell, and the nodes of the side in VTK's order. Sides are numbered from 1,
// as in Exodus. The list of nodes is empty if the cell does not have the requested side.
struct CellSide {
  CellShape shape = CellShape::other;
  std::vector<std::uint64_t> nodes;
};
CellSide side_of_cell(CellShape shape, std::span<const std::uint64_t> corners, std::uint64_t side,
                      bool flat);
// Returns the number of nodes of side number `side` of cells with `nodes_per_cell` nodes. Returns 0
// if no such side exists.
std::size_t nodes_of_side(CellShape shape, std::uint32_t nodes_per_cell, std::uint64_t side,
                          bool flat);

}  // namespace shm::converters
