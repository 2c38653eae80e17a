#include "accuracy/block_accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "accuracy/value_sample.h"
#include "base/stored_value.h"

namespace shm::converters {
namespace {

constexpr std::uint64_t kPieceElements = 1 << 16;

// Range of the finite values of an array in one block.
struct Range {
  double least = std::numeric_limits<double>::max();
  double most = std::numeric_limits<double>::lowest();
  ValueSample sample;

  void add(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
    sample.add(value);
  }
  double size() const {
    return least > most ? 0 : std::min(most - least, std::numeric_limits<double>::max());
  }
};

// Returns the range in each block, followed by the range in all blocks. `array` is array `a` of the
// mesh, with all fill values.
std::vector<Range> ranges_of(MeshSource& mesh, std::size_t a, const ArrayInfo& array,
                             const std::vector<BlockRun>& runs, const Progress& progress) {
  const MeshInfo& info = mesh.info();
  const std::size_t width = scalar_bytes(array.type), stride = info.array_stride(a);
  const std::uint64_t elements = info.array_elements(a);
  const std::uint64_t steps = array.per_step ? info.step_times.size() : 1;
  std::vector<Range> ranges(info.schema.blocks.size() + 1);
  std::vector<std::byte> bytes;
  for (std::uint64_t step = 0; step < steps; ++step) {
    for (std::uint64_t first = 0; first < elements; first += kPieceElements) {
      const std::uint64_t end = std::min(first + kPieceElements, elements);
      bytes.resize(static_cast<std::size_t>(end - first) * stride);
      mesh.read_array(a, step, first, end - first, bytes.data());
      for_each_run(
          runs, first, end, [&](std::uint32_t block, std::uint64_t from, std::uint64_t to) {
            for (std::size_t at = (from - first) * stride; at < (to - first) * stride; at += width)
              if (const double value = as_double(&bytes[at], array.type);
                  std::isfinite(value) && !is_fill_value(array.fills, value)) {
                ranges[block].add(value);
                ranges.back().add(value);
              }
          });
    }
    if (progress) progress("measuring " + array.name, step + 1, steps);
  }
  return ranges;
}

}  // namespace

BlockBounds block_bounds_of(MeshSource& mesh, const Lossy& lossy, const Progress& progress) {
  Schema schema = mesh.info().schema;
  add_fills(lossy, schema);
  const auto accuracies = accuracies_of_blocks(schema, lossy);
  const std::vector<BlockRun> cells = cell_runs(mesh);
  BlockBounds bounds(accuracies.size());
  for (std::size_t a = 0; a < accuracies.size(); ++a) {
    if (accuracies[a].empty()) continue;
    const auto is_relative = [](const BlockAccuracy& it) {
      return it.accuracy.kind == Accuracy::Kind::relative;
    };
    std::vector<Range> ranges(accuracies[a].size() + 1);
    if (std::any_of(accuracies[a].begin(), accuracies[a].end(), is_relative))
      ranges = ranges_of(mesh, a, schema.arrays[a],
                         element_runs(cells, mesh.info().cells(), schema.arrays[a]), progress);
    const auto warn_if_far = [](const Range& range, const std::string& name) {
      if (range.sample.has_outliers(range.size())) warn_of_outliers(name);
    };
    bool needs_all = false;
    for (std::size_t b = 0; b < accuracies[a].size(); ++b) {
      const auto& [accuracy, is_of_block] = accuracies[a][b];
      bounds[a].push_back(accuracy.bound);
      if (!is_relative(accuracies[a][b])) continue;
      bounds[a].back() *= (is_of_block ? ranges[b] : ranges.back()).size();
      if (is_of_block) {
        const BlockInfo& block = schema.blocks[b];
        warn_if_far(ranges[b], schema.arrays[a].name + '@' +
                                   (block.name.empty() ? std::to_string(block.id) : block.name));
      }
      needs_all = needs_all || !is_of_block;
    }
    if (needs_all) warn_if_far(ranges.back(), schema.arrays[a].name);
  }
  return bounds;
}

}  // namespace shm::converters
