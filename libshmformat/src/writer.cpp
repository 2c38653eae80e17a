// Writer: joins the mesh encoder, step values and extras with the chunk writer.
#include "shm/writer.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coders/shifts.h"
#include "container/chunk_writer.h"
#include "mesh_encoder.h"
#include "packing.h"
#include "schema_codec.h"
#include "step_encoder.h"

namespace shm {
namespace {

using container::ChunkKind;

/// From this many bytes on the schema is said again before the index, for whoever must repair.
constexpr std::uint64_t kRepeatSchemaFrom = std::uint64_t{1} << 20;

Error misuse(std::string detail, std::string section) {
  return Error{ErrorCode::misuse, std::move(detail), std::move(section), kNoOffset, {}};
}

}  // namespace

class Writer::Impl {
 public:
  Impl(ByteSink& sink, Schema schema, const WriteOptions& options)
      : schema_(std::move(schema)),
        chunks_(sink),
        mesh_(schema_, options,
              [this](auto segment, const auto& header, const auto& streams) {
                return write_group(segment, header, streams);
              }),
        key_steps_(options.key_steps),
        level_(options.level),
        topology_(schema_, ~std::uint64_t{0}, wants_of_steps(schema_),
                  options.kept_topology_bytes) {}

  Result<void> start() {
    if (auto good = chunks_.start({}); !good) return good;
    return write_schema();
  }

  /// Runs `work` unless an error came before; the first error sticks.
  template <class Work>
  Result<void> guarded(Work&& work) {
    if (error_) return *error_;
    Result<void> result = work();
    if (!result) error_ = result.error();
    return result;
  }

  Result<void> expect_mesh_open() const {
    if (mesh_ended_) return misuse("the mesh has been ended", "mesh");
    return {};
  }
  Result<void> expect_mesh_ended() const {
    if (!mesh_ended_) return misuse("end_mesh comes first", "steps");
    return {};
  }

  MeshEncoder& mesh() { return mesh_; }
  Result<void> end_mesh() {
    mesh_ended_ = true;
    return mesh_.end();
  }

  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values);
  Result<void> set_step_times(std::span<const double> times);
  Result<void> add_extra(const Extra& extra);
  Result<SizeReport> finish();

 private:
  Result<void> write_schema();
  Result<void> write_group(std::uint32_t segment, const container::GroupHeader& header,
                           const std::vector<std::vector<std::byte>>& streams);
  Result<void> write_step_values(const container::StepHeader& header, std::uint64_t first,
                                 std::span<const std::byte> bytes);
  Result<void> end_step_array() { return step_values_ ? step_values_->end_step() : Result<void>(); }
  Result<void> write_index(SizeReport& report);
  std::uint64_t elements_of(std::uint32_t array) const;
  const std::string& array_key(std::uint32_t array) const { return array_keys_[array]; }

  Schema schema_;
  container::ChunkWriter chunks_;
  MeshEncoder mesh_;
  bool mesh_ended_ = false, times_set_ = false;
  std::optional<Error> error_;
  std::vector<std::string> array_keys_ = array_stream_names(schema_);
  std::map<std::string, std::uint64_t> stream_bytes_;

  std::uint32_t key_steps_;
  Level level_;
  TopologyReplay topology_;
  std::optional<StepEncoder> step_values_;  // from the first ones on
  std::uint64_t step_times_ = 0;
};

Result<void> Writer::Impl::write_schema() {
  ByteWriter blob, payload;
  put(blob, schema_);
  container::put_version(payload, {});
  put_packed(payload, blob.bytes);
  return chunks_.write(ChunkKind::schema, payload.bytes);
}

Result<void> Writer::Impl::write_group(std::uint32_t segment, const container::GroupHeader& header,
                                       const std::vector<std::vector<std::byte>>& streams) {
  ByteWriter payload;
  container::put(payload, header);
  container::IndexEntry entry;
  entry.header_bytes = payload.bytes.size();
  for (std::size_t s = 0; s < streams.size(); ++s) {
    payload.put_bytes(streams[s]);
    const container::StreamEntry& stream = header.streams[s];
    const bool array = stream.kind == container::StreamKind::array;
    stream_bytes_[array ? array_key(stream.array) : container::stream_name(stream.kind)] +=
        streams[s].size();
  }
  topology_.add_group(segment, header,
                      std::vector<std::span<const std::byte>>(streams.begin(), streams.end()));
  entry.segment = segment;
  entry.first_cell = header.first_cell;
  entry.cells = header.cells;
  entry.first_vertex = header.first_vertex;
  entry.vertices = header.vertices;
  entry.box = header.box;
  return chunks_.write(ChunkKind::group, payload.bytes, entry);
}

std::uint64_t Writer::Impl::elements_of(std::uint32_t array) const {
  const auto& totals = mesh_.totals();
  if (schema_.arrays[array].location == Location::point) return totals.vertices;
  std::uint64_t cells = 0;
  for (std::uint32_t b = 0; b < totals.block_cells.size(); ++b)
    if (schema_.array_covers(array, b)) cells += totals.block_cells[b];
  return cells;
}

Result<void> Writer::Impl::add_step_values(std::uint32_t array, std::uint64_t step,
                                           std::span<const std::byte> values) {
  if (array >= schema_.arrays.size() || !schema_.arrays[array].per_step)
    return misuse("array " + std::to_string(array) + " is no stepped array", "steps");
  const ArrayInfo& info = schema_.arrays[array];
  if (values.size() % (scalar_bytes(info.type) * info.components) != 0)
    return misuse("values end within an element", "steps");
  if (!step_values_) {
    std::vector<std::uint64_t> elements(schema_.arrays.size());
    for (std::uint32_t a = 0; a < elements.size(); ++a) elements[a] = elements_of(a);
    step_values_.emplace(schema_, topology_, std::move(elements), key_steps_, level_,
                         [this](const auto& header, auto first, auto bytes) {
                           return write_step_values(header, first, bytes);
                         });
  }
  return step_values_->add(array, step, values);
}

Result<void> Writer::Impl::write_step_values(const container::StepHeader& header,
                                             std::uint64_t first,
                                             std::span<const std::byte> bytes) {
  ByteWriter payload;
  container::put(payload, header);
  payload.put_bytes(bytes);
  stream_bytes_[array_key(header.array)] += bytes.size();
  container::IndexEntry entry;
  entry.array = header.array;
  entry.step = header.step;
  entry.first = first;
  entry.count = header.count;
  entry.group = header.group;
  entry.reference = container::refers_to(header);
  entry.codec = header.codec;
  return chunks_.write(ChunkKind::step_values, payload.bytes, entry);
}

Result<void> Writer::Impl::set_step_times(std::span<const double> times) {
  if (std::exchange(times_set_, true)) return misuse("step times were set before", "steps");
  if (auto good = end_step_array(); !good) return good;
  ByteWriter blob, payload;
  for (double time : times) blob.put_f64(time);
  put_packed(payload, blob.bytes);
  step_times_ = times.size();
  stream_bytes_["extras"] += payload.bytes.size();
  return chunks_.write(ChunkKind::step_times, payload.bytes);
}

Result<void> Writer::Impl::add_extra(const Extra& extra) {
  const std::size_t width = scalar_bytes(extra.type);
  std::uint64_t values = 1;
  bool fits = width != 0;
  for (std::uint64_t side : extra.shape) {
    fits = fits && (side == 0 || values <= ~std::uint64_t{0} / 8 / side);
    values *= side;
  }
  if (extra.refers > Reference::cell)
    return misuse("extra '" + extra.key + "': unknown reference", "extras");
  if (!fits || values * width != extra.data.size())
    return misuse("extra '" + extra.key + "': data does not match type and shape", "extras");
  if (extra.refers != Reference::nothing && extra.type != ScalarType::int32 &&
      extra.type != ScalarType::int64)
    return misuse("extra '" + extra.key + "': references are int32 or int64", "extras");
  if (auto good = end_step_array(); !good) return good;
  if (!mesh_ended_)  // its place among the groups depends on what was added alone
    if (auto good = mesh_.catch_up(); !good) return good;
  ByteWriter blob, payload;
  put(blob, extra);
  put_packed(payload, blob.bytes);
  stream_bytes_["extras"] += payload.bytes.size();
  return chunks_.write(ChunkKind::extra, payload.bytes);
}

Result<SizeReport> Writer::Impl::finish() {
  Result<void> closed = guarded([&]() -> Result<void> {
    if (!mesh_ended_)
      if (auto good = end_mesh(); !good) return good;
    if (auto good = end_step_array(); !good) return good;
    return chunks_.offset() >= kRepeatSchemaFrom ? write_schema() : Result<void>();
  });
  if (!closed) return closed.error();
  SizeReport report;
  closed = guarded([&] { return write_index(report); });
  if (!closed) return closed.error();
  error_ = misuse("the file is finished", "file");  // what every later call says
  return report;
}

Result<void> Writer::Impl::write_index(SizeReport& report) {
  const auto& totals = mesh_.totals();
  container::Index index;
  index.vertices = totals.vertices;
  index.cells = totals.cells;
  index.hexahedra = totals.hexahedra;
  index.max_active_vertices = totals.max_active_vertices;
  index.steps = std::max(step_times_, step_values_ ? step_values_->steps() : 0);
  index.segments = totals.segments;
  index.imported_vertices = totals.imported_vertices;
  index.block_cells = totals.block_cells;
  index.ranges = totals.ranges;
  for (const auto& [name, bytes] : stream_bytes_) index.streams.push_back({name, bytes});
  if (auto good = chunks_.finish(std::move(index)); !good) return good;

  report.vertices = totals.vertices;
  report.cells = totals.cells;
  report.hexahedra = totals.hexahedra;
  report.max_active_vertices = totals.max_active_vertices;
  report.segments = totals.segments;
  report.imported_vertices = totals.imported_vertices;
  report.total_bytes = chunks_.offset();
  report.streams = stream_bytes_;
  std::uint64_t coded = 0;
  for (const auto& [name, bytes] : stream_bytes_) coded += bytes;
  report.streams["container"] = report.total_bytes - coded;
  return {};
}

Writer::Writer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Writer::Writer(Writer&&) noexcept = default;
Writer& Writer::operator=(Writer&&) noexcept = default;
Writer::~Writer() = default;

Result<Writer> Writer::create(ByteSink& sink, Schema schema, const WriteOptions& options) {
  if (auto good = check_schema(schema); !good) return good.error();
  if (options.group_cells < 1 || options.group_cells > container::kMaxGroupCells)
    return misuse("group_cells must be 1 to 2^20", "options");
  const auto is_codec = [](ConnectivityCodec codec) { return codec <= ConnectivityCodec::shifts; };
  const auto& codecs = options.segment_connectivity;
  if (!is_codec(options.connectivity) || !std::all_of(codecs.begin(), codecs.end(), is_codec) ||
      options.level > Level::best)
    return misuse("unknown codec of connectivity, or level", "options");
  const bool shifts =
      options.connectivity == ConnectivityCodec::shifts ||
      std::find(codecs.begin(), codecs.end(), ConnectivityCodec::shifts) != codecs.end();
  if (shifts && !takes_shifts(schema))
    return misuse("shifts are for order keep without delay, cells of 1 to 64 nodes, no steps",
                  "options");
  if (!(options.restart_budget >= 0)) return misuse("restart_budget must be 0 or more", "options");
  if (options.key_steps < 1) return misuse("key_steps must be 1 or more", "options");
  if (!std::is_sorted(options.segment_starts.begin(), options.segment_starts.end()))
    return misuse("segment_starts must ascend", "options");
  auto impl = std::make_unique<Impl>(sink, std::move(schema), options);
  if (auto good = impl->start(); !good) return good.error();
  return Writer(std::move(impl));
}

Result<void> Writer::add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                std::span<const std::byte> data) {
  return impl_->guarded([&]() -> Result<void> {
    if (auto good = impl_->expect_mesh_open(); !good) return good;
    return impl_->mesh().add_vertex(number, xyz, data);
  });
}
Result<void> Writer::add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                       std::span<const std::byte> data) {
  return impl_->guarded([&]() -> Result<void> {
    if (auto good = impl_->expect_mesh_open(); !good) return good;
    return impl_->mesh().add_unused_vertex(number, xyz, data);
  });
}
Result<void> Writer::add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                              std::uint64_t last_use, std::span<const std::byte> data) {
  return impl_->guarded([&]() -> Result<void> {
    if (auto good = impl_->expect_mesh_open(); !good) return good;
    return impl_->mesh().add_cell(block, corners, last_use, data);
  });
}
Result<void> Writer::end_mesh() {
  return impl_->guarded([&]() -> Result<void> {
    if (auto good = impl_->expect_mesh_open(); !good) return good;
    return impl_->end_mesh();
  });
}
Result<void> Writer::add_step_values(std::uint32_t array, std::uint64_t step,
                                     std::span<const std::byte> values) {
  return impl_->guarded([&]() -> Result<void> {
    if (auto good = impl_->expect_mesh_ended(); !good) return good;
    return impl_->add_step_values(array, step, values);
  });
}
Result<void> Writer::set_step_times(std::span<const double> times) {
  return impl_->guarded([&]() -> Result<void> {
    if (auto good = impl_->expect_mesh_ended(); !good) return good;
    return impl_->set_step_times(times);
  });
}
Result<void> Writer::add_extra(const Extra& extra) {
  return impl_->guarded([&] { return impl_->add_extra(extra); });
}
Result<SizeReport> Writer::finish() { return impl_->finish(); }

}  // namespace shm
