#include "shm/mesh.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "bytes/errors.h"

namespace shm {
namespace {

Error corrupt(std::string detail) {
  return Error{ErrorCode::corrupt, std::move(detail), "mesh", kNoOffset, {}};
}

std::size_t stride_of(const ArrayInfo& info) { return scalar_bytes(info.type) * info.components; }

struct RecordedOrder final : CodingOrder {
  std::vector<std::uint64_t> vertices, cells;
  void vertex(std::uint64_t number) override { vertices.push_back(number); }
  void cell(std::uint64_t number) override { cells.push_back(number); }
};

/// position[number] = index of `number` in `order`; empty when `order` is no permutation.
std::vector<std::uint64_t> inverse(const std::vector<std::uint64_t>& order) {
  constexpr std::uint64_t kUnset = ~std::uint64_t{0};
  std::vector<std::uint64_t> position(order.size(), kUnset);
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (order[i] >= order.size()) return {};
    std::uint64_t& place = position[static_cast<std::size_t>(order[i])];
    if (place != kUnset) return {};
    place = i;
  }
  return position;
}

/// For each covered element of an array in cell order: its cell.
std::vector<std::uint64_t> covered_cells(const Schema& schema, std::size_t array,
                                         const std::vector<std::uint32_t>& cell_blocks) {
  std::vector<std::uint64_t> cells;
  for (std::size_t c = 0; c < cell_blocks.size(); ++c)
    if (schema.array_covers(array, cell_blocks[c])) cells.push_back(c);
  return cells;
}

/// out[i] = in[from[i]], elements of `stride` bytes.
std::vector<std::byte> gather(const std::vector<std::byte>& in,
                              const std::vector<std::uint64_t>& from, std::size_t stride) {
  std::vector<std::byte> out(from.size() * stride);
  for (std::size_t i = 0; i < from.size(); ++i)
    std::memcpy(out.data() + i * stride, in.data() + static_cast<std::size_t>(from[i]) * stride,
                stride);
  return out;
}

template <class T>
void renumber(Extra& extra, const std::vector<std::uint64_t>& position) {
  for (std::size_t at = 0; at + sizeof(T) <= extra.data.size(); at += sizeof(T)) {
    T number{};
    std::memcpy(&number, extra.data.data() + at, sizeof number);
    if (number < 0 || static_cast<std::uint64_t>(number) >= position.size()) continue;
    number = static_cast<T>(position[static_cast<std::size_t>(number)]);
    std::memcpy(extra.data.data() + at, &number, sizeof number);
  }
}

/// Writes one mesh; members are what several steps share.
class MeshWriter {
 public:
  MeshWriter(const Mesh& mesh, Writer& writer, const RecordedOrder& order)
      : mesh_(&mesh), writer_(&writer), order_(&order) {}

  Result<void> write() {
    if (auto good = check(); !good) return good;
    if (auto good = write_cells(); !good) return good;
    if (auto good = writer_->end_mesh(); !good) return good;
    if (auto good = write_steps(); !good) return good;
    if (!mesh_->step_times.empty())
      if (auto good = writer_->set_step_times(mesh_->step_times); !good) return good;
    return write_extras();
  }

 private:
  Result<void> check() const;
  Result<void> write_vertex(std::size_t v);
  Result<void> write_cells();
  std::span<const std::uint64_t> corners_of(std::size_t cell) const {
    const auto begin = static_cast<std::size_t>(mesh_->corner_begin[cell]);
    const auto end = static_cast<std::size_t>(mesh_->corner_begin[cell + 1]);
    return std::span(mesh_->corners).subspan(begin, end - begin);
  }
  Result<void> write_steps();
  Result<void> write_extras();
  /// Elements of an array in coding order, as numbers in the caller's order.
  std::vector<std::uint64_t> coded_elements(std::size_t array) const;

  const Mesh* mesh_;
  Writer* writer_;
  const RecordedOrder* order_;
  std::vector<char> written_;
};

Result<void> MeshWriter::check() const {
  const Schema& schema = mesh_->schema;
  const std::uint64_t cells = mesh_->cell_count();
  if (mesh_->corner_begin.size() != cells + 1 ||
      mesh_->corner_begin.back() != mesh_->corners.size() ||
      !std::is_sorted(mesh_->corner_begin.begin(), mesh_->corner_begin.end()))
    return misuse_error("corner_begin does not fit cells and corners", "mesh");
  for (std::uint64_t v : mesh_->corners)
    if (v >= mesh_->vertex_count())
      return misuse_error("a corner is no vertex: " + std::to_string(v), "mesh");
  for (std::uint32_t b : mesh_->cell_blocks)
    if (b >= schema.blocks.size())
      return misuse_error("a cell of no block: " + std::to_string(b), "mesh");
  if (mesh_->arrays.size() != schema.arrays.size())
    return misuse_error("arrays do not fit the schema", "mesh");
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& info = schema.arrays[a];
    const std::uint64_t elements = info.location == Location::point
                                       ? mesh_->vertex_count()
                                       : covered_cells(schema, a, mesh_->cell_blocks).size();
    const std::uint64_t bytes = elements * stride_of(info);
    const auto fits = [&](const std::vector<std::byte>& values) { return values.size() == bytes; };
    const bool stepped = info.per_step && a < mesh_->steps.size();
    if (info.per_step ? stepped && !std::all_of(mesh_->steps[a].begin(), mesh_->steps[a].end(),
                                                [&](const auto& v) { return v.empty() || fits(v); })
                      : !fits(mesh_->arrays[a]))
      return misuse_error(
          "array '" + info.name + "' does not hold " + std::to_string(bytes) + " bytes", "mesh");
  }
  return {};
}

Result<void> MeshWriter::write_vertex(std::size_t v) {
  if (std::exchange(written_[v], 1) != 0) return {};
  std::vector<std::byte> data;
  for (std::size_t a = 0; a < mesh_->schema.arrays.size(); ++a) {
    const ArrayInfo& info = mesh_->schema.arrays[a];
    if (info.location != Location::point || info.per_step) continue;
    const std::byte* from = mesh_->arrays[a].data() + v * stride_of(info);
    data.insert(data.end(), from, from + stride_of(info));
  }
  const std::size_t bytes = 3 * scalar_bytes(mesh_->schema.coordinate_type);
  return writer_->add_vertex(v, std::span(mesh_->xyz).subspan(v * bytes, bytes), data);
}

Result<void> MeshWriter::write_cells() {
  const Schema& schema = mesh_->schema;
  const auto cells = static_cast<std::size_t>(mesh_->cell_count());
  const auto vertices = static_cast<std::size_t>(mesh_->vertex_count());
  std::vector<std::size_t> last(vertices, cells);
  for (std::size_t c = 0; c < cells; ++c)
    for (const std::uint64_t corner : corners_of(c)) last[static_cast<std::size_t>(corner)] = c;
  written_.assign(vertices, 0);
  std::vector<std::size_t> next_element(schema.arrays.size());
  for (std::size_t c = 0; c < cells; ++c) {
    const auto corners = corners_of(c);
    std::uint64_t last_use = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto corner = static_cast<std::size_t>(corners[i]);
      if (auto good = write_vertex(corner); !good) return good;
      if (i < 64 && last[corner] == c) last_use |= std::uint64_t{1} << i;
    }
    std::vector<std::byte> data;
    for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
      const ArrayInfo& info = schema.arrays[a];
      if (info.location != Location::cell || info.per_step ||
          !schema.array_covers(a, mesh_->cell_blocks[c]))
        continue;
      const std::byte* from = mesh_->arrays[a].data() + next_element[a]++ * stride_of(info);
      data.insert(data.end(), from, from + stride_of(info));
    }
    if (auto good = writer_->add_cell(mesh_->cell_blocks[c], corners, last_use, data); !good)
      return good;
  }
  for (std::size_t v = 0; v < vertices; ++v)
    if (auto good = write_vertex(v); !good) return good;  // unused ones
  return {};
}

std::vector<std::uint64_t> MeshWriter::coded_elements(std::size_t array) const {
  if (mesh_->schema.arrays[array].location == Location::point) return order_->vertices;
  const auto cells = covered_cells(mesh_->schema, array, mesh_->cell_blocks);
  std::vector<std::uint64_t> element(mesh_->cell_blocks.size(), ~std::uint64_t{0});
  for (std::size_t e = 0; e < cells.size(); ++e) element[static_cast<std::size_t>(cells[e])] = e;
  std::vector<std::uint64_t> coded;
  for (std::uint64_t c : order_->cells) {
    const std::uint64_t e = element[static_cast<std::size_t>(c)];
    if (e != ~std::uint64_t{0}) coded.push_back(e);
  }
  return coded;
}

Result<void> MeshWriter::write_steps() {
  for (std::uint32_t a = 0; a < mesh_->steps.size() && a < mesh_->schema.arrays.size(); ++a) {
    if (!mesh_->schema.arrays[a].per_step) continue;
    const auto from = coded_elements(a);
    for (std::size_t s = 0; s < mesh_->steps[a].size(); ++s) {
      if (mesh_->steps[a][s].empty()) continue;
      const auto values = gather(mesh_->steps[a][s], from, stride_of(mesh_->schema.arrays[a]));
      if (auto good = writer_->add_step_values(a, s, values); !good) return good;
    }
  }
  return {};
}

Result<void> MeshWriter::write_extras() {
  const bool moved = mesh_->schema.order != Order::keep;
  const auto vertices = moved ? inverse(order_->vertices) : std::vector<std::uint64_t>();
  const auto cells = moved ? inverse(order_->cells) : std::vector<std::uint64_t>();
  for (Extra extra : mesh_->extras) {
    if (moved && extra.refers != Reference::nothing) {
      const auto& position = extra.refers == Reference::vertex ? vertices : cells;
      if (extra.type == ScalarType::int32)
        renumber<std::int32_t>(extra, position);
      else
        renumber<std::int64_t>(extra, position);
    }
    if (auto good = writer_->add_extra(extra); !good) return good;
  }
  return {};
}

/// Joins the items of a file, in coding order.
class MeshCollector {
 public:
  explicit MeshCollector(const Schema& schema) {
    mesh_.schema = schema;
    mesh_.arrays.resize(schema.arrays.size());
    mesh_.steps.resize(schema.arrays.size());
  }

  void take(Item& item) {
    if (auto* block = std::get_if<MeshBlock>(&item)) take(*block);
    if (auto* piece = std::get_if<StepPiece>(&item)) take(*piece);
    if (auto* times = std::get_if<StepTimes>(&item)) mesh_.step_times = std::move(times->times);
    if (auto* extra = std::get_if<Extra>(&item)) mesh_.extras.push_back(std::move(*extra));
  }
  /// Back from coding order to the numbers that vertices and cells carry.
  Result<Mesh> finish();

 private:
  void take(const MeshBlock& block) {
    const auto add = [](auto& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    const std::uint64_t base = mesh_.corners.size();
    add(vertex_numbers_, block.vertex_numbers);
    add(cell_numbers_, block.cell_numbers);
    add(mesh_.xyz, block.xyz);
    add(mesh_.cell_blocks, block.cell_blocks);
    add(mesh_.corners, block.corners);
    for (std::size_t i = 1; i < block.corner_begin.size(); ++i)
      mesh_.corner_begin.push_back(base + block.corner_begin[i]);
    for (std::size_t a = 0; a < block.arrays.size(); ++a) add(mesh_.arrays[a], block.arrays[a]);
  }
  void take(const StepPiece& piece) {
    auto& steps = mesh_.steps[piece.array];
    if (steps.size() <= piece.step) steps.resize(static_cast<std::size_t>(piece.step) + 1);
    auto& values = steps[static_cast<std::size_t>(piece.step)];
    values.insert(values.end(), piece.values.begin(), piece.values.end());
  }
  void reorder_values(const std::vector<std::uint64_t>& vertex_at,
                      const std::vector<std::uint64_t>& cell_at,
                      const std::vector<std::uint32_t>& coded_blocks);

  Mesh mesh_;
  std::vector<std::uint64_t> vertex_numbers_, cell_numbers_;
};

void MeshCollector::reorder_values(const std::vector<std::uint64_t>& vertex_at,
                                   const std::vector<std::uint64_t>& cell_at,
                                   const std::vector<std::uint32_t>& coded_blocks) {
  for (std::size_t a = 0; a < mesh_.arrays.size(); ++a) {
    const ArrayInfo& info = mesh_.schema.arrays[a];
    std::vector<std::uint64_t> from = vertex_at;
    if (info.location == Location::cell) {
      std::vector<std::uint64_t> element(coded_blocks.size());
      std::uint64_t count = 0;
      for (std::size_t c = 0; c < coded_blocks.size(); ++c)
        if (mesh_.schema.array_covers(a, coded_blocks[c])) element[c] = count++;
      from.clear();
      for (std::size_t c = 0; c < cell_at.size(); ++c)
        if (mesh_.schema.array_covers(a, mesh_.cell_blocks[c]))
          from.push_back(element[static_cast<std::size_t>(cell_at[c])]);
    }
    if (!info.per_step) mesh_.arrays[a] = gather(mesh_.arrays[a], from, stride_of(info));
    for (auto& values : mesh_.steps[a])
      if (!values.empty()) values = gather(values, from, stride_of(info));
  }
}

Result<Mesh> MeshCollector::finish() {
  const auto vertex_at = inverse(vertex_numbers_);
  const auto cell_at = inverse(cell_numbers_);
  if (vertex_at.size() != vertex_numbers_.size())
    return corrupt("vertex numbers are not 0 to " + std::to_string(vertex_numbers_.size()));
  if (cell_at.size() != cell_numbers_.size())
    return corrupt("cell numbers are not 0 to " + std::to_string(cell_numbers_.size()));
  mesh_.xyz = gather(mesh_.xyz, vertex_at, 3 * scalar_bytes(mesh_.schema.coordinate_type));
  const auto coded_blocks = std::exchange(mesh_.cell_blocks, {});
  const auto coded_begin = std::exchange(mesh_.corner_begin, {0});
  const auto coded_corners = std::exchange(mesh_.corners, {});
  for (std::uint64_t coded : cell_at) {
    const auto at = static_cast<std::size_t>(coded);
    mesh_.cell_blocks.push_back(coded_blocks[at]);
    for (std::uint64_t i = coded_begin[at]; i < coded_begin[at + 1]; ++i)
      mesh_.corners.push_back(coded_corners[static_cast<std::size_t>(i)]);
    mesh_.corner_begin.push_back(mesh_.corners.size());
  }
  reorder_values(vertex_at, cell_at, coded_blocks);
  return std::move(mesh_);
}

}  // namespace

Result<SizeReport> write_mesh(ByteSink& sink, const Mesh& mesh) {
  RecordedOrder order;
  WriteOptions options;
  options.coding_order = &order;
  auto writer = Writer::create(sink, mesh.schema, options);
  if (!writer) return writer.error();
  if (auto good = MeshWriter(mesh, *writer, order).write(); !good) return good.error();
  return writer->finish();
}

Result<Mesh> read_mesh(ByteSource& source, const ReadLimits& limits) {
  auto reader = Reader::open(source, limits);
  if (!reader) return reader.error();
  MeshCollector collector(reader->schema());
  while (true) {
    auto item = reader->next();
    if (!item) return item.error();
    if (*item == nullptr) return collector.finish();
    collector.take(**item);
  }
}

}  // namespace shm
