#include "order/rounding_trial.h"

#include <algorithm>
#include <string>
#include <vector>

#include "order/sample_mesh.h"

namespace shm::converters {
namespace {

// A mesh with at most kMostBytes of coordinates and values is encoded as a whole.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20;
// The sample of a larger mesh: runs of consecutive cells, spread over the mesh.
constexpr std::uint64_t kTrialRuns = 4, kTrialRunCells = 4096;

std::uint64_t bytes_of_values(const MeshInfo& info) {
  const Schema& schema = info.schema;
  std::uint64_t bytes = info.vertices * 3 * scalar_bytes(schema.coordinate_type);
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& array = schema.arrays[a];
    bytes += info.array_elements(a) * scalar_bytes(array.type) * array.components *
             (array.per_step ? info.step_times.size() : 1);
  }
  return bytes;
}

std::vector<CellRun> trial_runs(std::uint64_t cells) {
  if (cells <= kTrialRuns * kTrialRunCells) return {{0, cells}};
  std::vector<CellRun> runs;
  for (std::uint64_t i = 0; i < kTrialRuns; ++i)
    runs.push_back({cells / kTrialRuns * i, kTrialRunCells});
  return runs;
}

void compare(MeshSource& part, Schema& schema, const RoundingCoder& code) {
  Schema exact = schema;
  exact.coordinate_quantization = {};
  for (ArrayInfo& array : exact.arrays) array.quantization = {};
  const SizeReport with = code(part, schema), without = code(part, exact);
  const auto is_useless = [&](const std::string& stream) {
    const auto size = [&](const SizeReport& report) {
      const auto found = report.streams.find(stream);
      return found == report.streams.end() ? 0 : found->second;
    };
    return size(without) <= size(with);
  };
  if (is_useless("geometry")) schema.coordinate_quantization = {};
  const std::vector<std::string> names = array_stream_names(schema);
  for (std::size_t a = 0; a < names.size(); ++a)
    if (is_useless(names[a])) schema.arrays[a].quantization = {};
}

}  // namespace

void remove_useless_rounding(MeshSource& mesh, Schema& schema, const RoundingCoder& code) {
  const bool is_rounded =
      schema.coordinate_quantization.lossy() ||
      std::any_of(schema.arrays.begin(), schema.arrays.end(),
                  [](const ArrayInfo& array) { return array.quantization.lossy(); });
  if (!is_rounded) return;
  if (bytes_of_values(mesh.info()) <= kMostBytes) return compare(mesh, schema, code);
  SampleMesh sample(mesh, trial_runs(mesh.info().cells()));
  compare(sample, schema, code);
}

}  // namespace shm::converters
