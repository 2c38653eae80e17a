#include "shm/mesh.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "api/positions.h"
#include "bytes/errors.h"
#include "shm/recorded_order.h"

namespace shm {
namespace {

Error corrupt(std::string detail) {
  return Error{ErrorCode::corrupt, std::move(detail), "mesh", kNoOffset, {}};
}

std::size_t stride_of(const ArrayInfo& info) { return scalar_bytes(info.type) * info.components; }

/// out[i] = in[from[i]], elements of `stride` bytes.
std::vector<std::byte> gather(const std::vector<std::byte>& in,
                              const std::vector<std::uint64_t>& from, std::size_t stride) {
  std::vector<std::byte> out(from.size() * stride);
  for (std::size_t i = 0; i < from.size(); ++i)
    std::memcpy(out.data() + i * stride, in.data() + static_cast<std::size_t>(from[i]) * stride,
                stride);
  return out;
}

/// The cells of a mesh and its vertices, each before the first cell that uses it.
class MeshFeed {
 public:
  MeshFeed(Writer& writer, const Schema& schema, const MeshArrays& mesh)
      : writer_(&writer),
        schema_(&schema),
        mesh_(&mesh),
        xyz_bytes_(3 * scalar_bytes(schema.coordinate_type)),
        vertices_(xyz_bytes_ == 0 ? 0 : mesh.xyz.size() / xyz_bytes_) {}

  Result<void> run() {
    if (auto good = check_cells(); !good) return good;
    if (auto good = check_arrays(); !good) return good;
    return add_cells();
  }

 private:
  std::uint32_t block_of(std::size_t cell) const {
    return mesh_->cell_blocks.empty() ? 0 : mesh_->cell_blocks[cell];
  }
  Result<void> check_cells();
  Result<void> check_arrays() const;
  Result<void> add_vertex(std::size_t v);
  Result<void> add_cell(std::size_t cell);
  Result<void> add_cells();

  Writer* writer_;
  const Schema* schema_;
  const MeshArrays* mesh_;
  std::size_t xyz_bytes_, vertices_;
  std::vector<std::uint64_t> block_cells_;
  std::vector<std::size_t> last_;  // cell that uses each vertex
  std::vector<bool> added_;
  std::vector<std::size_t> next_element_;  // of each array of cells
  std::size_t next_corner_ = 0;
  std::vector<std::uint64_t> corners_;  // of the cell at hand
  std::vector<std::byte> data_;
};

/// Also notes which cell uses each vertex last.
Result<void> MeshFeed::check_cells() {
  const auto cells = static_cast<std::size_t>(mesh_->cells);
  const NumberSpan& begin = mesh_->corner_begin;
  if (xyz_bytes_ == 0 || mesh_->xyz.size() != vertices_ * xyz_bytes_)
    return misuse_error("coordinates are not three for each vertex", "mesh");
  if (!mesh_->cell_blocks.empty() && mesh_->cell_blocks.size() != cells)
    return misuse_error("cell_blocks do not fit the cells", "mesh");
  if (!begin.empty() &&
      (begin.size() != cells + 1 || begin[0] != 0 || begin[cells] != mesh_->corners.size()))
    return misuse_error("corner_begin does not fit cells and corners", "mesh");
  block_cells_.assign(schema_->blocks.size(), 0);
  last_.assign(vertices_, cells);
  std::size_t corner = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    const std::uint32_t block = block_of(c);
    if (block >= schema_->blocks.size())
      return misuse_error("a cell of no block: " + std::to_string(block), "mesh");
    ++block_cells_[block];
    std::uint64_t nodes = schema_->blocks[block].nodes_per_cell;
    if (begin.empty() && nodes == 0)
      return misuse_error("corner_begin is missing: cells have any number of corners", "mesh");
    if (!begin.empty() && begin[c] > begin[c + 1])
      return misuse_error("corner_begin does not fit cells and corners", "mesh");
    if (!begin.empty()) nodes = begin[c + 1] - begin[c];
    if (nodes > mesh_->corners.size() - corner) return misuse_error("corners are missing", "mesh");
    for (const std::size_t end = corner + static_cast<std::size_t>(nodes); corner < end; ++corner) {
      const std::uint64_t v = mesh_->corners[corner];
      if (v >= vertices_)
        return misuse_error("a corner is no vertex: " + std::to_string(v), "mesh");
      last_[static_cast<std::size_t>(v)] = c;
    }
  }
  return corner == mesh_->corners.size() ? Result<void>()
                                         : misuse_error("corners of no cell", "mesh");
}

Result<void> MeshFeed::check_arrays() const {
  if (mesh_->arrays.size() != schema_->arrays.size())
    return misuse_error("arrays do not fit the schema", "mesh");
  for (std::size_t a = 0; a < schema_->arrays.size(); ++a) {
    const ArrayInfo& info = schema_->arrays[a];
    if (info.per_step) continue;
    std::uint64_t elements = info.location == Location::point ? vertices_ : 0;
    for (std::uint32_t b = 0; b < block_cells_.size() && info.location == Location::cell; ++b)
      if (schema_->array_covers(a, b)) elements += block_cells_[b];
    const std::uint64_t bytes = elements * stride_of(info);
    if (mesh_->arrays[a].size() != bytes)
      return misuse_error(
          "array '" + info.name + "' does not hold " + std::to_string(bytes) + " bytes", "mesh");
  }
  return {};
}

Result<void> MeshFeed::add_vertex(std::size_t v) {
  if (added_[v]) return {};
  added_[v] = true;
  data_.clear();
  for (std::size_t a = 0; a < schema_->arrays.size(); ++a) {
    const ArrayInfo& info = schema_->arrays[a];
    if (info.location != Location::point || info.per_step) continue;
    const std::byte* from = mesh_->arrays[a].data() + v * stride_of(info);
    data_.insert(data_.end(), from, from + stride_of(info));
  }
  return writer_->add_vertex(v, mesh_->xyz.subspan(v * xyz_bytes_, xyz_bytes_), data_);
}

Result<void> MeshFeed::add_cell(std::size_t cell) {
  const std::uint32_t block = block_of(cell);
  const std::uint64_t nodes = mesh_->corner_begin.empty()
                                  ? schema_->blocks[block].nodes_per_cell
                                  : mesh_->corner_begin[cell + 1] - mesh_->corner_begin[cell];
  corners_.clear();
  std::uint64_t last_use = 0;
  for (std::uint64_t i = 0; i < nodes; ++i) {
    corners_.push_back(mesh_->corners[next_corner_++]);
    const auto corner = static_cast<std::size_t>(corners_.back());
    if (auto good = add_vertex(corner); !good) return good;
    if (i < 64 && last_[corner] == cell) last_use |= std::uint64_t{1} << i;
  }
  data_.clear();
  for (std::size_t a = 0; a < schema_->arrays.size(); ++a) {
    const ArrayInfo& info = schema_->arrays[a];
    if (info.location != Location::cell || info.per_step || !schema_->array_covers(a, block))
      continue;
    const std::byte* from = mesh_->arrays[a].data() + next_element_[a]++ * stride_of(info);
    data_.insert(data_.end(), from, from + stride_of(info));
  }
  return writer_->add_cell(block, corners_, last_use, data_);
}

Result<void> MeshFeed::add_cells() {
  added_.assign(vertices_, false);
  next_element_.assign(schema_->arrays.size(), 0);
  for (std::size_t c = 0; c < static_cast<std::size_t>(mesh_->cells); ++c)
    if (auto good = add_cell(c); !good) return good;
  for (std::size_t v = 0; v < vertices_; ++v)
    if (auto good = add_vertex(v); !good) return good;  // unused ones
  return {};
}

/// Recorded, and passed on to who else wants to hear it.
class PassedOrder final : public CodingOrder {
 public:
  PassedOrder(RecordedOrder& record, CodingOrder* other) : record_(&record), other_(other) {}
  void vertex(std::uint64_t number) override {
    record_->vertex(number);
    if (other_ != nullptr) other_->vertex(number);
  }
  void cell(std::uint64_t number) override {
    record_->cell(number);
    if (other_ != nullptr) other_->cell(number);
  }

 private:
  RecordedOrder* record_;
  CodingOrder* other_;
};

/// What a Writer takes behind the mesh.
class MeshRemainder {
 public:
  MeshRemainder(Writer& writer, const Mesh& mesh, const RecordedOrder& order)
      : writer_(&writer), mesh_(&mesh), order_(&order) {}

  Result<void> check() const;
  Result<void> write() {
    if (auto good = write_steps(); !good) return good;
    if (!mesh_->step_times.empty())
      if (auto good = writer_->set_step_times(mesh_->step_times); !good) return good;
    return write_extras();
  }

 private:
  Result<void> write_steps();
  Result<void> write_extras();

  Writer* writer_;
  const Mesh* mesh_;
  const RecordedOrder* order_;
};

/// Whether step values have the sizes that they must have.
Result<void> MeshRemainder::check() const {
  for (std::size_t a = 0; a < mesh_->steps.size() && a < mesh_->schema.arrays.size(); ++a) {
    const ArrayInfo& info = mesh_->schema.arrays[a];
    if (!info.per_step) continue;
    std::uint64_t elements = info.location == Location::point ? mesh_->vertex_count() : 0;
    for (const std::uint32_t b : mesh_->cell_blocks)
      if (info.location == Location::cell && mesh_->schema.array_covers(a, b)) ++elements;
    const std::uint64_t bytes = elements * stride_of(info);
    for (const auto& values : mesh_->steps[a])
      if (!values.empty() && values.size() != bytes)
        return misuse_error(
            "array '" + info.name + "' does not hold " + std::to_string(bytes) + " bytes", "mesh");
  }
  return {};
}

Result<void> MeshRemainder::write_steps() {
  for (std::uint32_t a = 0; a < mesh_->steps.size() && a < mesh_->schema.arrays.size(); ++a) {
    if (!mesh_->schema.arrays[a].per_step) continue;
    const auto from = order_->elements(mesh_->schema, a, mesh_->cell_blocks);
    if (!from) return from.error();
    for (std::size_t s = 0; s < mesh_->steps[a].size(); ++s) {
      if (mesh_->steps[a][s].empty()) continue;
      const auto values = gather(mesh_->steps[a][s], *from, stride_of(mesh_->schema.arrays[a]));
      if (auto good = writer_->add_step_values(a, s, values); !good) return good;
    }
  }
  return {};
}

Result<void> MeshRemainder::write_extras() {
  for (Extra extra : mesh_->extras) {
    if (mesh_->schema.order != Order::keep)
      if (auto good = order_->renumber(extra); !good) return good;
    if (auto good = writer_->add_extra(extra); !good) return good;
  }
  return {};
}

/// The numbers of vertices or cells as they come. Nothing is kept while they come in order.
class ComingNumbers {
 public:
  void add(const std::vector<std::uint64_t>& numbers) {
    for (const std::uint64_t number : numbers) {
      if (in_order_ && number == count_) {
        ++count_;
        continue;
      }
      if (in_order_) {
        in_order_ = false;
        numbers_.resize(static_cast<std::size_t>(count_));
        std::iota(numbers_.begin(), numbers_.end(), std::uint64_t{0});
      }
      numbers_.push_back(number);
    }
  }
  bool in_order() const { return in_order_; }
  /// Where each number stands; they are given up for that. Fails unless they are 0, 1 and so on.
  /// Must hold: not in_order().
  Result<std::vector<std::uint64_t>> positions(const char* kind) {
    const std::vector<std::uint64_t> numbers = std::exchange(numbers_, {});
    auto positions = positions_in(numbers);
    if (!positions.empty()) return positions;
    return corrupt(std::string(kind) + " numbers are not 0 to " + std::to_string(numbers.size()));
  }

 private:
  bool in_order_ = true;
  std::uint64_t count_ = 0;  // while they are in order
  std::vector<std::uint64_t> numbers_;
};

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
  /// Back from coding order to the numbers that vertices and cells carry. One array at a time is
  /// there twice.
  Result<Mesh> finish();

 private:
  void take(const MeshBlock& block) {
    const auto add = [](auto& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    const std::uint64_t base = mesh_.corners.size();
    vertices_.add(block.vertex_numbers);
    cells_.add(block.cell_numbers);
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
  Result<void> reorder_vertices();
  Result<void> reorder_cells();
  /// Element i of an array becomes what element from[i] is.
  void reorder(std::size_t array, const std::vector<std::uint64_t>& from);

  Mesh mesh_;
  ComingNumbers vertices_, cells_;
};

void MeshCollector::reorder(std::size_t array, const std::vector<std::uint64_t>& from) {
  const ArrayInfo& info = mesh_.schema.arrays[array];
  if (!info.per_step) mesh_.arrays[array] = gather(mesh_.arrays[array], from, stride_of(info));
  for (auto& values : mesh_.steps[array])
    if (!values.empty()) values = gather(values, from, stride_of(info));
}

Result<void> MeshCollector::reorder_vertices() {
  const auto from = vertices_.positions("vertex");
  if (!from) return from.error();
  mesh_.xyz = gather(mesh_.xyz, *from, 3 * scalar_bytes(mesh_.schema.coordinate_type));
  for (std::size_t a = 0; a < mesh_.arrays.size(); ++a)
    if (mesh_.schema.arrays[a].location == Location::point) reorder(a, *from);
  return {};
}

Result<void> MeshCollector::reorder_cells() {
  const auto from = cells_.positions("cell");
  if (!from) return from.error();
  const auto coded_blocks = std::exchange(mesh_.cell_blocks, {});
  {
    const auto coded_begin = std::exchange(mesh_.corner_begin, {0});
    const auto coded_corners = std::exchange(mesh_.corners, {});
    mesh_.corners.reserve(coded_corners.size());
    for (std::uint64_t coded : *from) {
      const auto at = static_cast<std::size_t>(coded);
      mesh_.cell_blocks.push_back(coded_blocks[at]);
      for (std::uint64_t i = coded_begin[at]; i < coded_begin[at + 1]; ++i)
        mesh_.corners.push_back(coded_corners[static_cast<std::size_t>(i)]);
      mesh_.corner_begin.push_back(mesh_.corners.size());
    }
  }
  std::vector<std::uint64_t> element(coded_blocks.size()), from_element;
  for (std::size_t a = 0; a < mesh_.arrays.size(); ++a) {
    if (mesh_.schema.arrays[a].location != Location::cell) continue;
    std::uint64_t count = 0;
    for (std::size_t c = 0; c < coded_blocks.size(); ++c)
      if (mesh_.schema.array_covers(a, coded_blocks[c])) element[c] = count++;
    from_element.clear();
    for (std::size_t c = 0; c < from->size(); ++c)
      if (mesh_.schema.array_covers(a, mesh_.cell_blocks[c]))
        from_element.push_back(element[static_cast<std::size_t>((*from)[c])]);
    reorder(a, from_element);
  }
  return {};
}

Result<Mesh> MeshCollector::finish() {
  if (!vertices_.in_order())
    if (auto good = reorder_vertices(); !good) return good.error();
  if (!cells_.in_order())
    if (auto good = reorder_cells(); !good) return good.error();
  return std::move(mesh_);
}

}  // namespace

Result<void> add_mesh(Writer& writer, const Schema& schema, const MeshArrays& mesh) {
  return MeshFeed(writer, schema, mesh).run();
}

Result<SizeReport> write_mesh(ByteSink& sink, const Mesh& mesh, const WriteOptions& options) {
  RecordedOrder order;
  PassedOrder passed(order, options.coding_order);
  WriteOptions own = options;
  own.coding_order = &passed;
  auto writer = Writer::create(sink, mesh.schema, own);
  if (!writer) return writer.error();
  MeshRemainder remainder(*writer, mesh, order);
  if (auto good = remainder.check(); !good) return good.error();
  MeshArrays arrays;
  arrays.xyz = mesh.xyz;
  arrays.cells = mesh.cell_count();
  arrays.cell_blocks = mesh.cell_blocks;
  arrays.corner_begin = NumberSpan(mesh.corner_begin);
  arrays.corners = NumberSpan(mesh.corners);
  arrays.arrays.assign(mesh.arrays.begin(), mesh.arrays.end());
  if (auto good = add_mesh(*writer, mesh.schema, arrays); !good) return good.error();
  if (auto good = writer->end_mesh(); !good) return good.error();
  if (auto good = remainder.write(); !good) return good.error();
  return writer->finish();
}

Result<Mesh> read_mesh(ByteSource& source, const ReadLimits& limits, const ReadOptions& options) {
  std::optional<MeshCollector> collector;
  {
    auto reader = Reader::open(source, limits, options);
    if (!reader) return reader.error();
    collector.emplace(reader->schema());
    while (true) {
      auto item = reader->next();
      if (!item) return item.error();
      if (*item == nullptr) break;
      collector->take(**item);
    }
  }
  return collector->finish();
}

}  // namespace shm
