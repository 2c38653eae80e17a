// SampleMesh: a small part of a mesh, in memory, that is used to try options of the encoder.
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

// Chooses a sample of about `count` hexahedra, and returns the numbers of its cells in `mesh` in
// ascending order. The hexahedra form two regions, each of which starts at one cell and grows
// across shared faces. The sample also includes up to `count` other cells whose vertices all belong
// to these regions. Returns all cells if the mesh has at most `count` cells. `graph` must be the
// graph of the cells of `mesh`. Needs one bit of memory per vertex and per cell.
CellSequence sample_of_cells(const CellGraph& graph, MeshSource& mesh, std::uint32_t count);

// A run of consecutive cells in file order.
struct CellRun {
  std::uint64_t first = 0, count = 0;
};

// A sample of a mesh: some of its cells with their vertices, and all its arrays. It contains the
// first, the middle and the last time step. It contains the extras of the mesh only if it consists
// of all cells and all vertices of the mesh.
class SampleMesh final : public MeshSource {
 public:
  // `picked` contains cell numbers in ascending order. Reads the cells, points and values of `mesh`
  // once. If arrays cover only some blocks, reads the cells once more for each combination of
  // covered blocks. Needs one bit of memory per vertex and per cell.
  SampleMesh(MeshSource& mesh, const CellSequence& picked);
  // The runs must be ascending and disjoint. The memory needed is proportional to the size of the
  // sample. Only the pieces of coordinates and values that contain elements of the sample are read.
  // Throws Failure (corrupt) if a cell has an invalid vertex number.
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
  // Values of the sample: arrays_[a][s] are the values of array a at step s (s is 0 for static
  // arrays).
  std::vector<std::vector<std::vector<std::byte>>> arrays_;
  std::vector<std::uint64_t> steps_;  // for each step of the sample, its number in the whole mesh
  std::uint32_t next_cell_ = 0;
};

// Estimates the encoded size in bytes that the sample would have with all `steps` time steps of the
// mesh. `sizes` are the encoded sizes of the sample with its own steps. Assumes that the other
// steps have the same average size.
double bytes_of_all_steps(const SizeReport& sizes, const MeshInfo& sample, std::size_t steps);

}  // namespace shm::converters
