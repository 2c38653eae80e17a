// SetSides: the sides of a side set as cells, in a mesh of their vertices alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/forwarding_mesh.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

class SetSides final : public ForwardingMesh {
 public:
  // `set` is a side set of `source`, its members cells of it, `cell_numbers` the numbers that these
  // have in the file. One block for each shape; point arrays come along, and for each side the
  // number of its cell (shm_cell_number) and its place in it from 1 (shm_side). Memory follows the
  // set.
  SetSides(MeshSource& source, const MeshSet& set, bool flat,
           const std::vector<std::uint64_t>& cell_numbers);
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_side_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;
  // Sides of cells whose sides are not known.
  std::uint64_t left_out() const { return left_out_; }

 private:
  struct Side {
    std::uint32_t block = 0;
    std::int64_t cell = 0, side = 0;  // numbers in the file; in the cell
    std::vector<std::uint64_t> nodes;
  };
  void find_sides(const MeshSet& set, bool flat, const std::vector<std::uint64_t>& cell_numbers);
  void number_vertices();

  std::vector<Side> sides_;
  std::vector<std::uint64_t> vertices_;  // of the source, ascending
  std::vector<std::size_t> arrays_;      // of the source; those behind are of sides
  std::size_t next_side_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace shm::converters
