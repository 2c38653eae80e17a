// SetSides: a mesh whose cells are the sides of a side set. Its vertices are the vertices of these
// sides.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/forwarding_mesh.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

class SetSides final : public ForwardingMesh {
 public:
  // `set` is a side set of `source` whose members are cells of `source`. `cell_numbers[c]` is the
  // number in the file of cell c of `source`. The resulting mesh has one block per shape of sides,
  // and the point arrays of the source. Two cell arrays contain, for each side, the number of its
  // cell (shm_cell_number) and the number of the side in this cell, from 1 (shm_side). Memory grows
  // with the size of the set.
  SetSides(MeshSource& source, const MeshSet& set, bool flat,
           const std::vector<std::uint64_t>& cell_numbers);
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_side_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;
  // Returns the number of sides that this mesh omits. A side is omitted if the shape of its cell
  // has no known sides, or no side with this number.
  std::uint64_t left_out() const { return left_out_; }

 private:
  struct Side {
    std::uint32_t block = 0;
    std::int64_t cell = 0, side = 0;  // `cell`: number of the cell in the file; `side`: number of
                                      // the side in the cell
    std::vector<std::uint64_t> nodes;
  };
  void find_sides(const MeshSet& set, bool flat, const std::vector<std::uint64_t>& cell_numbers);
  void number_vertices();

  std::vector<Side> sides_;
  std::vector<std::uint64_t> vertices_;  // vertex numbers of the source, ascending

  // Indices of the source's point arrays. They are the first arrays of this mesh. The two cell
  // arrays shm_cell_number and shm_side follow.
  std::vector<std::size_t> arrays_;
  std::size_t next_side_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace shm::converters
