#include "array_mesh.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "bench_mesh.h"
#include "shm/reader.h"

namespace shm::bench {
namespace {

void find_last_uses(ArrayMesh& mesh) {
  std::vector<bool> used(mesh.vertices);
  mesh.last_use.assign(mesh.cells(), 0);
  for (std::size_t c = mesh.cells(); c-- > 0;) {
    const auto corners = mesh.cell(c);
    for (std::size_t i = 0; i < corners.size() && i < 64; ++i)
      if (!used[corners[i]]) {
        mesh.last_use[c] |= std::uint64_t{1} << i;
        used[corners[i]] = true;
      }
    for (const std::uint64_t v : corners) used[v] = true;
  }
}

void find_births(ArrayMesh& mesh) {
  std::vector<bool> used(mesh.vertices);
  for (std::size_t c = 0; c < mesh.cells(); ++c) {
    for (const std::uint64_t v : mesh.cell(c))
      if (!used[v]) {
        used[v] = true;
        mesh.births.push_back(v);
      }
    mesh.births_end.push_back(mesh.births.size());
  }
}

/// Passes a mesh to a Writer. Each vertex is passed just before the first cell that uses it.
class Feeder {
 public:
  Feeder(const ArrayMesh& mesh, std::span<const MeshArray* const> arrays, Writer& writer)
      : mesh_(&mesh), writer_(&writer) {
    for (const MeshArray* array : arrays) {
      if (array->info.per_step) continue;
      (array->info.location == Location::point ? point_ : cell_).push_back({array, 0});
    }
  }

  void feed() {
    std::size_t born = 0;
    for (std::size_t c = 0; c < mesh_->cells(); ++c) {
      for (; born < mesh_->births_end[c]; ++born)
        add_vertex(mesh_->births[born], &Writer::add_vertex);
      add_cell(c);
    }
    if (mesh_->births.size() == mesh_->vertices) return;
    std::vector<bool> used(mesh_->vertices);
    for (const std::uint64_t v : mesh_->births) used[v] = true;
    for (std::uint64_t v = 0; v < mesh_->vertices; ++v)
      if (!used[v]) add_vertex(v, &Writer::add_unused_vertex);
  }

 private:
  struct Column {
    const MeshArray* array;
    std::size_t next;  // index of the next element to be written; used only for cell arrays
  };

  static std::span<const std::byte> element(const MeshArray& array, std::size_t index) {
    return std::span(array.steps[0]).subspan(index * array.stride(), array.stride());
  }
  void append(std::span<const std::byte> values) {
    data_.insert(data_.end(), values.begin(), values.end());
  }

  template <class Add>
  void add_vertex(std::uint64_t v, Add add) {
    data_.clear();
    for (const Column& column : point_) append(element(*column.array, v));
    const std::size_t bytes = 3 * scalar_bytes(mesh_->coordinate_type);
    unwrap((writer_->*add)(v, std::span(mesh_->xyz).subspan(v * bytes, bytes), data_));
  }
  void add_cell(std::size_t c) {
    const std::uint32_t block = mesh_->cell_blocks[c];
    data_.clear();
    for (Column& column : cell_) {
      const auto& covered = column.array->info.blocks;
      if (covered.empty() || std::binary_search(covered.begin(), covered.end(), block))
        append(element(*column.array, column.next++));
    }
    unwrap(writer_->add_cell(block, mesh_->cell(c), mesh_->last_use[c], data_));
  }

  const ArrayMesh* mesh_;
  Writer* writer_;
  std::vector<Column> point_, cell_;
  std::vector<std::byte> data_;
};

/// Records the order in which vertices are coded. Cells are coded in the order of the mesh.
class VertexOrder final : public CodingOrder {
 public:
  void vertex(std::uint64_t number) override { vertices.push_back(number); }
  void cell(std::uint64_t) override {}
  std::vector<std::uint64_t> vertices;
};

/// Returns the values of an array in coding order. The values of point arrays are reordered into
/// `room`; those of cell arrays already are in coding order.
std::span<const std::byte> in_order(const ArrayInfo& info, const std::vector<std::byte>& values,
                                    const VertexOrder& order, std::vector<std::byte>& room) {
  if (info.location != Location::point) return values;
  const std::size_t stride = scalar_bytes(info.type) * info.components;
  room.resize(values.size());
  for (std::size_t i = 0; i < order.vertices.size(); ++i)
    std::memcpy(room.data() + i * stride, values.data() + order.vertices[i] * stride, stride);
  return room;
}

void set_step_numbers(std::size_t steps, Writer& writer) {
  std::vector<double> times(steps);
  for (std::size_t s = 0; s < steps; ++s) times[s] = static_cast<double>(s);
  unwrap(writer.set_step_times(times));
}

void write_steps(std::span<const MeshArray* const> arrays, const VertexOrder& order,
                 Writer& writer) {
  std::size_t steps = 0;
  std::vector<std::byte> coded;
  for (std::uint32_t a = 0; a < arrays.size(); ++a) {
    const MeshArray& array = *arrays[a];
    if (!array.info.per_step) continue;
    steps = std::max(steps, array.steps.size());
    for (std::size_t s = 0; s < array.steps.size(); ++s) {
      const std::vector<std::byte>& values = array.steps[s];
      unwrap(writer.add_step_values(a, s, in_order(array.info, values, order, coded)));
    }
  }
  if (steps > 0) set_step_numbers(steps, writer);
}

bool has_steps(std::span<const MeshArray* const> arrays) {
  return std::any_of(arrays.begin(), arrays.end(),
                     [](const MeshArray* array) { return array->info.per_step; });
}

}  // namespace

ArrayMesh load_arrays(const std::string& path) {
  converters::Spool spool(std::filesystem::temp_directory_path().string(), std::size_t{1} << 30);
  const auto source = converters::open_mesh(path, spool);
  const converters::MeshInfo& info = source->info();
  ArrayMesh mesh;
  mesh.coordinate_type = info.schema.coordinate_type;
  mesh.vertices = info.vertices;
  mesh.blocks = info.schema.blocks;
  mesh.xyz.resize(mesh.vertices * 3 * scalar_bytes(mesh.coordinate_type));
  source->read_points(0, mesh.vertices, mesh.xyz.data());
  converters::CellBatch batch;
  while (source->next_cells(batch, 65536))
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto corners = batch.cell(i);
      mesh.cell_blocks.push_back(batch.blocks[i]);
      mesh.corners.insert(mesh.corners.end(), corners.begin(), corners.end());
      mesh.corner_begin.push_back(mesh.corners.size());
    }
  find_last_uses(mesh);
  find_births(mesh);
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    MeshArray array{info.schema.arrays[a], {}};
    array.info.quantization = {};
    const std::uint64_t elements = info.array_elements(a);
    array.steps.resize(array.info.per_step ? info.step_times.size() : 1);
    for (std::size_t s = 0; s < array.steps.size(); ++s) {
      array.steps[s].resize(elements * array.stride());
      source->read_array(a, s, 0, elements, array.steps[s].data());
    }
    mesh.arrays.push_back(std::move(array));
  }
  return mesh;
}

ReadBack::ReadBack(const ArrayMesh& mesh, std::span<const MeshArray* const> wanted) {
  xyz.resize(mesh.xyz.size());
  corners.resize(mesh.corners.size());
  for (const MeshArray* array : wanted) {
    auto& steps = arrays.emplace_back(array->steps.size());
    for (auto& values : steps) values.resize(array->steps[0].size());
  }
}

SizeReport write(const ArrayMesh& mesh, std::span<const MeshArray* const> arrays, ByteSink& sink,
                 Level level) {
  Schema schema;
  schema.coordinate_type = mesh.coordinate_type;
  schema.coordinate_quantization = mesh.coordinate_quantization;
  schema.blocks = mesh.blocks;
  for (const MeshArray* array : arrays) schema.arrays.push_back(array->info);
  VertexOrder order;
  WriteOptions options;
  options.level = level;
  if (has_steps(arrays)) options.coding_order = &order;
  Writer writer = unwrap(Writer::create(sink, std::move(schema), options));
  Feeder(mesh, arrays, writer).feed();
  unwrap(writer.end_mesh());
  write_steps(arrays, order, writer);
  return unwrap(writer.finish());
}

SizeReport write_series(
    const ArrayMesh& mesh, std::span<const ArrayInfo> arrays, std::uint64_t steps,
    const std::function<std::vector<std::byte>(std::size_t, std::uint64_t)>& values, ByteSink& sink,
    WriteOptions options) {
  Schema schema;
  schema.coordinate_type = mesh.coordinate_type;
  schema.coordinate_quantization = mesh.coordinate_quantization;
  schema.blocks = mesh.blocks;
  schema.arrays.assign(arrays.begin(), arrays.end());
  VertexOrder order;
  options.coding_order = &order;
  Writer writer = unwrap(Writer::create(sink, std::move(schema), options));
  Feeder(mesh, {}, writer).feed();
  unwrap(writer.end_mesh());
  std::vector<std::byte> coded;
  for (std::uint64_t s = 0; s < steps; ++s)
    for (std::uint32_t a = 0; a < arrays.size(); ++a)
      unwrap(writer.add_step_values(a, s, in_order(arrays[a], values(a, s), order, coded)));
  set_step_numbers(steps, writer);
  return unwrap(writer.finish());
}

/// Scatters `values`: copies value i to out[numbers[i]]. Each value has `bytes` bytes. If kBytes is
/// not 0, it equals `bytes`, so that the compiler can copy a value with one instruction.
template <std::size_t kBytes>
void scatter_known(const std::byte* values, std::size_t bytes,
                   std::span<const std::uint64_t> numbers, std::vector<std::byte>& out) {
  if constexpr (kBytes > 0) bytes = kBytes;
  const std::size_t most = out.size() / bytes;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] >= most) throw std::runtime_error("an unknown vertex was decoded");
    std::memcpy(out.data() + numbers[i] * bytes, values + i * bytes, bytes);
  }
}
void scatter(const std::vector<std::byte>& values, std::size_t bytes,
             std::span<const std::uint64_t> numbers, std::vector<std::byte>& out) {
  switch (bytes) {
    case 4: return scatter_known<4>(values.data(), bytes, numbers, out);
    case 8: return scatter_known<8>(values.data(), bytes, numbers, out);
    case 12: return scatter_known<12>(values.data(), bytes, numbers, out);
    case 24: return scatter_known<24>(values.data(), bytes, numbers, out);
    default: return scatter_known<0>(values.data(), bytes, numbers, out);
  }
}

void read(std::span<const std::byte> file, ReadBack& into) {
  MemorySource source(file);
  Reader reader = unwrap(Reader::open(source));
  const Schema& schema = reader.schema();
  const bool ordered = std::any_of(schema.arrays.begin(), schema.arrays.end(),
                                   [](const ArrayInfo& array) { return array.per_step; });
  const std::size_t xyz_bytes = 3 * scalar_bytes(schema.coordinate_type);
  std::vector<std::uint64_t> vertex_order;
  // for each cell array: bytes decoded so far
  std::vector<std::size_t> written(schema.arrays.size());
  std::size_t corners = 0;
  const auto stride = [&](std::size_t a) {
    return scalar_bytes(schema.arrays[a].type) * schema.arrays[a].components;
  };
  const auto take_mesh = [&](const MeshBlock& block) {
    scatter(block.xyz, xyz_bytes, block.vertex_numbers, into.xyz);
    if (block.corners.size() > into.corners.size() - corners)
      throw std::runtime_error("too many corners were decoded");
    std::copy(block.corners.begin(), block.corners.end(), into.corners.begin() + corners);
    corners += block.corners.size();
    for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
      const std::vector<std::byte>& values = block.arrays[a];
      if (values.empty()) continue;
      if (schema.arrays[a].location == Location::point) {
        scatter(values, stride(a), block.vertex_numbers, into.arrays[a][0]);
      } else {
        std::memcpy(into.arrays[a][0].data() + written[a], values.data(), values.size());
        written[a] += values.size();
      }
    }
    if (ordered)
      vertex_order.insert(vertex_order.end(), block.vertex_numbers.begin(),
                          block.vertex_numbers.end());
  };
  const auto take_step = [&](const StepPiece& piece) {
    std::vector<std::byte>& out = into.arrays[piece.array].at(piece.step);
    const std::size_t bytes = stride(piece.array);
    if (schema.arrays[piece.array].location == Location::point)
      scatter(piece.values, bytes,
              std::span(vertex_order).subspan(piece.first, piece.values.size() / bytes), out);
    else
      std::memcpy(out.data() + piece.first * bytes, piece.values.data(), piece.values.size());
  };
  while (Item* item = unwrap(reader.next())) {
    if (const auto* block = std::get_if<MeshBlock>(item)) take_mesh(*block);
    if (const auto* piece = std::get_if<StepPiece>(item)) take_step(*piece);
  }
}

}  // namespace shm::bench
