#include "order/sample_mesh.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <map>
#include <span>
#include <utility>

#include "mesh/cell_cursor.h"
#include "mesh/vertex_compaction.h"

namespace shm::converters {
namespace {

constexpr std::uint64_t kSampleElements = 65536;
// Two needed elements are read in one call if at most this number of unneeded elements lies between
// them. Fewer calls are faster, because each read of a file with compressed chunks may have to
// unpack a whole chunk.
constexpr std::uint64_t kMostUnwanted = 16384;

using Read = std::function<void(std::uint64_t first, std::uint64_t count, std::byte* out)>;

// Returns the values of the elements that are marked in `picked`. Reads and returns the elements in
// ascending order of their indices.
std::vector<std::byte> take(const std::vector<bool>& picked, std::size_t stride, const Read& read) {
  std::vector<std::byte> taken, piece;
  for (std::uint64_t first = 0; first < picked.size(); first += kSampleElements) {
    const std::uint64_t count = std::min<std::uint64_t>(kSampleElements, picked.size() - first);
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

// Returns the values of the elements with the given indices, which must be in ascending order.
std::vector<std::byte> take(const std::vector<std::uint64_t>& numbers, std::size_t stride,
                            const Read& read) {
  std::vector<std::byte> taken(numbers.size() * stride), piece;
  for (std::size_t begin = 0, end = 0; begin < numbers.size(); begin = end) {
    const std::uint64_t first = numbers[begin];
    for (end = begin + 1; end < numbers.size() &&
                          numbers[end] - numbers[end - 1] <= kMostUnwanted &&
                          numbers[end] - first < kSampleElements;)
      ++end;
    const std::uint64_t count = numbers[end - 1] - first + 1;
    piece.resize(count * stride);
    read(first, count, piece.data());
    for (std::size_t i = begin; i < end; ++i)
      std::memcpy(taken.data() + i * stride, piece.data() + (numbers[i] - first) * stride, stride);
  }
  return taken;
}

// Picks up to `count` cells: sets the elements of `picked` at their cell numbers. The cells form a
// region that starts at cell `first` and grows across faces. When it cannot grow further, it
// continues at the cell with the next number that is not yet in the region.
void grow_region(const CellGraph& graph, std::uint32_t first, std::uint32_t count,
                 std::vector<bool>& picked) {
  const Cells& cells = graph.cells();
  CellSequence queue;
  const auto pick = [&](std::uint32_t cell) {
    if (queue.size() >= count) return;
    const std::uint32_t number = cells.number_of(cell);
    if (picked[number]) return;
    picked[number] = true;
    queue.push_back(cell);
  };
  std::size_t scan = 0;
  for (std::uint32_t seed = first; seed < picked.size() && queue.size() < count; ++seed) {
    pick(cells.with_number(seed));
    for (; scan < queue.size(); ++scan)
      for (std::uint32_t face = 0; face < 6; ++face)
        if (const CellFace to = graph.across(queue[scan], face)) pick(to.cell());
  }
}

// Marks up to `count` cells that are not hexahedra and whose vertices all belong to marked cells.
void add_others(MeshSource& mesh, std::uint32_t count, std::vector<bool>& picked) {
  const std::vector<BlockInfo>& blocks = mesh.info().schema.blocks;
  std::vector<bool> has_vertex(mesh.info().vertices, false);
  std::uint64_t cell = 0;
  for (CellCursor cursor(mesh); cursor.next(); ++cell)
    if (picked[cell])
      for (const std::uint64_t v : cursor.corners()) has_vertex[v] = true;
  cell = 0;
  for (CellCursor cursor(mesh); count > 0 && cursor.next(); ++cell) {
    const auto corners = cursor.corners();
    if (picked[cell] || holds_hexahedra(blocks[cursor.block()]) ||
        !std::all_of(corners.begin(), corners.end(),
                     [&](std::uint64_t v) { return has_vertex[v]; }))
      continue;
    picked[cell] = true;
    --count;
  }
  mesh.rewind_cells();
}

}  // namespace

CellSequence sample_of_cells(const CellGraph& graph, MeshSource& mesh, std::uint32_t count) {
  const Cells& cells = graph.cells();
  std::vector<bool> picked(cells.size(), cells.size() <= count);
  if (cells.size() > count) {
    grow_region(graph, 0, count / 2, picked);
    grow_region(graph, cells.size() / 2, count / 2, picked);
    if (!cells.all_hexahedra()) add_others(mesh, count, picked);
  }
  CellSequence list;
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell)
    if (picked[cell]) list.push_back(cell);
  return list;
}

SampleMesh::SampleMesh(MeshSource& mesh, const CellSequence& picked) : info_(mesh.info()) {
  const MeshInfo whole = mesh.info();
  choose_steps(whole);
  std::vector<bool> picked_cells(whole.cells(), false);
  for (const std::uint32_t cell : picked) picked_cells[cell] = true;
  const std::vector<bool> picked_vertices = take_cells(mesh, picked_cells);
  if (picked.size() < whole.cells() || info_.vertices < whole.vertices) info_.extras.clear();
  points_ = take(picked_vertices, 3 * scalar_bytes(info_.schema.coordinate_type),
                 [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                   mesh.read_points(first, count, out);
                 });
  arrays_.resize(info_.schema.arrays.size());
  // Picked elements by covered blocks.
  std::map<std::vector<std::uint32_t>, std::vector<bool>> picked_elements;
  for (std::size_t a = 0; a < arrays_.size(); ++a) {
    const ArrayInfo& array = whole.schema.arrays[a];
    if (array.location == Location::point) {
      take_array(mesh, a, picked_vertices);
    } else if (!is_on_mesh(array.location)) {
      take_array(mesh, a, std::vector<bool>(array.elements, true));
    } else if (array.blocks.empty()) {
      take_array(mesh, a, picked_cells);
    } else {
      const auto [elements, fresh] = picked_elements.try_emplace(array.blocks);
      std::uint64_t cell = 0;
      if (fresh)
        for (CellCursor cursor(mesh); cursor.next(); ++cell)
          if (whole.schema.array_covers(a, cursor.block()))
            elements->second.push_back(picked_cells[cell]);
      take_array(mesh, a, elements->second);
    }
  }
  mesh.rewind_cells();
}

// The elements of the whole mesh that belong to the sample. `vertices` contains their vertex
// numbers in ascending order. For each run of consecutive cells, before[b] is the number of cells
// of block b before the run, and inside[b] is the number of cells of block b in the run. The
// element indices of cell arrays are computed from these counts.
struct SampleMesh::Elements {
  struct Run {
    std::vector<std::uint64_t> before, inside;  // number of cells of each block
  };
  std::vector<std::uint64_t> vertices;
  std::vector<Run> runs;
};

SampleMesh::SampleMesh(MeshSource& mesh, const std::vector<CellRun>& runs) : info_(mesh.info()) {
  const MeshInfo whole = mesh.info();
  choose_steps(whole);
  info_.extras.clear();
  const Elements elements = take_runs(mesh, runs);
  points_ = take(elements.vertices, 3 * scalar_bytes(info_.schema.coordinate_type),
                 [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                   mesh.read_points(first, count, out);
                 });
  arrays_.resize(info_.schema.arrays.size());
  for (std::size_t a = 0; a < arrays_.size(); ++a) {
    const std::size_t stride = info_.array_stride(a);
    const bool per_step = info_.schema.arrays[a].per_step;
    for (const std::uint64_t step : per_step ? steps_ : std::vector<std::uint64_t>{0}) {
      const auto read = [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
        mesh.read_array(a, step, first, count, out);
      };
      if (info_.schema.arrays[a].location == Location::point) {
        arrays_[a].push_back(take(elements.vertices, stride, read));
        continue;
      }
      std::vector<std::byte> values;
      if (const ArrayInfo& array = info_.schema.arrays[a]; !is_on_mesh(array.location)) {
        values.resize(array.elements * stride);
        read(0, array.elements, values.data());
        arrays_[a].push_back(std::move(values));
        continue;
      }
      for (const Elements::Run& run : elements.runs) {
        std::uint64_t first = 0, count = 0;
        for (std::uint32_t b = 0; b < run.before.size(); ++b) {
          if (!info_.schema.array_covers(a, b)) continue;
          first += run.before[b];
          count += run.inside[b];
        }
        const std::size_t place = values.size();
        values.resize(place + count * stride);
        if (count > 0) read(first, count, values.data() + place);
      }
      arrays_[a].push_back(std::move(values));
    }
  }
}

SampleMesh::Elements SampleMesh::take_runs(MeshSource& mesh, const std::vector<CellRun>& runs) {
  const std::uint64_t all_vertices = info_.vertices;
  const std::size_t blocks = info_.block_cells.size();
  Elements elements;
  std::vector<std::uint64_t> before(blocks), corners, corner_begin = {0};
  std::vector<std::uint32_t> cell_blocks;
  info_.block_cells.assign(blocks, 0);
  std::uint64_t number = 0;
  CellBatch batch;
  auto run = runs.begin();
  for (mesh.rewind_cells(); run != runs.end() && mesh.next_cells(batch, kCellsAtOnce);)
    for (std::size_t i = 0; i < batch.size() && run != runs.end(); ++i, ++number) {
      const std::uint32_t block = batch.blocks[i];
      if (number == run->first)
        elements.runs.push_back({before, std::vector<std::uint64_t>(blocks)});
      ++before[block];
      if (number < run->first) continue;
      for (const std::uint64_t v : batch.cell(i)) {
        require_vertex(number, v, all_vertices);
        corners.push_back(v);
      }
      corner_begin.push_back(corners.size());
      cell_blocks.push_back(block);
      ++elements.runs.back().inside[block];
      ++info_.block_cells[block];
      if (number + 1 == run->first + run->count) ++run;
    }
  mesh.rewind_cells();

  elements.vertices = take_corners(corners, corner_begin, cell_blocks);
  return elements;
}

// Adds cells to the sample and renumbers their vertices. Returns the original numbers of these
// vertices in ascending order.
std::vector<std::uint64_t> SampleMesh::take_corners(const std::vector<std::uint64_t>& corners,
                                                    const std::vector<std::uint64_t>& corner_begin,
                                                    const std::vector<std::uint32_t>& cell_blocks) {
  std::vector<std::uint64_t> used = corners;
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  info_.vertices = used.size();
  cells_ = CellTable(info_);
  std::vector<std::uint32_t> local;
  for (std::size_t cell = 0; cell < cell_blocks.size(); ++cell) {
    local.clear();
    for (const std::uint64_t v : std::span(corners).subspan(
             corner_begin[cell], corner_begin[cell + 1] - corner_begin[cell]))
      local.push_back(
          static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin()));
    cells_.append(cell_blocks[cell], local);
  }
  return used;
}

void SampleMesh::choose_steps(const MeshInfo& whole) {
  if (const std::uint64_t steps = whole.step_times.size(); steps > 0)
    for (const std::uint64_t step : {std::uint64_t{0}, steps / 2, steps - 1})
      if (steps_.empty() || step > steps_.back()) steps_.push_back(step);
  info_.step_times.resize(steps_.size());
}

// Adds the picked cells to the sample. Returns, for each vertex of the whole mesh, whether a picked
// cell uses it.
std::vector<bool> SampleMesh::take_cells(MeshSource& mesh, const std::vector<bool>& picked) {
  const std::uint64_t all_vertices = info_.vertices;
  std::vector<std::uint64_t> corners, corner_begin = {0};
  std::vector<std::uint32_t> cell_blocks;
  info_.block_cells.assign(info_.block_cells.size(), 0);
  std::uint64_t number = 0;
  for (CellCursor cursor(mesh); cursor.next(); ++number) {
    if (number >= picked.size() || !picked[number]) continue;
    for (const std::uint64_t v : cursor.corners()) {
      require_vertex(number, v, all_vertices);
      corners.push_back(v);
    }
    corner_begin.push_back(corners.size());
    cell_blocks.push_back(cursor.block());
    ++info_.block_cells[cursor.block()];
  }
  std::vector<bool> picked_vertices(all_vertices, false);
  for (const std::uint64_t v : take_corners(corners, corner_begin, cell_blocks))
    picked_vertices[v] = true;
  return picked_vertices;
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

double bytes_of_all_steps(const SizeReport& sizes, const MeshInfo& sample, std::size_t steps) {
  auto total = static_cast<double>(sizes.total_bytes);
  const std::size_t coded = sample.step_times.size();
  for (std::size_t a = 0; a < sample.schema.arrays.size() && steps > coded; ++a) {
    if (!sample.schema.arrays[a].per_step) continue;
    const auto bytes = sizes.streams.find(array_stream_name(sample.schema, a));
    if (bytes != sizes.streams.end())
      total += static_cast<double>(steps - coded) / static_cast<double>(coded) *
               static_cast<double>(bytes->second);
  }
  return total;
}

}  // namespace shm::converters
