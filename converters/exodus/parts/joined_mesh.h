// JoinedMesh: reads the parts of a decomposed Exodus mesh as one mesh, with the numbers of the
// whole mesh. Each rank reads some of the parts, and sends data to the ranks that need it. Each
// rank stores the data that it receives in a spool (bounded memory and a temporary file):
// - Cells, with their values, are sent to the ranks that will encode them.
// - Values of vertices are sent to the owners of the vertex numbers (NumberOwners). The owners
// check that the parts agree, and send the values to the ranks whose cells use the vertices.
//
// At first, all read functions are collective: all ranks must make the same calls in the same
// order, and all ranks receive the result. After read_alone(), the read functions return only data
// that this rank holds, and do not communicate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/spool.h"
#include "exodus/parts/joined_structure.h"
#include "exodus/parts/owners.h"
#include "exodus/parts/part_files.h"
#include "mesh/cell_store.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

class JoinedMesh : public MeshSource {
 public:
  // Collective. Borrows `ranks` and `spool`. Throws SharedFailure.
  JoinedMesh(Ranks& ranks, const std::vector<std::string>& files, Spool& spool);

  // Collective. Assigns the cells of `range` to this rank. The ranges of the ranks must be
  // consecutive, in the order of the ranks, and together contain all cells. Must be called before
  // cells or values are read.
  void hold_cells(const CellRange& range);
  // Ends collective reading. From now on, the read functions return only data that this rank holds:
  // its cells, and the values that it has fetched.
  void read_alone() { alone_ = true; }
  // Collective. Fetches the given vertices, which must be distinct. Also fetches the static values
  // of these vertices and of this rank's cells.
  void hold_vertices(const std::vector<std::uint64_t>& vertices);
  // Collective. Fetches the values of an array at a step for this rank's vertices or cells. These
  // values replace the values that the previous call fetched.
  void hold_step(std::size_t array, std::uint64_t step);

  const MeshInfo& info() const override { return structure_.info; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void seek_cells(std::uint64_t first) override { next_cell_ = first; }
  // Reads values of an array. Vertices and cells that this rank does not hold have the value 0.
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  // Array index that represents the coordinates.
  static constexpr std::size_t kCoordinates = ~std::size_t{0};

  // Consecutive elements of an array in a part, and the cells to which they belong.
  struct Piece {
    std::size_t array = 0;    // index of the array among the arrays of the part
    std::uint64_t first = 0;  // index of the first of these elements in the array of the part
    std::uint64_t cell = 0;   // index in the part of the cell to which the first of these elements
                              // belongs
    std::uint64_t count = 0;
  };
  // The values of one array that this rank stores on behalf of all ranks. For a point array, these
  // are the values of the vertices that this rank owns; for a cell array, the values of the cells
  // that are assigned to it.
  struct Kept {
    std::uint64_t first = 0;  // index in the array of the first stored element
    PagedArray values;
  };

  void find_ends();
  void map_arrays();
  std::vector<Piece> pieces_of(const PartFile& part, std::size_t array) const;
  std::size_t stride_of(std::size_t array) const;
  Location location_of(std::size_t array) const;
  std::uint64_t covered_before(std::size_t array, std::uint64_t cell) const;
  std::size_t rank_with(std::uint64_t cell) const;

  void read_beside_mesh(std::size_t array, std::uint64_t step, std::uint64_t first,
                        std::uint64_t count, std::byte* out) const;
  Kept load(std::size_t array, std::uint64_t step);
  Kept load_vertices(std::size_t array, std::uint64_t step);
  Kept load_cells(std::size_t array, std::uint64_t step);
  PagedArray fetch(Kept& kept, std::size_t array);
  Kept& kept(std::size_t array, std::uint64_t step);

  void serve(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
             std::byte* out);
  void serve_cells(CellBatch& out, std::size_t max_cells);
  void read_held(std::uint64_t first, std::uint64_t count, CellBatch& out);
  void read_vertices(PagedArray& values, std::size_t stride, std::uint64_t first,
                     std::uint64_t count, std::byte* out) const;

  Ranks* ranks_;
  Spool* spool_;
  PartFiles parts_;
  JoinedStructure structure_;
  std::optional<NumberOwners> owners_;                   // owners of the vertices
  std::vector<std::uint64_t> block_begins_;              // number of cells before each block
  std::vector<std::vector<std::vector<Piece>>> pieces_;  // [part][array]

  CellRange range_;
  // For each rank, the end of its range of cells.
  std::vector<std::uint64_t> ends_;
  CellStore cells_;  // cells in the order in which they arrived
  std::optional<NumberTable> arrival_;
  std::uint64_t next_cell_ = 0;

  std::map<std::size_t, Kept> static_;  // values of static arrays, by array

  // Cache of the most recently read time-dependent values. step_ identifies their array and step;
  // step_values_ contains the values.
  std::optional<std::pair<std::size_t, std::uint64_t>> step_;
  std::optional<Kept> step_values_;

  bool alone_ = false;
  std::vector<std::uint64_t> vertices_;      // vertices that this rank has fetched, ascending
  std::map<std::size_t, PagedArray> taken_;  // static values of the fetched vertices, by array
  std::optional<PagedArray> step_taken_;
};

}  // namespace shm::converters
