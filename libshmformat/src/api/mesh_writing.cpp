// write_mesh() and write_file(): write a whole mesh to a file.
#include <cstring>
#include <string>
#include <utility>

#include "api/mesh_parts.h"
#include "base/errors.h"
#include "format/schema.h"
#include "shm/mesh.h"
#include "shm/recorded_order.h"

namespace shm {
namespace {

/// Returns a list `out` with out[i] = in[from[i]]. An element has `stride` bytes.
std::vector<std::byte> gather(const std::vector<std::byte>& in,
                              const std::vector<std::uint64_t>& from, std::size_t stride) {
  std::vector<std::byte> out(from.size() * stride);
  for (std::size_t i = 0; i < from.size(); ++i)
    std::memcpy(out.data() + i * stride, in.data() + static_cast<std::size_t>(from[i]) * stride,
                stride);
  return out;
}

/// Records the coding order, and passes it on to the caller's CodingOrder if there is one.
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

/// Writes the data that comes after the vertices and cells of a mesh: step values, times and
/// extras.
class MeshRemainder {
 public:
  MeshRemainder(Writer& writer, const Mesh& mesh, const RecordedOrder& order)
      : writer_(&writer), mesh_(&mesh), order_(&order) {}

  Result<void> check() const;
  Result<void> write() {
    if (auto status = write_steps(); !status) return status;
    if (!mesh_->step_times.empty())
      if (auto status = writer_->set_step_times(mesh_->step_times); !status) return status;
    return write_extras();
  }

 private:
  Result<void> write_steps();
  Result<void> write_extras();

  Writer* writer_;
  const Mesh* mesh_;
  const RecordedOrder* order_;
};

/// Checks the sizes of all step values.
Result<void> MeshRemainder::check() const {
  for (std::size_t a = 0; a < mesh_->steps.size() && a < mesh_->schema.arrays.size(); ++a) {
    const ArrayInfo& info = mesh_->schema.arrays[a];
    if (!info.per_step) continue;
    std::uint64_t elements =
        info.location == Location::point ? mesh_->vertex_count() : info.elements;
    for (const std::uint32_t b : mesh_->cell_blocks)
      if (info.location == Location::cell && mesh_->schema.array_covers(a, b)) ++elements;
    const std::uint64_t bytes = elements * stride_of(info);
    for (const auto& values : mesh_->steps[a])
      if (!values.empty() && values.size() != bytes)
        return misuse("array '" + info.name + "' does not have " + std::to_string(bytes) + " bytes",
                      "mesh");
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
      if (auto status = writer_->add_step_values(a, s, values); !status) return status;
    }
  }
  return {};
}

Result<void> MeshRemainder::write_extras() {
  for (Extra extra : mesh_->extras) {
    if (mesh_->schema.order != Order::keep)
      if (auto status = order_->renumber(extra); !status) return status;
    if (auto status = writer_->add_extra(extra); !status) return status;
  }
  return {};
}

}  // namespace

Result<SizeReport> write_mesh(ByteSink& sink, const Mesh& mesh, const WriteOptions& options) {
  RecordedOrder order;
  PassedOrder passed(order, options.coding_order);
  WriteOptions own = options;
  // The coding order is needed to sort step values. Unless the order is Order::keep, it is also
  // needed to renumber references.
  const bool is_used = mesh.schema.order != Order::keep || has_steps(mesh.schema);
  if (is_used) own.coding_order = &passed;
  auto writer = Writer::create(sink, mesh.schema, own);
  if (!writer) return writer.error();
  MeshRemainder remainder(*writer, mesh, order);
  if (auto status = remainder.check(); !status) return status.error();
  MeshArrays arrays;
  arrays.xyz = mesh.xyz;
  arrays.cells = mesh.cell_count();
  arrays.cell_blocks = mesh.cell_blocks;
  arrays.corner_begin = NumberSpan(mesh.corner_begin);
  arrays.corners = NumberSpan(mesh.corners);
  arrays.arrays.assign(mesh.arrays.begin(), mesh.arrays.end());
  if (auto status = writer->add_mesh(arrays); !status) return status.error();
  if (auto status = writer->end_mesh(); !status) return status.error();
  if (auto status = remainder.write(); !status) return status.error();
  return writer->finish();
}

Result<SizeReport> write_file(const std::string& path, const Mesh& mesh,
                              const WriteOptions& options, FileSink::Existing existing) {
  auto sink = FileSink::create(path, FileSink::Temporary::unnamed, existing);
  if (!sink) return sink.error();
  return of_file(write_mesh(**sink, mesh, options), path);
}

}  // namespace shm
