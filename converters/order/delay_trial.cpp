#include "order/delay_trial.h"

#include <algorithm>
#include <array>
#include <vector>

#include "order/sample_mesh.h"

namespace shm::converters {
namespace {

// Sizes of the delay buffer in cells, in the order in which they are tried. The next size is tried
// only if the previous size is worthwhile, because a larger buffer saves bytes only if a smaller
// buffer does too.
constexpr std::array<std::uint32_t, 2> kDelays = {256, 1024};
// Smallest number of cells of a mesh for which delay buffers are tried.
constexpr std::uint64_t kFewestCells = 24000;
constexpr std::uint64_t kRunCells = 2048, kMostRuns = 16;
// The sample of a large mesh contains at most 1/20 of its cells.
constexpr std::uint64_t kShare = 20;

// Returns the runs of consecutive cells that form the sample. The runs are spread over the mesh,
// and the first run begins at the first cell. The effect of a delay buffer depends on the order of
// the cells. Therefore the cells of a run stay in the mesh's order, and a run is longer than the
// largest buffer.
std::vector<CellRun> runs_of(std::uint64_t cells) {
  const std::uint64_t count = std::clamp<std::uint64_t>(cells / kShare / kRunCells, 1, kMostRuns);
  std::vector<CellRun> runs;
  for (std::uint64_t i = 0; i < count; ++i) runs.push_back({cells / count * i, kRunCells});
  return runs;
}

}  // namespace

std::uint32_t find_delay(MeshSource& mesh, double worthwhile, const DelayCoder& code) {
  const MeshInfo& info = mesh.info();
  if (info.cells() < kFewestCells) return 0;
  SampleMesh sample(mesh, runs_of(info.cells()));
  const auto bytes = [&](std::uint32_t delay) {
    return bytes_of_all_steps(code(sample, delay), sample.info(), info.step_times.size());
  };
  std::uint32_t best = 0;
  double least = bytes(0) * (1 - worthwhile);
  for (const std::uint32_t delay : kDelays) {
    const double now = bytes(delay);
    if (now >= least) break;
    best = delay;
    least = now;
  }
  return best;
}

}  // namespace shm::converters
