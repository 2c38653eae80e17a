// SampleMesh: a part of a mesh in memory, small enough to try things on.
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

// About `count` cells of a mesh, in ascending number: two regions that grow over shared faces, with
// the other cells that have all their vertices there; all cells, when there are no more. `mesh`:
// the one that the cells of the graph are from; the numbers are its own. A bit a vertex and cell.
CellSequence sample_of_cells(const CellGraph& graph, MeshSource& mesh, std::uint32_t count);

// Some cells that stand one behind the other in their file.
struct CellRun {
  std::uint64_t first = 0, count = 0;
};

// The cells of a sample with their vertices and all arrays, of the stepped ones the first step, the
// middle one and the last. Extras only where the sample is the whole mesh, and no vertex unused.
class SampleMesh final : public MeshSource {
 public:
  // `picked`: in ascending order. Reads the cells, points and values of `mesh` once (the cells once
  // more for arrays on some blocks). A bit a vertex and cell.
  SampleMesh(MeshSource& mesh, const CellSequence& picked);
  // `runs`: ascending and apart. Memory follows the sample; vertices are read where they lie.
  // Throws corrupt where a cell has a vertex that is none.
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
  std::vector<std::vector<std::vector<std::byte>>> arrays_;  // [array][step, or 0]
  std::vector<std::uint64_t> steps_;                         // of the source, for each step here
  std::uint32_t next_cell_ = 0;
};

// Bytes of a sample that was coded with `sizes`, if all of `steps` steps were as large on the
// average as those that it has.
double bytes_of_all_steps(const SizeReport& sizes, const MeshInfo& sample, std::size_t steps);

}  // namespace shm::converters
