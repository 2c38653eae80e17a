#include "sample_mesh.h"

#include <algorithm>
#include <cstring>
#include <functional>

namespace shm::converters {
namespace {

constexpr std::uint64_t kPieceElements = 65536;

using Read = std::function<void(std::uint64_t first, std::uint64_t count, std::byte* out)>;

// Those of `picked.size()` elements that are picked, read front to back.
std::vector<std::byte> take(const std::vector<bool>& picked, std::size_t stride, const Read& read) {
  std::vector<std::byte> taken, piece;
  for (std::uint64_t first = 0; first < picked.size(); first += kPieceElements) {
    const std::uint64_t count = std::min<std::uint64_t>(kPieceElements, picked.size() - first);
    const auto begin = picked.begin() + static_cast<std::ptrdiff_t>(first);
    if (std::find(begin, begin + static_cast<std::ptrdiff_t>(count), true) ==
        begin + static_cast<std::ptrdiff_t>(count))
      continue;
    piece.resize(count * stride);
    read(first, count, piece.data());
    for (std::uint64_t i = 0; i < count; ++i)
      if (picked[first + i]) {
        const std::byte* value = piece.data() + i * stride;
        taken.insert(taken.end(), value, value + stride);
      }
  }
  return taken;
}

// Adds up to `count` cells around `first` to `picked`; where faces lead no further, the next cell
// by number.
void grow_region(const CellGraph& graph, std::uint32_t first, std::uint32_t count,
                 std::vector<bool>& picked) {
  CellSequence queue;
  const auto pick = [&](std::uint32_t cell) {
    if (picked[cell] || queue.size() >= count) return;
    picked[cell] = true;
    queue.push_back(cell);
  };
  std::size_t scan = 0;
  for (std::uint32_t seed = first; seed < picked.size() && queue.size() < count; ++seed) {
    pick(seed);
    for (; scan < queue.size(); ++scan)
      for (std::uint32_t face = 0; face < 6; ++face)
        if (const CellFace to = graph.across(queue[scan], face)) pick(to.cell());
  }
}

// Cells that are no hexahedra, between vertices that picked cells have.
void add_others(const CellTable& cells, std::uint32_t count, std::vector<bool>& picked) {
  std::vector<bool> has_vertex(cells.vertices(), false);
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell)
    if (picked[cell])
      for (const std::uint32_t v : cells.cell(cell)) has_vertex[v] = true;
  for (std::uint32_t cell = 0; cell < cells.size() && count > 0; ++cell) {
    const auto corners = cells.cell(cell);
    if (picked[cell] || cells.is_hexahedron(cell) ||
        !std::all_of(corners.begin(), corners.end(),
                     [&](std::uint32_t v) { return has_vertex[v]; }))
      continue;
    picked[cell] = true;
    --count;
  }
}

}  // namespace

CellSequence sample_of_cells(const CellGraph& graph, std::uint32_t count) {
  const CellTable& cells = graph.cells();
  std::vector<bool> picked(cells.size(), cells.size() <= count);
  if (cells.size() > count) {
    grow_region(graph, 0, count / 2, picked);
    grow_region(graph, cells.size() / 2, count / 2, picked);
    add_others(cells, count, picked);
  }
  CellSequence list;
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell)
    if (picked[cell]) list.push_back(cell);
  return list;
}

SampleMesh::SampleMesh(MeshSource& mesh, const CellTable& cells, const CellSequence& picked)
    : info_(mesh.info()) {
  const MeshInfo whole = mesh.info();
  if (const std::uint64_t steps = whole.step_times.size(); steps > 0)
    for (const std::uint64_t step : {std::uint64_t{0}, steps / 2, steps - 1})
      if (steps_.empty() || step > steps_.back()) steps_.push_back(step);
  std::vector<bool> picked_vertices(cells.vertices(), false);
  take_cells(cells, picked, picked_vertices);
  if (picked.size() < cells.size() || info_.vertices < whole.vertices) info_.extras.clear();
  points_ = take(picked_vertices, 3 * scalar_bytes(info_.schema.coordinate_type),
                 [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                   mesh.read_points(first, count, out);
                 });
  arrays_.resize(info_.schema.arrays.size());
  std::vector<bool> picked_cells(cells.size(), false);
  for (const std::uint32_t cell : picked) picked_cells[cell] = true;
  for (std::size_t a = 0; a < arrays_.size(); ++a) {
    const ArrayInfo& array = whole.schema.arrays[a];
    if (array.location == Location::point) {
      take_array(mesh, a, picked_vertices);
    } else if (array.blocks.empty()) {
      take_array(mesh, a, picked_cells);
    } else {
      std::vector<bool> picked_elements;
      for (std::uint32_t cell = 0; cell < cells.size(); ++cell)
        if (whole.schema.array_covers(a, cells.block(cell)))
          picked_elements.push_back(picked_cells[cell]);
      take_array(mesh, a, picked_elements);
    }
  }
  info_.step_times.resize(steps_.size());
}

void SampleMesh::take_cells(const CellTable& cells, const CellSequence& picked,
                            std::vector<bool>& picked_vertices) {
  for (const std::uint32_t cell : picked)
    for (const std::uint32_t v : cells.cell(cell)) picked_vertices[v] = true;
  std::vector<std::uint32_t> number(cells.vertices());
  info_.vertices = 0;
  for (std::uint64_t v = 0; v < cells.vertices(); ++v)
    if (picked_vertices[v]) number[v] = static_cast<std::uint32_t>(info_.vertices++);
  info_.block_cells.assign(info_.block_cells.size(), 0);
  cells_ = CellTable(info_);
  std::vector<std::uint32_t> corners;
  for (const std::uint32_t cell : picked) {
    corners.clear();
    for (const std::uint32_t v : cells.cell(cell)) corners.push_back(number[v]);
    cells_.append(cells.block(cell), corners);
    ++info_.block_cells[cells.block(cell)];
  }
}

void SampleMesh::take_array(MeshSource& mesh, std::size_t array, const std::vector<bool>& picked) {
  const bool per_step = info_.schema.arrays[array].per_step;
  for (const std::uint64_t step : per_step ? steps_ : std::vector<std::uint64_t>{0})
    arrays_[array].push_back(take(picked, info_.array_stride(array),
                                  [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                                    mesh.read_array(array, step, first, count, out);
                                  }));
}

void SampleMesh::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  const std::size_t stride = 3 * scalar_bytes(info_.schema.coordinate_type);
  if (count > 0) std::memcpy(out, points_.data() + first * stride, count * stride);
}

bool SampleMesh::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  for (; next_cell_ < cells_.size() && out.size() < max_cells; ++next_cell_) {
    const auto corners = cells_.cell(next_cell_);
    out.blocks.push_back(cells_.block(next_cell_));
    out.corners.insert(out.corners.end(), corners.begin(), corners.end());
    out.corner_begin.push_back(out.corners.size());
  }
  return out.size() > 0;
}

void SampleMesh::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                            std::uint64_t count, std::byte* out) {
  const std::size_t stride = info_.array_stride(array);
  if (count > 0) std::memcpy(out, arrays_[array][step].data() + first * stride, count * stride);
}

}  // namespace shm::converters
