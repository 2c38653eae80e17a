// SampleMesh: a part of a mesh in memory, small enough for trials.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/cell_table.h"
#include "mesh/mesh_source.h"
#include "order/cell_graph.h"
#include "order/cell_orders.h"
#include "shm/writer.h"

namespace shm::converters {

// Returns the numbers of about `count` cells in ascending order. They form two regions that grow
// over shared faces. Cells that are not hexahedra are included if all their vertices are in these
// regions. Returns all cells if the mesh has no more than `count`. `mesh`: mesh of the cells of the
// graph; the result contains its numbers. Needs one bit per vertex and cell.
CellSequence sample_of_cells(const CellGraph& graph, MeshSource& mesh, std::uint32_t count);

// A run of consecutive cells in file order.
struct CellRun {
  std::uint64_t first = 0, count = 0;
};

// A sample of a mesh: some cells with their vertices and all arrays. Stepped arrays have the first,
// the middle and the last step. Extras are present only if the sample is the whole mesh and every
// vertex is used.
class SampleMesh final : public MeshSource {
 public:
  // `picked`: cell numbers in ascending order. Reads the cells, points and values of `mesh` once,
  // and the cells once more for each set of blocks that arrays cover. Needs one bit per vertex and
  // cell.
  SampleMesh(MeshSource& mesh, const CellSequence& picked);
  // `runs`: runs of cells, ascending and disjoint. Memory is proportional to the sample; only the
  // pieces around its vertices are read. Throws Failure (corrupt) if a cell has an invalid vertex
  // number.
  SampleMesh(MeshSource& mesh, const std::vector<CellRun>& runs);

  const CellTable& cells() const { return cells_; }

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override { next_cell_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  struct Elements;
  void choose_steps(const MeshInfo& whole);
  Elements take_runs(MeshSource& mesh, const std::vector<CellRun>& runs);
  std::vector<bool> take_cells(MeshSource& mesh, const std::vector<bool>& picked);
  std::vector<std::uint64_t> take_corners(const std::vector<std::uint64_t>& corners,
                                          const std::vector<std::uint64_t>& corner_begin,
                                          const std::vector<std::uint32_t>& cell_blocks);
  void take_array(MeshSource& mesh, std::size_t array, const std::vector<bool>& picked);

  MeshInfo info_;
  CellTable cells_;
  std::vector<std::byte> points_;
  // Values by array and step (0 for static arrays).
  std::vector<std::vector<std::vector<std::byte>>> arrays_;
  std::vector<std::uint64_t> steps_;  // number in the source of each step of the sample
  std::uint32_t next_cell_ = 0;
};

// Estimates the size in bytes of a sample with all of `steps` steps. `sizes` are the sizes with the
// steps of the sample. Assumes that the average size of a step is the same.
double bytes_of_all_steps(const SizeReport& sizes, const MeshInfo& sample, std::size_t steps);

}  // namespace shm::converters
