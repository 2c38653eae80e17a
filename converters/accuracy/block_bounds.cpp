#include "accuracy/block_bounds.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "base/stored_value.h"
#include "mesh/array_names.h"
#include "mesh/cell_cursor.h"

namespace shm::converters {
namespace {

constexpr std::string_view kKey = "mesh/block_bounds/";

void put_value(double value, ScalarType type, std::byte* at) {
  const auto narrow = static_cast<float>(value);
  if (type == ScalarType::float64)
    std::memcpy(at, &value, sizeof value);
  else
    std::memcpy(at, &narrow, sizeof narrow);
}

}  // namespace

bool has_any(const BlockBounds& bounds) {
  return std::any_of(bounds.begin(), bounds.end(), [](const auto& it) { return !it.empty(); });
}

bool is_block_bounds(std::string_view key) { return key.starts_with(kKey); }

BlockBounds block_bounds_in(const MeshInfo& info) {
  const Schema& schema = info.schema;
  BlockBounds bounds(schema.arrays.size());
  for (const Extra& extra : info.extras) {
    if (!is_block_bounds(extra.key) || extra.type != ScalarType::float64 ||
        extra.data.size() != schema.blocks.size() * sizeof(double))
      continue;
    const std::vector<std::string> paths = paths_of(schema);
    const auto path = std::find(paths.begin(), paths.end(), extra.key.substr(kKey.size()));
    if (path == paths.end()) continue;
    const auto a = static_cast<std::size_t>(path - paths.begin());
    const ArrayInfo& array = schema.arrays[a];
    if (array.location != Location::cell || !is_float(array.type) || array.quantization.lossy())
      continue;
    std::vector<double> of_array(schema.blocks.size());
    std::memcpy(of_array.data(), extra.data.data(), extra.data.size());
    const auto is_valid = [](double bound) { return bound >= 0 && std::isfinite(bound); };
    if (std::all_of(of_array.begin(), of_array.end(), is_valid)) bounds[a] = std::move(of_array);
  }
  return bounds;
}

double rounded_within(double bound, double value, ScalarType type) {
  if (!(bound > 0) || !std::isfinite(value) || value == 0) return value;
  int exponent = 0;
  std::frexp(bound, &exponent);  // 2^(exponent - 1) <= bound
  const double step = std::ldexp(1.0, exponent);
  const double number = std::floor(value / step + .5);
  // Larger numbers are multiples of the step already.
  if (!(std::fabs(number) < 0x1p51)) return value;
  double rounded = number * step;
  if (type == ScalarType::float32) rounded = static_cast<double>(static_cast<float>(rounded));
  return std::fabs(rounded - value) <= bound ? rounded : value;
}

std::vector<BlockRun> cell_runs(MeshSource& mesh) {
  std::vector<BlockRun> runs;
  CellCursor cursor(mesh);
  for (std::uint64_t cell = 0; cursor.next(); ++cell)
    if (runs.empty() || runs.back().block != cursor.block()) runs.push_back({cell, cursor.block()});
  mesh.rewind_cells();
  return runs;
}

std::vector<BlockRun> element_runs(const std::vector<BlockRun>& cells, std::uint64_t cell_count,
                                   const ArrayInfo& array) {
  std::vector<BlockRun> runs;
  std::uint64_t element = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::uint32_t block = cells[i].block;
    if (!array.blocks.empty() &&
        !std::binary_search(array.blocks.begin(), array.blocks.end(), block))
      continue;
    if (runs.empty() || runs.back().block != block) runs.push_back({element, block});
    element += (i + 1 < cells.size() ? cells[i + 1].first : cell_count) - cells[i].first;
  }
  return runs;
}

RoundedMesh::RoundedMesh(MeshSource& source, BlockBounds bounds, const Schema& schema)
    : ForwardingMesh(source), bounds_(std::move(bounds)), runs_(bounds_.size()) {
  info_ = source.info();
  const std::vector<BlockRun> cells = cell_runs(source);
  const std::vector<std::string> paths = paths_of(info_.schema);
  for (std::size_t a = 0; a < bounds_.size(); ++a) {
    if (bounds_[a].empty()) continue;
    info_.schema.arrays[a].fills = schema.arrays[a].fills;
    runs_[a] = element_runs(cells, info_.cells(), info_.schema.arrays[a]);
    Extra extra;
    extra.key = std::string(kKey) + paths[a];
    extra.type = ScalarType::float64;
    extra.shape = {bounds_[a].size()};
    extra.data.resize(bounds_[a].size() * sizeof(double));
    std::memcpy(extra.data.data(), bounds_[a].data(), extra.data.size());
    std::erase_if(info_.extras, [&](const Extra& other) { return other.key == extra.key; });
    info_.extras.push_back(std::move(extra));
  }
}

void RoundedMesh::read_array(std::size_t a, std::uint64_t step, std::uint64_t first,
                             std::uint64_t count, std::byte* out) {
  source_.read_array(a, step, first, count, out);
  if (bounds_[a].empty() || count == 0) return;
  const ArrayInfo& array = info_.schema.arrays[a];
  const std::size_t width = scalar_bytes(array.type), stride = info_.array_stride(a);
  for_each_run(runs_[a], first, first + count,
               [&](std::uint32_t block, std::uint64_t from, std::uint64_t to) {
                 std::byte* const end = out + (to - first) * stride;
                 for (std::byte* at = out + (from - first) * stride; at < end; at += width) {
                   const double value = as_double(at, array.type);
                   const double rounded = rounded_within(bounds_[a][block], value, array.type);
                   // A rounded value must not become a fill value.
                   if (!is_fill_value(array.fills, value) && !is_fill_value(array.fills, rounded))
                     put_value(rounded, array.type, at);
                 }
               });
}

}  // namespace shm::converters
