// FilePlan: the layout of the VTK legacy file for a mesh, determined before the first byte is
// written. The plan consists of the type and the point numbers of each cell, and of the skeleton,
// which lists the sections and arrays of the file in order (see vtk.h). If the mesh came from a VTK
// file, the skeleton is derived from the skeleton of that file; otherwise, it is a default
// skeleton.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/cell_plan.h"
#include "vtk/legacy/lattice.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

class FilePlan : public CellPlan {
 public:
  // Borrows `mesh`. Reads all cells of `mesh` if the sizes of the cell lists in the file cannot be
  // computed from the block sizes.
  explicit FilePlan(MeshSource& mesh);

  const Skeleton& skeleton() const { return skeleton_; }
  // A list of cells in the file: CELLS, which contains all cells, or one of the four lists of
  // polygonal data.
  struct CellList {
    EntryKind kind = EntryKind::cells;
    std::uint64_t first = 0, cells = 0;
    // Number of integers that the file stores for the cells of the list. Does not include the node
    // counts at the beginning of rows (versions up to 4.x).
    std::uint64_t numbers = 0;
  };
  const CellList& cell_list(EntryKind kind) const;
  // Calls body(numbers) for each cell of a list. `numbers` contains the cell's nodes in VTK's order
  // or, for a polyhedron, its face stream.
  template <class Body>
  void for_each_cell_of(const CellList& list, Body&& body) {
    for_each_typed_cell([&](int, const auto& numbers) { body(numbers); }, list.first, list.cells);
  }

 private:
  void plan_from_source(const Extra& text);
  void plan_for_foreign();
  void settle_dataset();
  void check_lists() const;
  bool is_lattice_of(const Lattice& lattice);
  bool has_points_of(const Lattice& lattice, const LatticePoints& points);
  bool plan_lattice();
  bool plan_polydata();
  bool place_array(const Entry& entry, Location location);
  void add_unplaced_arrays();
  void add_missing_parts();
  void set_title(const Extra& title);
  void add_missing_time();
  std::vector<Entry> time_entries(std::size_t index);
  void add_block_names();
  void add_block_ids();
  bool is_written(std::size_t array) const;
  void choose_layout();

  Skeleton skeleton_;
  Extra time_, names_;
  MadeExtras made_;               // extras with values in the form that legacy files need
  std::set<std::size_t> placed_;  // indices of the mesh arrays to which the skeleton refers

  // Pairs (array, role) that have occurred so far. An array may occur only once with each role.
  std::set<std::pair<std::size_t, EntryKind>> roles_;
  std::vector<CellList> lists_;
};

}  // namespace shm::converters::vtk
