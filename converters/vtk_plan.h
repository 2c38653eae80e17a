// FilePlan: what a VTK legacy file of a mesh will look like, settled before its first byte: its
// skeleton (the source's own, or a plain one for a mesh of another format), its cell types, and
// what stands in it for each cell.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "mesh_source.h"
#include "vtk_words.h"

namespace shm::converters::vtk {

inline constexpr std::size_t kBatchCells = 16384;

// Throws Failure (corrupt) for extras that contradict themselves or the mesh.
[[noreturn]] void fail_extra(const std::string& key, std::string detail);

class FilePlan {
 public:
  // `mesh` is borrowed. Walks its cells when their size is not known otherwise.
  explicit FilePlan(MeshSource& mesh);
  FilePlan(const FilePlan&) = delete;  // extras_ points into it
  FilePlan& operator=(const FilePlan&) = delete;

  const Skeleton& skeleton() const { return skeleton_; }
  int block_type(std::uint32_t block) const { return block_types_[block]; }
  // Numbers that the file has for all cells together, without the counts of classic rows.
  std::uint64_t cell_numbers() const { return cell_numbers_; }
  const Extra* extra(const std::string& key) const;  // null when absent

  // Calls body(batch) for all cells in file order.
  template <class Body>
  void for_each_batch(Body&& body) {
    mesh_.rewind_cells();
    CellBatch batch;
    while (mesh_.next_cells(batch, kBatchCells)) body(batch);
  }
  // Calls body(numbers) for each cell: its nodes in VTK's order, or the face stream of a
  // polyhedron.
  template <class Body>
  void for_each_cell(Body&& body) {
    cell_ = 0;
    next_polyhedron_ = 0;
    for_each_batch([&](const CellBatch& batch) {
      for (std::size_t i = 0; i < batch.size(); ++i, ++cell_) {
        file_numbers(batch.blocks[i], batch.cell(i));
        body(numbers_);
      }
    });
  }

 private:
  struct Polyhedron {
    std::int64_t cell;
    std::uint64_t faces, first_size;
  };

  void plan_from_source(const Extra& text);
  void plan_for_foreign();
  bool place_array(const Entry& entry, Location location);
  void add_unplaced_arrays();
  void add_missing_parts();
  void set_title(const Extra& title);
  void add_time();
  void add_block_names();
  void add_block_ids();
  bool is_written(std::size_t array) const;
  Entry array_entry(std::size_t array) const;
  void load_cell_types();
  void load_polyhedra();
  void choose_layout();
  std::vector<std::int64_t> integers(const std::string& key) const;
  void file_numbers(std::uint32_t block, std::span<const std::uint64_t> corners);

  MeshSource& mesh_;
  const MeshInfo& info_;
  Skeleton skeleton_;
  Extra time_, names_;
  std::map<std::string, const Extra*> extras_;
  std::set<std::size_t> placed_;  // arrays that the skeleton has a place for
  std::vector<int> block_types_;
  std::uint64_t cell_numbers_ = 0;
  std::vector<Polyhedron> polyhedra_;  // by cell
  std::vector<std::int64_t> face_sizes_;
  std::size_t next_polyhedron_ = 0;     // of the walk under way
  std::uint64_t cell_ = 0;              // of the walk under way
  std::vector<std::uint64_t> numbers_;  // of the current cell
};

}  // namespace shm::converters::vtk
