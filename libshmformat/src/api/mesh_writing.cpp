// add_mesh(), write_mesh() and write_file(): a whole mesh to a Writer and to a file.
#include <cstring>
#include <string>
#include <utility>

#include "api/mesh_parts.h"
#include "bytes/errors.h"
#include "model/schema.h"
#include "shm/mesh.h"
#include "shm/recorded_order.h"

namespace shm {
namespace {

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
  Result<void> add_vertex(std::size_t v) { return added_[v] ? Result<void>() : add_new_vertex(v); }
  Result<void> add_new_vertex(std::size_t v);
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

Result<void> MeshFeed::add_new_vertex(std::size_t v) {
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
  corners_.resize(static_cast<std::size_t>(nodes));
  std::uint64_t last_use = 0;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    corners_[i] = mesh_->corners[next_corner_++];
    const auto corner = static_cast<std::size_t>(corners_[i]);
    if (!added_[corner])
      if (auto good = add_new_vertex(corner); !good) return good;
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

}  // namespace

Result<void> add_mesh(Writer& writer, const Schema& schema, const MeshArrays& mesh) {
  return MeshFeed(writer, schema, mesh).run();
}

Result<SizeReport> write_mesh(ByteSink& sink, const Mesh& mesh, const WriteOptions& options) {
  RecordedOrder order;
  PassedOrder passed(order, options.coding_order);
  WriteOptions own = options;
  // Numbers that are kept need no order, but where steps are gathered by it.
  const bool is_used = mesh.schema.order != Order::keep || has_steps(mesh.schema);
  if (is_used) own.coding_order = &passed;
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

Result<SizeReport> write_file(const std::string& path, const Mesh& mesh,
                              const WriteOptions& options, FileSink::Existing existing) {
  auto sink = FileSink::create(path, FileSink::Temporary::unnamed, existing);
  if (!sink) return sink.error();
  return of_file(write_mesh(**sink, mesh, options), path);
}

}  // namespace shm
