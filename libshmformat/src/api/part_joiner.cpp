// PartJoiner: wraps a FileWriter. The groups and step values of the file have been written by
// PartWriters.
#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "api/file_writer.h"
#include "base/errors.h"
#include "format/schema.h"
#include "pipeline/mesh_encoder.h"
#include "shm/part_writer.h"

namespace shm {
namespace {

Error of_another_schema() { return corrupt("belongs to another schema", "part"); }

}  // namespace

class __attribute__((visibility("hidden"))) PartJoiner::Impl {
 public:
  Impl(ByteSink& sink, Schema schema, bool digests)
      : schema_(std::move(schema)),
        file_(sink, schema_, digests),
        totals_(totals_of_nothing(schema_)) {}
  Result<void> start() { return file_.start(); }
  const FileWriter& file() const { return file_; }

  Calls& calls() { return calls_; }
  FileWriter& file() { return file_; }

  Result<void> add(std::span<const std::byte> index, std::uint64_t bytes) {
    ByteReader in(index);
    container::Index part;
    std::vector<container::NamedBytes> streams;
    const std::uint32_t schema = in.get_u32();
    const std::uint8_t version = in.get_u8();
    const std::uint8_t expected = container::version_of_chunk(container::ChunkKind::index, {});
    if (container::without_digest(version) != expected || !container::get(in, streams) ||
        !container::get(in, part, version, bytes / container::kShortHeaderBytes))
      return corrupt("is not the index of a part", "part");
    if (container::has_digest(version) != file_.has_digests())
      return misuse("all parts of a file must have digests, or none", "part");
    if (schema != checksum_of(schema_)) return of_another_schema();
    part.streams = std::move(streams);
    if (auto status = add_totals(part); !status) return status;
    return file_.adopt(part, bytes);
  }

  Result<SizeReport> finish() {
    return calls_.finish([&] { return file_.finish(totals_); });
  }

 private:
  /// Adds the totals of a part. Parts without groups, such as parts with only step values, have no
  /// totals.
  Result<void> add_totals(const container::Index& part) {
    if (part.segments == 0) return {};
    if (part.block_cells.size() != totals_.block_cells.size()) return of_another_schema();
    totals_.vertices += part.vertices;
    totals_.cells += part.cells;
    totals_.hexahedra += part.hexahedra;
    totals_.max_active_vertices = std::max(totals_.max_active_vertices, part.max_active_vertices);
    totals_.segments += part.segments;
    totals_.imported_vertices += part.imported_vertices;
    for (std::size_t b = 0; b < part.block_cells.size(); ++b)
      totals_.block_cells[b] += part.block_cells[b];
    return {};
  }

  Schema schema_;
  FileWriter file_;
  container::Index totals_;
  Calls calls_;
};

PartJoiner::PartJoiner(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PartJoiner::PartJoiner(PartJoiner&&) noexcept = default;
PartJoiner& PartJoiner::operator=(PartJoiner&&) noexcept = default;
PartJoiner::~PartJoiner() = default;

Result<PartJoiner> PartJoiner::create(ByteSink& sink, Schema schema, const WriteOptions& options) {
  auto checked = schema_of_file(std::move(schema), options);
  if (!checked) return checked.error();
  auto impl = std::make_unique<Impl>(sink, std::move(*checked), options.digest);
  if (auto status = impl->start(); !status) return status.error();
  return PartJoiner(std::move(impl));
}
std::uint64_t PartJoiner::offset() const { return impl_->file().offset(); }
std::uint32_t PartJoiner::chunks() const { return impl_->file().chunks(); }
Result<void> PartJoiner::add(std::span<const std::byte> index, std::uint64_t bytes) {
  return impl_->calls().run([&] { return impl_->add(index, bytes); });
}
Result<void> PartJoiner::set_step_times(std::span<const double> times) {
  return impl_->calls().run([&] { return impl_->file().set_step_times(times); });
}
Result<void> PartJoiner::add_extra(const Extra& extra) {
  return impl_->calls().run([&]() -> Result<void> {
    if (auto status = FileWriter::check(extra); !status) return status;
    return impl_->file().add_extra(extra);
  });
}
Result<SizeReport> PartJoiner::finish() { return impl_->finish(); }

}  // namespace shm
