// Writer: passes the mesh to the mesh encoder. Passes step values, extras, and the groups that the
// mesh encoder returns to the FileWriter.
#include "shm/writer.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/file_writer.h"
#include "api/kept_steps.h"
#include "api/mesh_feed.h"
#include "base/binary.h"
#include "base/errors.h"
#include "format/schema.h"
#include "pipeline/mesh_encoder.h"

namespace shm {

class __attribute__((visibility("hidden"))) Writer::Impl {
 public:
  Impl(ByteSink& sink, Schema schema, const WriteOptions& options)
      : schema_(std::move(schema)),
        file_(sink, schema_, options.digest),
        mesh_(schema_, options, [this](const EncodedGroup& group) { return write_group(group); }),
        key_steps_(options.key_steps),
        level_(options.level),
        waiting_bytes_(options.waiting_bytes),
        slow_step_values_(options.slow_step_values),
        kept_steps_(kept_steps(options.kept_steps_bytes, options.temporary_folder)) {
    if (has_steps(schema_))
      topology_.emplace(schema_, ~std::uint64_t{0}, needs_of_steps(schema_, options.digest),
                        to_size(options.kept_topology_bytes));
  }

  Result<void> start() { return file_.start(); }

  Calls& calls() { return calls_; }
  /// Runs `work` if no error has occurred and the mesh has not ended.
  template <class Work>
  Result<void> in_mesh(Work&& work) {
    return calls_.run([&]() -> Result<void> {
      return mesh_ended_ ? misuse("end_mesh has already been called", "mesh") : work();
    });
  }
  /// Runs `work` if no error has occurred and the mesh has ended.
  template <class Work>
  Result<void> after_mesh(Work&& work) {
    return calls_.run([&]() -> Result<void> {
      return mesh_ended_ ? work() : misuse("call end_mesh before steps", "steps");
    });
  }

  MeshEncoder& mesh() { return mesh_; }
  Result<void> add_vertices(std::span<const std::uint64_t> numbers, std::span<const std::byte> xyz,
                            std::span<const std::byte> data) {
    const std::size_t xyz_bytes = 3 * scalar_bytes(schema_.coordinate_type);
    const std::size_t data_bytes = point_data_bytes(schema_);
    if (xyz.size() / xyz_bytes != numbers.size() || xyz.size() % xyz_bytes != 0 ||
        data.size() != numbers.size() * data_bytes)
      return misuse("xyz or data do not match the number of vertices", "mesh");
    for (std::size_t v = 0; v < numbers.size(); ++v)
      if (auto status = mesh_.add_vertex(numbers[v], xyz.subspan(v * xyz_bytes, xyz_bytes),
                                         data.subspan(v * data_bytes, data_bytes));
          !status)
        return status;
    return {};
  }
  Result<void> add_cells(std::uint32_t block, std::size_t cells,
                         std::span<const std::uint64_t> corners,
                         std::span<const std::uint64_t> last_uses,
                         std::span<const std::byte> data) {
    if (block >= schema_.blocks.size())
      return misuse("the cells belong to an unknown block", "mesh");
    const std::size_t data_bytes = cell_data_bytes(schema_)[block];
    const std::size_t nodes = cells == 0 ? 0 : corners.size() / cells;
    if (cells * nodes != corners.size() || data.size() != cells * data_bytes ||
        (!last_uses.empty() && last_uses.size() != cells))
      return misuse("corners, last_uses and data have inconsistent sizes", "mesh");
    for (std::size_t c = 0; c < cells; ++c)
      if (auto status = mesh_.add_cell(block, corners.subspan(c * nodes, nodes),
                                       last_uses.empty() ? 0 : last_uses[c],
                                       data.subspan(c * data_bytes, data_bytes), {});
          !status)
        return status;
    return {};
  }
  Result<void> add_mesh(const MeshArrays& mesh) {
    if (!mesh_.is_new())
      return misuse("add_mesh cannot be called after vertices or cells were added", "mesh");
    return feed_mesh(mesh_, schema_, mesh);
  }
  Result<void> end_mesh() {
    mesh_ended_ = true;
    return mesh_.end();
  }

  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values) {
    if (auto status = file_.check_step_values(array, values); !status) return status;
    if (!is_on_mesh(schema_.arrays[array].location) && topology_->groups() == 0)
      return misuse("array '" + schema_.arrays[array].name +
                        "' needs a mesh with at least one vertex or cell",
                    "steps");
    if (!file_.has_step_encoder()) {
      std::vector<std::uint64_t> elements(schema_.arrays.size());
      for (std::uint32_t a = 0; a < elements.size(); ++a)
        elements[a] = elements_of(schema_, mesh_.totals(), a);
      file_.begin_steps(*topology_, std::move(elements), key_steps_, kept_steps_, level_)
          .use_slow_codec(slow_step_values_);
      if (waiting_bytes_ > 0) file_.use_bundles(waiting_bytes_);
    }
    return file_.add_step_values(array, step, values);
  }
  Result<void> set_step_times(std::span<const double> times) { return file_.set_step_times(times); }
  Result<void> add_extra(const Extra& extra) {
    if (auto status = FileWriter::check(extra); !status) return status;
    // Write all complete groups first: the extra's position among the groups must depend only on
    // earlier calls, not on the speed of threads.
    if (!mesh_ended_)
      if (auto status = mesh_.catch_up(); !status) return status;
    return file_.add_extra(extra);
  }
  Result<void> commit() { return file_.commit(mesh_.totals()); }
  Result<SizeReport> finish() {
    return calls_.finish([&]() -> Result<SizeReport> {
      if (!mesh_ended_)
        if (auto status = end_mesh(); !status) return status.error();
      return file_.finish(mesh_.totals());
    });
  }

 private:
  Result<void> write_group(const EncodedGroup& group) {
    if (topology_) add_group(group, *topology_);
    return file_.write_group(group);
  }

  Schema schema_;
  FileWriter file_;
  MeshEncoder mesh_;
  bool mesh_ended_ = false;
  Calls calls_;

  std::uint32_t key_steps_;
  Level level_;
  std::uint64_t waiting_bytes_, slow_step_values_;
  KeptSteps kept_steps_;
  // Topology for step values; set only if the schema has stepped arrays.
  std::optional<StepTopology> topology_;
};

Writer::Writer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Writer::Writer(Writer&&) noexcept = default;
Writer& Writer::operator=(Writer&&) noexcept = default;
Writer::~Writer() = default;

Result<Writer> Writer::create(ByteSink& sink, Schema schema, const WriteOptions& options) {
  auto checked = schema_of_file(std::move(schema), options);
  if (!checked) return checked.error();
  auto impl = std::make_unique<Impl>(sink, std::move(*checked), options);
  if (auto status = impl->start(); !status) return status.error();
  return Writer(std::move(impl));
}

Result<void> Writer::add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                std::span<const std::byte> data) {
  return impl_->in_mesh([&] { return impl_->mesh().add_vertex(number, xyz, data); });
}
Result<void> Writer::add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                       std::span<const std::byte> data) {
  return impl_->in_mesh([&] { return impl_->mesh().add_unused_vertex(number, xyz, data); });
}
Result<void> Writer::add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                              std::uint64_t last_use, std::span<const std::byte> data,
                              std::span<const std::uint64_t> other_last_uses) {
  return impl_->in_mesh(
      [&] { return impl_->mesh().add_cell(block, corners, last_use, data, other_last_uses); });
}
Result<void> Writer::add_vertices(std::span<const std::uint64_t> numbers,
                                  std::span<const std::byte> xyz, std::span<const std::byte> data) {
  return impl_->in_mesh([&] { return impl_->add_vertices(numbers, xyz, data); });
}
Result<void> Writer::add_cells(std::uint32_t block, std::size_t cells,
                               std::span<const std::uint64_t> corners,
                               std::span<const std::uint64_t> last_uses,
                               std::span<const std::byte> data) {
  return impl_->in_mesh([&] { return impl_->add_cells(block, cells, corners, last_uses, data); });
}
Result<void> Writer::add_mesh(const MeshArrays& mesh) {
  return impl_->in_mesh([&] { return impl_->add_mesh(mesh); });
}
Result<void> Writer::end_mesh() {
  return impl_->in_mesh([&] { return impl_->end_mesh(); });
}
Result<void> Writer::add_step_values(std::uint32_t array, std::uint64_t step,
                                     std::span<const std::byte> values) {
  return impl_->after_mesh([&] { return impl_->add_step_values(array, step, values); });
}
Result<void> Writer::set_step_times(std::span<const double> times) {
  return impl_->after_mesh([&] { return impl_->set_step_times(times); });
}
Result<void> Writer::add_extra(const Extra& extra) {
  return impl_->calls().run([&] { return impl_->add_extra(extra); });
}
Result<void> Writer::commit() {
  return impl_->after_mesh([&] { return impl_->commit(); });
}
Result<SizeReport> Writer::finish() { return impl_->finish(); }

}  // namespace shm
