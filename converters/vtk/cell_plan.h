// CellPlan: converts the cells of a mesh to the cells of a legacy or XML VTK file. Each cell is
// converted to its VTK cell type and its nodes in VTK's order, or, for a polyhedron, to a list of
// faces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters::vtk {

inline constexpr std::size_t kBatchCells = 16384;

// Throws Failure (corrupt). The message names the extra `key`, which is invalid or does not match
// the mesh; `detail` describes the problem.
[[noreturn]] void fail_extra(const std::string& key, std::string detail);

class CellPlan {
 public:
  // `mesh` is borrowed.
  explicit CellPlan(MeshSource& mesh);
  CellPlan(const CellPlan&) = delete;  // not copyable, because extras_ points into the mesh
  CellPlan& operator=(const CellPlan&) = delete;

  int block_type(std::uint32_t block) const { return block_types_[block]; }
  bool has_polyhedra() const { return has_polyhedra_; }
  const Extra* extra(const std::string& key) const;  // returns null if no such extra exists

  // Returns the values of an extra of type int32 or int64. Returns an empty list if no
  // such extra exists.
  std::vector<std::int64_t> integers(const std::string& key) const;

  // Calls body(batch) for all cells in file order, one batch at a time.
  template <class Body>
  void for_each_batch(Body&& body) {
    mesh_.rewind_cells();
    CellBatch batch;
    while (mesh_.next_cells(batch, kBatchCells)) body(batch);
  }
  // Calls body(numbers) for each cell. `numbers` contains the cell's nodes in VTK's order or, for a
  // polyhedron, its face stream: the number of faces, then the size and the nodes of each face.
  template <class Body>
  void for_each_cell(Body&& body) {
    for_each_typed_cell([&](int, const auto& numbers) { body(numbers); });
  }
  // Calls body(type, numbers) for `count` cells, starting with cell `first`. `numbers` is the same
  // as in for_each_cell().
  template <class Body>
  void for_each_typed_cell(Body&& body, std::uint64_t first = 0,
                           std::uint64_t count = ~std::uint64_t{0}) {
    cell_ = 0;
    next_polyhedron_ = 0;
    for_each_batch([&](const CellBatch& batch) {
      for (std::size_t i = 0; i < batch.size(); ++i, ++cell_) {
        if (cell_ - first >= count) continue;
        file_numbers(batch.blocks[i], batch.cell(i));
        body(block_types_[batch.blocks[i]], numbers_);
      }
    });
  }
  // Reads a cell array that covers only some blocks. Calls body(values) for batches of cells in
  // file order. Cells of blocks that the array does not cover have the value NaN (floats) or 0
  // (integers).
  using Values = std::function<void(std::span<const std::byte>)>;
  void for_each_filled(std::size_t array, std::uint64_t step, const Values& body);

 protected:
  // Returns true if the mesh is from another format and has Lagrange hexahedra, so that a new file
  // needs a version with the new numbering.
  bool makes_lagrange_cells() const;
  // Sets whether the file has the old numbering of Lagrange and Bezier hexahedra (permute_nodes()).
  void set_old_numbering(bool old) { old_numbering_ = old; }

  MeshSource& mesh_;
  const MeshInfo& info_;
  std::map<std::string, const Extra*> extras_;

 private:
  struct Polyhedron {
    std::int64_t cell;
    std::uint64_t faces, first_size;
  };

  void load_cell_types();
  void load_polyhedra();
  void unpack_faces(std::span<const std::uint64_t> corners);
  void file_numbers(std::uint32_t block, std::span<const std::uint64_t> corners);

  std::vector<int> block_types_;
  bool has_polyhedra_ = false, old_numbering_ = false;
  // Cells with the shape polyhedron, in ascending order of their numbers.
  std::vector<Polyhedron> polyhedra_;
  std::vector<std::int64_t> face_sizes_;
  // Index in polyhedra_ of the next polyhedron, while for_each_cell() and similar functions go
  // through all cells in order.
  std::size_t next_polyhedron_ = 0;
  std::uint64_t cell_ = 0;              // number of the current cell
  std::vector<std::uint64_t> numbers_;  // numbers of the current cell
};

}  // namespace shm::converters::vtk
