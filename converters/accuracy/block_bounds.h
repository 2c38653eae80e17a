// Error bounds of single blocks. The format has one bound for each array. An array whose blocks
// have different bounds is therefore rounded before it is compressed, and stored without loss.
// Values are rounded to multiples of a power of two, which take few bits. Extras record the bounds:
//
//   mesh/block_bounds/<path>   float64, one number for each block: the largest error in this block;
//                              0 if values are exact. <path> is the path of the array (paths_of())
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "mesh/forwarding_mesh.h"

namespace shm::converters {

// For each array: the bound in each block, or an empty list if the array has no such bounds.
using BlockBounds = std::vector<std::vector<double>>;

// Returns true if any array has bounds of blocks.
bool has_any(const BlockBounds& bounds);
// Returns true if extras with this key record bounds of blocks.
bool is_block_bounds(std::string_view key);
// Returns the bounds that the extras of a mesh record. Ignores invalid extras, and those of arrays
// that have been rounded again.
BlockBounds block_bounds_in(const MeshInfo& info);
// Rounds a value of the type float32 or float64 to a multiple of the largest power of two that is
// at most twice the bound. Returns the value unchanged if it is not finite, if it is 0, or if it
// would change by more than the bound.
double rounded_within(double bound, double value, ScalarType type);

// Consecutive cells, or elements of a cell array, of the same block.
struct BlockRun {
  std::uint64_t first = 0;  // index of the first cell or element
  std::uint32_t block = 0;
};
// Reads all cells of a mesh, and returns the runs of cells, at 16 bytes a run.
std::vector<BlockRun> cell_runs(MeshSource& mesh);
// Returns the runs of the elements of a cell array.
std::vector<BlockRun> element_runs(const std::vector<BlockRun>& cells, std::uint64_t cell_count,
                                   const ArrayInfo& array);

// Calls visit(block, first, end) for the part of each run that is between the elements `first` and
// `end`.
template <class Visit>
void for_each_run(const std::vector<BlockRun>& runs, std::uint64_t first, std::uint64_t end,
                  Visit&& visit) {
  if (runs.empty()) return;
  auto run = std::upper_bound(runs.begin(), runs.end(), first,
                              [](std::uint64_t at, const BlockRun& it) { return at < it.first; });
  for (--run; first < end; ++run) {
    const std::uint64_t stop = run + 1 == runs.end() ? end : std::min(end, (run + 1)->first);
    visit(run->block, first, stop);
    first = stop;
  }
}

// A mesh whose arrays with block bounds are rounded. Has the extras that record the bounds. The
// fill values of the arrays in `schema`, which do not change, are also those of the mesh.
class RoundedMesh final : public ForwardingMesh {
 public:
  RoundedMesh(MeshSource& source, BlockBounds bounds, const Schema& schema);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  BlockBounds bounds_;
  std::vector<std::vector<BlockRun>> runs_;  // of each array with bounds
};

}  // namespace shm::converters
