// FilePlan: what a VTK legacy file of a mesh will look like, settled before its first byte: its
// skeleton (the source's own, or a plain one for a mesh of another format), its cell types, and
// what stands in it for each cell.
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <string>

#include "mesh_source.h"
#include "vtk_cell_plan.h"
#include "vtk_words.h"

namespace shm::converters::vtk {

class FilePlan : public CellPlan {
 public:
  // `mesh` is borrowed. Walks its cells when their size is not known otherwise.
  explicit FilePlan(MeshSource& mesh);

  const Skeleton& skeleton() const { return skeleton_; }
  // Numbers that the file has for all cells together, without the counts of classic rows.
  std::uint64_t cell_numbers() const { return cell_numbers_; }

 private:
  void plan_from_source(const Extra& text);
  void plan_for_foreign();
  bool place_array(const Entry& entry, Location location);
  void add_unplaced_arrays();
  void add_missing_parts();
  void add_time();
  void add_block_ids();
  bool is_written(std::size_t array) const;
  Entry array_entry(std::size_t array) const;
  void choose_layout();

  Skeleton skeleton_;
  Extra time_;
  std::deque<Extra> made_;  // for values that stand otherwise in the source
  std::set<std::size_t> placed_;  // arrays that the skeleton has a place for
  std::uint64_t cell_numbers_ = 0;
};

}  // namespace shm::converters::vtk
