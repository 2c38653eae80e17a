// SpooledMesh: a mesh whose vertices and cells are numbered anew, so that what lies together has
// near numbers; all of it in a spool. Where a mesh is stored without order and does not fit the
// memory, this is what can be searched and read around.
//
// Vertices are numbered along a Hilbert curve, cells by the lowest of their vertices. Made with
// sorts and passes that read front to back: the points twice, the cells once for each part of the
// new numbers that fits the memory, and once more; each array, or each step of one, once when it is
// asked for. What an order of cells is does not depend on these numbers; coordinates that mean no
// places only make the search slower.
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
  // Borrows both. `sort_bytes`: memory beside the spool, while something is sorted. Must hold:
  // there are fewer cells and vertices than Cells may have (fits). Throws corrupt where a cell has
  // a vertex that is none.
  SpooledMesh(MeshSource& mesh, Spool& spool, std::size_t sort_bytes,
              const Progress& progress = {});
  static bool fits(const MeshInfo& info) {
    return info.cells() < kMostCells && info.vertices < kMostVertices;
  }

  // MeshSource, in new numbers. Extras follow them.
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    points_.read(first, count, out);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  // Cells. number_of() and with_number() are for neighbours, and for all in ascending order.
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
  // Values of an array, at one step where it has steps.
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
  std::vector<bool> hexahedral_;  // by block
  bool plain_;                    // hexahedra of eight nodes are all there is
  Numbers old_vertex_, new_vertex_, old_cell_, new_cell_;
  PagedArray points_;
  Numbers blocks_;                                    // with several
  BigArray<std::array<std::uint32_t, 8>> hexahedra_;  // of what is none, zeros
  mutable CellStore all_cells_;                       // where not all are plain
  std::vector<std::uint64_t> nodes_;                  // of the cell that is being added
  mutable CellBatch batch_;                           // what cell() returned
  mutable std::vector<std::uint32_t> corners_;
  std::uint64_t next_cell_ = 0;
  std::vector<Values> values_;                            // by array
  std::map<std::vector<std::uint32_t>, Numbers> places_;  // by covered blocks
};

// Whether a search for an order of cells, and reading in that order, take more than `memory` bytes
// where all is in memory; and SpooledMesh can take the mesh.
bool must_be_spooled(const MeshInfo& info, std::size_t memory);

// How they share `memory` bytes otherwise. What is not named is for the program itself, and a
// Writer or Reader.
struct SpooledSearch {
  explicit SpooledSearch(std::size_t memory)
      : mesh_bytes(memory / 4),
        sort_bytes(memory / 8),
        order_bytes(memory / 4),
        coding_bytes(memory / 4),
        table_bytes(memory / 8),
        cache_bytes(memory / 16) {}
  std::size_t mesh_bytes;    // the spool of the mesh
  std::size_t sort_bytes;    // its sorts, before there are orders
  std::size_t order_bytes;   // spools and sorts of what orders are made with
  std::size_t coding_bytes;  // the spool of a Writer, after that
  std::size_t table_bytes;   // the spool of tables for a comparison, instead
  std::size_t cache_bytes;   // its records of vertices, and values of a step
};

}  // namespace shm::converters
