// JoinedMesh: the parts of a decomposed Exodus mesh as one mesh, in the numbers of the whole. Ranks
// read their own parts and send each other what they need of it, into spools: cells, with their
// values, to the ranks that will code them; values of vertices to the owners of their numbers
// (NumberOwners), who see that parts agree, and from there to the ranks whose cells use them.
//
// At first all reading is collective: all ranks must ask for the same in the same order, and get
// it. From read_alone on a rank reads what it holds, and no other hears of it.
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
  // Collective. `ranks` and `spool` are borrowed. Throws SharedFailure.
  JoinedMesh(Ranks& ranks, const std::vector<std::string>& files, Spool& spool);

  // Collective: this rank takes the cells of `range`. Ranges of ranks follow each other, and are
  // all cells. Must come before anything is read.
  void hold_cells(const CellRange& range);
  // From now on this rank reads what it holds: its cells; values, when it has taken them.
  void read_alone() { alone_ = true; }
  // Collective: this rank takes those vertices, each once, and their static values and those of its
  // cells.
  void hold_vertices(const std::vector<std::uint64_t>& vertices);
  // Collective: this rank takes the values that an array has at a step for its vertices or cells,
  // instead of those of the step before.
  void hold_step(std::size_t array, std::uint64_t step);

  const MeshInfo& info() const override { return structure_.info; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void seek_cells(std::uint64_t first) override { next_cell_ = first; }
  // Of vertices and cells that the rank has not taken the values are 0.
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  static constexpr std::size_t kCoordinates = ~std::size_t{0};  // as the number of an array

  // Where the values of an array of the mesh are in a part.
  struct Piece {
    std::size_t array = 0;    // of the part
    std::uint64_t first = 0;  // element of the array there
    std::uint64_t cell = 0;   // of the part, that the first element is of
    std::uint64_t count = 0;
  };
  // The values of one array that this rank keeps for others: of the vertices that it owns, or of
  // the cells that it has taken.
  struct Kept {
    std::uint64_t first = 0;  // element of the array
    PagedArray values;
  };

  void find_ends();
  void map_arrays();
  std::vector<Piece> pieces_of(const PartFile& part, std::size_t array) const;
  std::size_t stride_of(std::size_t array) const;
  Location location_of(std::size_t array) const;
  std::uint64_t covered_before(std::size_t array, std::uint64_t cell) const;
  std::size_t rank_with(std::uint64_t cell) const;

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
  std::optional<NumberOwners> owners_;                   // of vertices
  std::vector<std::uint64_t> block_begins_;              // cells before each block
  std::vector<std::vector<std::vector<Piece>>> pieces_;  // [part][array]

  CellRange range_;
  std::vector<std::uint64_t> ends_;  // cells up to the end of each rank's range
  CellStore cells_;                  // in the order in which they came
  std::optional<NumberTable> arrival_;
  std::uint64_t next_cell_ = 0;

  std::map<std::size_t, Kept> static_;  // by array
  // The last array with steps, and its values.
  std::optional<std::pair<std::size_t, std::uint64_t>> step_;
  std::optional<Kept> step_values_;

  bool alone_ = false;
  std::vector<std::uint64_t> vertices_;      // taken, ascending
  std::map<std::size_t, PagedArray> taken_;  // static values of them
  std::optional<PagedArray> step_taken_;
};

}  // namespace shm::converters
