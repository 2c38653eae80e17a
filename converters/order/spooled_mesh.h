// SpooledMesh: a copy of a mesh in a spool (temporary storage, on disk if large). Its vertices and
// cells are renumbered so that neighbours in space have close numbers. Algorithms that go from cell
// to neighbouring cell are then fast, even if the mesh does not fit into memory and neighbouring
// cells are far apart in its file.
//
// Vertices are numbered along a Hilbert curve, and cells by the lowest of their vertices. The
// construction uses sorts and sequential passes. It reads the points twice. It reads the cells once
// to find the vertices that are used. It then processes the table of new vertex numbers in parts
// that fit into memory, and reads the cells once for each part. An array, or a step of a stepped
// array, is read when it is first requested. The numbering does not affect the result of a search
// for an order of cells. If the coordinates are not positions in space, the search is slower, but
// its result is the same.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "base/big_array.h"
#include "base/progress.h"
#include "base/spool.h"
#include "mesh/cell_store.h"
#include "mesh/cells.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

class SpooledMesh final : public MeshSource, public Cells {
 public:
  // Borrows `mesh` and `spool`. `sort_bytes` is the memory limit for sorts, in addition to the
  // memory of the spool. Requires that fits() returns true, i.e. the numbers of cells and vertices
  // are below the limits of Cells. Throws Failure (corrupt) if a cell has an invalid vertex number.
  SpooledMesh(MeshSource& mesh, Spool& spool, std::size_t sort_bytes,
              const Progress& progress = {});
  static bool fits(const MeshInfo& info) {
    return info.cells() < kMostCells && info.vertices < kMostVertices;
  }

  // Functions of MeshSource. All vertex and cell numbers are the new numbers, including those in
  // extras.
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    points_.read(first, count, out);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  // Functions of Cells. number_of() and with_number() are fast if consecutive calls are for
  // neighbouring cells, or for all cells in ascending order.
  std::uint32_t size() const override { return static_cast<std::uint32_t>(old_cell_.size()); }
  std::uint64_t vertices() const override { return info_.vertices; }
  std::uint32_t block(std::uint32_t cell) const override {
    return one_block() ? 0 : blocks_.get(cell);
  }
  bool one_block() const override { return info_.schema.blocks.size() < 2; }
  bool is_hexahedron(std::uint32_t cell) const override { return hexahedral_[block(cell)]; }
  bool all_hexahedra() const override;
  std::array<std::uint32_t, 8> hexahedron(std::uint32_t cell) const override {
    return hexahedra_.get(cell);
  }
  std::span<const std::uint32_t> cell(std::uint32_t cell) const override;
  std::uint32_t number_of(std::uint32_t cell) const override { return old_cell_.get(cell); }
  std::uint32_t with_number(std::uint32_t number) const override { return new_cell_.get(number); }

  std::uint32_t number_of_vertex(std::uint32_t vertex) const { return old_vertex_.get(vertex); }

 private:
  using Numbers = BigArray<std::uint32_t>;
  // Values of a static array, or of a stepped array at one step.
  struct Values {
    std::uint64_t step = 0;
    std::optional<PagedArray> held;
  };

  std::vector<bool> used_vertices() const;
  void sort_vertices(const Progress& progress);
  void sort_cells(const Progress& progress);
  void add_cell(std::uint32_t number, std::uint32_t block);
  Numbers renumbered_corners(Spool& spool, const Progress& progress);
  template <class Visit>
  void for_each_part(const Numbers& list, Visit&& visit) const;
  void renumber_extras();
  Numbers& places_of(std::size_t array);
  void take_values(std::size_t array, std::uint64_t step, PagedArray& out);

  MeshSource* mesh_;
  Spool* spool_;
  std::size_t sort_bytes_;
  MeshInfo info_;
  std::vector<bool> hexahedral_;  // true for each block of hexahedra
  bool plain_;                    // true if all cells are hexahedra with eight nodes
  Numbers old_vertex_, new_vertex_, old_cell_, new_cell_;
  PagedArray points_;
  Numbers blocks_;  // block of each cell; empty if the mesh has only one block
  BigArray<std::array<std::uint32_t, 8>> hexahedra_;  // corners of hexahedra; zeros for other cells
  mutable CellStore all_cells_;                       // all cells; empty if plain_
  std::vector<std::uint64_t> nodes_;                  // nodes of the cell that is being added
  mutable CellBatch batch_;                           // result of cell()
  mutable std::vector<std::uint32_t> corners_;
  std::uint64_t next_cell_ = 0;
  std::vector<Values> values_;  // values by array

  // New numbers of elements by covered blocks.
  std::map<std::vector<std::uint32_t>, Numbers> places_;
};

// Returns true if a SpooledMesh is needed, because `memory` bytes are not enough to search for an
// order of cells, and to read the mesh in that order, without a spool. Also returns false if
// SpooledMesh does not support the mesh.
bool must_be_spooled(const MeshInfo& info, std::size_t memory);

// Memory limits in bytes for the parts of a search that uses spools. Parts that are active at the
// same time together need less than `memory` bytes. The remaining memory is for the program itself
// and for a Writer or Reader.
struct SpooledSearch {
  explicit SpooledSearch(std::size_t memory)
      : mesh_bytes(memory / 4),
        sort_bytes(memory / 8),
        order_bytes(memory / 4),
        coding_bytes(memory / 4),
        table_bytes(memory / 8),
        cache_bytes(memory / 16) {}
  std::size_t mesh_bytes;    // bytes for the spool of the mesh
  std::size_t sort_bytes;    // bytes for the sorts that renumber the mesh
  std::size_t order_bytes;   // bytes for spools and sorts while orders of cells are computed
  std::size_t coding_bytes;  // bytes for the spool of the Writer that runs after the search
  std::size_t table_bytes;   // bytes for tables while two meshes are compared
  std::size_t cache_bytes;   // bytes for vertex records and values while two meshes are compared
};

}  // namespace shm::converters
