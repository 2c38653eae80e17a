#include "tool/shown/boundary.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <utility>

#include "base/failure.h"
#include "mesh/forwarding_mesh.h"
#include "mesh/vertex_compaction.h"

namespace shm::converters {
namespace {

// Returns false if a coordinate is NaN.
bool is_in(const HalfSpace& space, const std::array<double, 3>& place) {
  double along = 0;
  for (std::size_t i = 0; i < 3; ++i) along += space.normal[i] * place[i];
  return along <= space.most;
}

// Coordinates of a mesh, read one vertex at a time.
class VertexPlaces {
 public:
  VertexPlaces(MeshSource& mesh, const Spool& spool)
      : type_(mesh.info().schema.coordinate_type),
        bytes_(3 * scalar_bytes(type_)),
        cache_(mesh.info().vertices, bytes_, spool.memory_budget() / 8,
               [&mesh](std::uint64_t first, std::uint64_t count, std::byte* out) {
                 mesh.read_points(first, count, out);
               }) {}
  // Returns the coordinates of a vertex as bytes, which are valid until the next call.
  std::span<const std::byte> operator[](std::uint64_t vertex) { return {cache_[vertex], bytes_}; }
  std::array<double, 3> place(std::uint64_t vertex) {
    const std::byte* const from = cache_[vertex];
    std::array<double, 3> xyz{};
    for (std::size_t i = 0; i < 3; ++i)
      xyz[i] =
          type_ == ScalarType::float32 ? number_at<float>(from, i) : number_at<double>(from, i);
    return xyz;
  }

 private:
  template <class T>
  static double number_at(const std::byte* from, std::size_t i) {
    T number;
    std::memcpy(&number, from + i * sizeof number, sizeof number);
    return static_cast<double>(number);
  }

  ScalarType type_;
  std::size_t bytes_;
  PageCache cache_;
};

// A mesh that contains only those cells of another mesh (the source) whose centre is in a half
// space. number() returns the numbers that the cells of the most recently read batch have in the
// source.
class KeptCells final : public ForwardingMesh {
 public:
  // Borrows all arguments.
  KeptCells(MeshSource& mesh, const std::optional<HalfSpace>& kept, const Spool& spool)
      : ForwardingMesh(mesh), kept_(kept) {
    info_ = mesh.info();
    if (kept_) places_.emplace(mesh, spool);
  }

  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    if (!kept_) {
      first_ += std::exchange(count_, 0);
      const bool any = source_.next_cells(out, max_cells);
      count_ = out.size();
      return any;
    }
    out.clear();
    numbers_.clear();
    while (out.size() == 0 && source_.next_cells(all_, max_cells)) {
      for (std::size_t i = 0; i < all_.size(); ++i) {
        const auto corners = all_.cell(i);
        if (!is_kept(first_ + i, corners)) continue;
        out.blocks.push_back(all_.blocks[i]);
        out.corners.insert(out.corners.end(), corners.begin(), corners.end());
        out.corner_begin.push_back(out.corners.size());
        numbers_.push_back(first_ + i);
      }
      first_ += all_.size();
    }
    return out.size() > 0;
  }
  void rewind_cells() override {
    source_.rewind_cells();
    first_ = count_ = 0;
  }
  // Returns the number that cell `index` of the most recently read batch has in the source.
  std::uint64_t number(std::size_t index) const { return kept_ ? numbers_[index] : first_ + index; }

 private:
  bool is_kept(std::uint64_t cell, std::span<const std::uint64_t> corners) {
    std::array<double, 3> sum{};
    for (const std::uint64_t corner : corners) {
      require_vertex(cell, corner, info_.vertices);
      const auto place = places_->place(corner);
      for (std::size_t i = 0; i < 3; ++i) sum[i] += place[i];
    }
    for (double& part : sum) part /= static_cast<double>(corners.size());
    return is_in(*kept_, sum);
  }

  const std::optional<HalfSpace>& kept_;
  std::optional<VertexPlaces> places_;
  CellBatch all_;
  std::vector<std::uint64_t> numbers_;
  // If all cells are kept (kept_ is empty), first_ is the number of the first cell of the most
  // recently read batch, and count_ is the number of cells in this batch. Otherwise, first_ is the
  // number of the next cell to be read from the source, and count_ is not used.
  std::uint64_t first_ = 0, count_ = 0;
};

// Passes a mesh to a BoundaryFinder.
class BoundaryFeeder final : public CompactedMesh {
 public:
  BoundaryFeeder(KeptCells& cells, MeshSource& mesh, BoundaryFinder& finder, const Spool& spool)
      : cells_(&cells), finder_(&finder), places_(mesh, spool) {
    block_.corner_begin = {0};
  }

  void begin_batch(const CellBatch&, std::uint64_t) override { flush(); }
  void vertex(std::uint64_t number, std::uint64_t last_cell) override {
    if (last_cell == kNeverUsed) return;
    const auto place = places_[number];
    block_.vertex_numbers.push_back(number);
    block_.xyz.insert(block_.xyz.end(), place.begin(), place.end());
  }
  void cell(const CellBatch& batch, std::size_t index, std::uint64_t last_use,
            std::span<const std::uint64_t> other_last_uses) override {
    const auto corners = batch.cell(index);
    block_.cell_numbers.push_back(cells_->number(index));
    block_.cell_blocks.push_back(batch.blocks[index]);
    block_.corners.insert(block_.corners.end(), corners.begin(), corners.end());
    block_.corner_begin.push_back(block_.corners.size());
    for (const std::uint64_t vertex : other_last_uses)
      block_.other_last_uses.push_back({block_.last_use.size(), vertex});
    block_.last_use.push_back(last_use);
    block_.vertices_before_cell.push_back(block_.vertex_count());
  }
  void flush() {
    if (block_.cell_count() == 0) return;
    unwrap(finder_->add(block_));
    const std::uint64_t first_vertex = block_.first_vertex + block_.vertex_count();
    const std::uint64_t first_cell = block_.first_cell + block_.cell_count();
    block_ = {};
    block_.corner_begin = {0};
    block_.first_vertex = first_vertex;
    block_.first_cell = first_cell;
  }

 private:
  KeptCells* cells_;
  BoundaryFinder* finder_;
  VertexPlaces places_;
  MeshBlock block_;
};

std::vector<std::byte> values_of_vertices(MeshSource& mesh, const BoundaryArray& array,
                                          const std::vector<std::uint64_t>& vertices,
                                          const Spool& spool) {
  const std::size_t stride = mesh.info().array_stride(array.array);
  const std::uint64_t step = mesh.info().schema.arrays[array.array].per_step ? array.step : 0;
  PageCache cache(mesh.info().vertices, stride, spool.memory_budget() / 8,
                  [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                    mesh.read_array(array.array, step, first, count, out);
                  });
  std::vector<std::byte> values;
  values.reserve(vertices.size() * stride);
  for (const std::uint64_t vertex : vertices) {
    const std::byte* const value = cache[vertex];
    values.insert(values.end(), value, value + stride);
  }
  return values;
}

// Returns the value that is used for cells that an array does not cover: NaN for floating-point
// arrays, otherwise 0.
std::vector<std::byte> no_value(const ArrayInfo& array) {
  std::vector<std::byte> value(scalar_bytes(array.type) * array.components);
  const auto fill = [&]<class T>(T number) {
    for (std::size_t c = 0; c < array.components; ++c)
      std::memcpy(value.data() + c * sizeof number, &number, sizeof number);
  };
  if (array.type == ScalarType::float32) fill(std::numeric_limits<float>::quiet_NaN());
  if (array.type == ScalarType::float64) fill(std::numeric_limits<double>::quiet_NaN());
  return value;
}

// Returns the value of each face, which is the value of its cell. `cells` contains the cell of each
// face, in ascending order, so that one pass over the mesh is enough.
std::vector<std::byte> values_of_faces(MeshSource& mesh, const BoundaryArray& array,
                                       const std::vector<std::uint64_t>& cells) {
  const Schema& schema = mesh.info().schema;
  const ArrayInfo& info = schema.arrays[array.array];
  const std::size_t stride = mesh.info().array_stride(array.array);
  const std::uint64_t step = info.per_step ? array.step : 0;
  const std::vector<std::byte> none = no_value(info);
  std::vector<std::byte> values, piece;
  values.reserve(cells.size() * stride);
  CellBatch batch;
  std::uint64_t first_cell = 0, first_value = 0;
  std::size_t face = 0;
  for (mesh.rewind_cells(); face < cells.size() && mesh.next_cells(batch, kCellsAtOnce);
       first_cell += batch.size()) {
    const auto covers = [&](std::uint32_t block) {
      return schema.array_covers(array.array, block);
    };
    const auto covered =
        static_cast<std::uint64_t>(std::count_if(batch.blocks.begin(), batch.blocks.end(), covers));
    piece.resize(static_cast<std::size_t>(covered) * stride);
    if (face < cells.size() && cells[face] < first_cell + batch.size())
      mesh.read_array(array.array, step, first_value, covered, piece.data());
    first_value += covered;
    const std::byte* value = piece.data();
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const bool is_covered = covers(batch.blocks[i]);
      for (; face < cells.size() && cells[face] == first_cell + i; ++face) {
        const std::byte* const from = is_covered ? value : none.data();
        values.insert(values.end(), from, from + stride);
      }
      if (is_covered) value += stride;
    }
  }
  values.resize(cells.size() * stride);
  return values;
}

}  // namespace

BoundarySurface boundary_of_mesh(MeshSource& mesh, const std::vector<BoundaryArray>& arrays,
                                 const std::optional<HalfSpace>& kept, Spool& spool,
                                 const Progress& progress) {
  Schema without_arrays = mesh.info().schema;
  without_arrays.arrays.clear();
  BoundaryOptions options;
  options.subdivide = true;
  BoundaryFinder finder = unwrap(BoundaryFinder::create(without_arrays, options));
  {
    KeptCells cells(mesh, kept, spool);
    BoundaryFeeder feeder(cells, mesh, finder, spool);
    stream_compacted(cells, spool, feeder, progress);
    feeder.flush();
  }
  BoundarySurface surface = unwrap(finder.finish());
  for (const BoundaryArray& array : arrays) {
    const bool of_points = mesh.info().schema.arrays[array.array].location == Location::point;
    surface.arrays.push_back(of_points
                                 ? values_of_vertices(mesh, array, surface.vertex_numbers, spool)
                                 : values_of_faces(mesh, array, surface.cell_numbers));
  }
  return surface;
}

BoundarySurface points_of_mesh(MeshSource& mesh, const std::vector<BoundaryArray>& arrays,
                               const std::optional<HalfSpace>& kept, const Spool& spool) {
  constexpr std::uint64_t kMostPoints = 1 << 20;
  const MeshInfo& info = mesh.info();
  VertexPlaces places(mesh, spool);
  BoundarySurface surface;
  surface.coordinate_type = info.schema.coordinate_type;
  surface.face_begin = {0};
  for (std::uint64_t v = 0; v < info.vertices; v += info.vertices / kMostPoints + 1) {
    if (kept && !is_in(*kept, places.place(v))) continue;
    const auto place = places[v];
    surface.corners.push_back(static_cast<std::uint32_t>(surface.vertex_numbers.size()));
    surface.vertex_numbers.push_back(v);
    surface.xyz.insert(surface.xyz.end(), place.begin(), place.end());
    surface.face_begin.push_back(surface.corners.size());
  }
  surface.cell_numbers.assign(surface.corners.size(), kNoCell);
  surface.blocks.assign(surface.corners.size(), 0);
  surface.sides.assign(surface.corners.size(), 0);
  for (const BoundaryArray& array : arrays) {
    surface.arrays.emplace_back();
    if (info.schema.arrays[array.array].location == Location::point)
      surface.arrays.back() = values_of_vertices(mesh, array, surface.vertex_numbers, spool);
  }
  return surface;
}

}  // namespace shm::converters
