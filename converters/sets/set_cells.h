// SetCells: a mesh whose node sets and side sets are converted to additional cells, for formats in
// which only elements can form groups. Each node of a set becomes a point cell, and each side
// becomes a face or edge cell.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/spool.h"
#include "mesh/forwarding_mesh.h"
#include "sets/cell_sides.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

class SetCells final : public ForwardingMesh {
 public:
  // `flat` is true if the mesh is two-dimensional. The sides of its triangles and quads are then
  // edges.
  SetCells(MeshSource& source, const std::vector<MeshSet>& sets, bool flat, Spool& spool);
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override;
  // Returns the labels of the sets that could not be converted to cells, because they contain a
  // side that does not exist.
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  void leave_arrays_on_own_blocks();
  void add_nodes(const MeshSet& set);
  void find_sides(const std::vector<MeshSet>& sets, bool flat);
  void add_block(const MeshSet& set, const CellKind& kind);

  PagedArray corners_;                      // corners of the added cells
  std::vector<std::uint64_t> added_cells_;  // number of cells in each added block
  std::uint64_t next_added_ = 0, next_corner_ = 0;
  std::size_t own_blocks_, at_block_;
  std::vector<std::string> left_out_;
};

}  // namespace shm::converters
