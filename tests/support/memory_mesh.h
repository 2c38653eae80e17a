// MemoryMesh: a MeshSource that stores its mesh in memory, and functions that return such meshes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

template <class T>
std::vector<std::byte> bytes_of(const std::vector<T>& values) {
  std::vector<std::byte> bytes(values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

class MemoryMesh final : public MeshSource {
 public:
  MeshInfo mesh;
  std::vector<std::byte> points;
  std::vector<std::uint32_t> cell_blocks;
  std::vector<std::vector<std::uint64_t>> cells;
  // Values of all arrays, by array and step. A static array has only step 0.
  std::vector<std::vector<std::vector<std::byte>>> arrays;

  const MeshInfo& info() const override { return mesh; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    const std::size_t stride = 3 * scalar_bytes(mesh.schema.coordinate_type);
    std::memcpy(out, points.data() + first * stride, count * stride);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    out.clear();
    for (; out.size() < std::min(max_cells, most_at_once) && next_ < cells.size(); ++next_) {
      out.blocks.push_back(cell_blocks[next_]);
      out.corners.insert(out.corners.end(), cells[next_].begin(), cells[next_].end());
      out.corner_begin.push_back(out.corners.size());
    }
    return out.size() > 0;
  }
  void rewind_cells() override { next_ = 0; }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    const std::size_t stride = mesh.array_stride(array);
    if (count > 0) std::memcpy(out, arrays[array][step].data() + first * stride, count * stride);
  }

  // Largest number of cells in a batch, even if the caller requests more cells.
  std::size_t most_at_once = 1000;

  std::uint32_t add_block(CellShape shape, std::uint32_t nodes, std::int64_t id = 1) {
    mesh.schema.blocks.push_back({id, "block " + std::to_string(id), shape, nodes});
    mesh.block_cells.push_back(0);
    return static_cast<std::uint32_t>(mesh.schema.blocks.size() - 1);
  }
  void add_point(double x, double y, double z) {
    const double xyz[3] = {x, y, z};
    const auto* raw = reinterpret_cast<const std::byte*>(xyz);
    points.insert(points.end(), raw, raw + sizeof xyz);
    ++mesh.vertices;
  }
  void add_cell(std::uint32_t block, std::vector<std::uint64_t> corners) {
    cell_blocks.push_back(block);
    cells.push_back(std::move(corners));
    ++mesh.block_cells[block];
  }
  template <class T>
  void add_array(ArrayInfo info, const std::vector<std::vector<T>>& steps) {
    mesh.schema.arrays.push_back(std::move(info));
    arrays.emplace_back();
    for (const auto& values : steps) arrays.back().push_back(bytes_of(values));
  }
  template <class T>
  void add_extra(std::string key, ScalarType type, Reference refers, const std::vector<T>& values) {
    mesh.extras.push_back({std::move(key), type, refers, {values.size()}, bytes_of(values)});
  }

 private:
  std::size_t next_ = 0;
};

// Returns a copy of a mesh with all of its contents.
inline MemoryMesh copy_of(MeshSource& from) {
  MemoryMesh copy;
  copy.mesh = from.info();
  const MeshInfo& info = copy.mesh;
  copy.points.resize(info.vertices * 3 * scalar_bytes(info.schema.coordinate_type));
  from.read_points(0, info.vertices, copy.points.data());
  from.rewind_cells();
  for (CellBatch batch; from.next_cells(batch, 1000);)
    for (std::size_t i = 0; i < batch.size(); ++i) {
      copy.cell_blocks.push_back(batch.blocks[i]);
      copy.cells.emplace_back(batch.cell(i).begin(), batch.cell(i).end());
    }
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    auto& steps = copy.arrays.emplace_back();
    const std::size_t count = info.schema.arrays[a].per_step ? info.step_times.size() : 1;
    for (std::uint64_t step = 0; step < count; ++step) {
      steps.emplace_back(info.array_elements(a) * info.array_stride(a));
      from.read_array(a, step, 0, info.array_elements(a), steps.back().data());
    }
  }
  return copy;
}

// Returns a grid of nx x ny x nz hexahedra in scanline order.
inline MemoryMesh grid_mesh(std::uint64_t nx, std::uint64_t ny, std::uint64_t nz) {
  MemoryMesh mesh;
  mesh.mesh.schema.source_format = "test";
  const std::uint32_t block = mesh.add_block(CellShape::hexahedron, 8);
  for (std::uint64_t z = 0; z <= nz; ++z)
    for (std::uint64_t y = 0; y <= ny; ++y)
      for (std::uint64_t x = 0; x <= nx; ++x)
        mesh.add_point(static_cast<double>(x) * 0.1,
                       static_cast<double>(y) * 0.1 + 0.01 * static_cast<double>(x),
                       static_cast<double>(z) * 0.3);
  const auto at = [&](std::uint64_t x, std::uint64_t y, std::uint64_t z) {
    return (z * (ny + 1) + y) * (nx + 1) + x;
  };
  for (std::uint64_t z = 0; z < nz; ++z)
    for (std::uint64_t y = 0; y < ny; ++y)
      for (std::uint64_t x = 0; x < nx; ++x)
        mesh.add_cell(block, {at(x, y, z), at(x + 1, y, z), at(x + 1, y + 1, z), at(x, y + 1, z),
                              at(x, y, z + 1), at(x + 1, y, z + 1), at(x + 1, y + 1, z + 1),
                              at(x, y + 1, z + 1)});
  return mesh;
}

// Returns a grid whose slabs along z belong alternately to two blocks.
inline MemoryMesh slabs_mesh() {
  MemoryMesh mesh = grid_mesh(6, 5, 8);
  mesh.add_block(CellShape::hexahedron, 8, 2);
  mesh.mesh.block_cells.assign(2, 0);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    mesh.cell_blocks[c] = c / 60 % 2;
    ++mesh.mesh.block_cells[mesh.cell_blocks[c]];
  }
  return mesh;
}

// Renumbers the vertices at random. On request, also puts the cells into random order.
inline void shuffle_mesh(MemoryMesh& mesh, unsigned seed, bool cells_too = false) {
  std::mt19937 random(seed);
  std::vector<std::uint64_t> fresh(mesh.mesh.vertices);
  std::iota(fresh.begin(), fresh.end(), 0);
  std::shuffle(fresh.begin(), fresh.end(), random);
  std::vector<std::byte> moved(mesh.points.size());
  for (std::uint64_t v = 0; v < fresh.size(); ++v)
    std::memcpy(moved.data() + fresh[v] * 24, mesh.points.data() + v * 24, 24);
  mesh.points = moved;
  for (auto& cell : mesh.cells)
    for (auto& v : cell) v = fresh[v];
  if (!cells_too) return;
  std::vector<std::size_t> order(mesh.cells.size());
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), random);
  auto cells = mesh.cells;
  auto blocks = mesh.cell_blocks;
  for (std::size_t i = 0; i < order.size(); ++i) {
    mesh.cells[i] = cells[order[i]];
    mesh.cell_blocks[i] = blocks[order[i]];
  }
}

// Returns a grid that uses every feature: cells of a second block between those of the first block,
// unused vertices, repeated corners, static and stepped arrays on points, on cells and on one
// block, special floating-point values, and sets.
inline MemoryMesh rich_mesh() {
  MemoryMesh mesh = grid_mesh(7, 6, 5);
  const std::uint32_t wedges = mesh.add_block(CellShape::wedge, 6, 7);
  const std::uint32_t polygons = mesh.add_block(CellShape::polygon, 0, 9);
  mesh.add_point(1e300, -0.0, 5e-324);
  mesh.add_point(9, 9, 9);
  std::vector<std::vector<std::uint64_t>> cells = mesh.cells;
  mesh.cells.clear();
  mesh.cell_blocks.clear();
  mesh.mesh.block_cells.assign(3, 0);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    mesh.add_cell(0, cells[i]);
    if (i % 10 == 3) {
      const auto& c = cells[i];
      mesh.add_cell(wedges, {c[0], c[1], c[2], c[4], c[5], c[6]});
    }
    if (i % 50 == 7) {
      std::vector<std::uint64_t> corners;
      for (std::uint64_t k = 0; k < 3 + i; ++k) corners.push_back(k % 90);
      mesh.add_cell(polygons, corners);
    }
    if (i % 40 == 20) {  // adds cells with repeated corners, some of which no other cell uses
      const auto& c = cells[i];
      const std::uint64_t p = mesh.mesh.vertices, q = p + 1;
      mesh.add_point(1.5, 2.5, static_cast<double>(i));
      mesh.add_point(2.5, 2.5, static_cast<double>(i));
      mesh.add_cell(0, {c[0], c[0], c[1], c[1], p, p, q, q});
      mesh.add_cell(wedges, {q, q, p, c[4], c[4], c[4]});
      mesh.add_cell(0, {q, c[0], q, c[0], q, c[0], q, c[0]});
    }
  }
  mesh.add_cell(0, {1, 1, 2, 2, 3, 3, 4, 4});
  shuffle_mesh(mesh, 5);

  const std::uint64_t vertices = mesh.mesh.vertices, all_cells = mesh.cells.size();
  mesh.mesh.step_times = {0.0, 0.25, 0.5};
  std::vector<std::int64_t> tags(vertices);
  std::iota(tags.begin(), tags.end(), 100);
  mesh.add_array<std::int64_t>(
      {"tag", Location::point, ScalarType::int64, 1, false, {}, "test:tag", {}}, {tags});
  std::vector<float> normals(vertices * 3);
  for (std::size_t i = 0; i < normals.size(); ++i) normals[i] = static_cast<float>(i % 97) / 97.0f;
  normals[4] = -0.0f;
  const std::uint32_t odd_nan = 0x7fc12345;
  std::memcpy(&normals[7], &odd_nan, 4);
  mesh.add_array<float>({"normal", Location::point, ScalarType::float32, 3, false, {}, "", {}},
                        {normals});
  std::vector<std::vector<double>> heat(3, std::vector<double>(vertices));
  for (std::size_t s = 0; s < 3; ++s)
    for (std::uint64_t v = 0; v < vertices; ++v)
      heat[s][v] = static_cast<double>(v) * 0.5 + static_cast<double>(s);
  mesh.add_array<double>({"heat", Location::point, ScalarType::float64, 1, true, {}, "", {}}, heat);
  std::vector<std::uint8_t> marks(all_cells);
  for (std::size_t c = 0; c < marks.size(); ++c) marks[c] = static_cast<std::uint8_t>(c % 251);
  mesh.add_array<std::uint8_t>({"mark", Location::cell, ScalarType::uint8, 1, false, {}, "", {}},
                               {marks});
  const std::uint64_t some = mesh.mesh.block_cells[0] + mesh.mesh.block_cells[2];
  std::vector<std::int16_t> levels(some * 2);
  for (std::size_t i = 0; i < levels.size(); ++i) levels[i] = static_cast<std::int16_t>(3 * i);
  mesh.add_array<std::int16_t>(
      {"level", Location::cell, ScalarType::int16, 2, false, {0, 2}, "", {}}, {levels});
  std::vector<std::vector<float>> stress(3, std::vector<float>(mesh.mesh.block_cells[1]));
  for (std::size_t s = 0; s < 3; ++s)
    for (std::size_t i = 0; i < stress[s].size(); ++i)
      stress[s][i] = static_cast<float>(i + 1) / static_cast<float>(s + 1);
  mesh.add_array<float>({"stress", Location::cell, ScalarType::float32, 1, true, {1}, "", {}},
                        stress);

  mesh.add_extra<std::int32_t>("test/node_set/0/vertices", ScalarType::int32, Reference::vertex,
                               {5, 0, 77, -1, static_cast<std::int32_t>(vertices) - 1});
  mesh.add_extra<std::int64_t>("test/picked/cells", ScalarType::int64, Reference::cell,
                               {8, 3, 100});
  mesh.add_extra<std::uint8_t>("test/title", ScalarType::uint8, Reference::nothing, {'h', 'i'});
  return mesh;
}

}  // namespace shm::converters
