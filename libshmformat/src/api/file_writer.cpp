// FileWriter: writes all parts of a file. It receives the contents of groups from the mesh encoder.
#include "api/file_writer.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "base/binary.h"
#include "base/errors.h"
#include "base/packing.h"
#include "codecs/shared/digest.h"
#include "format/schema.h"
#include "steps/bundle_chunk.h"

namespace shm {
namespace {

using container::ChunkKind;

/// Files of at least this size in bytes contain a second copy of the schema, before the index. The
/// second copy helps to repair the file.
constexpr std::uint64_t kRepeatSchemaFrom = std::uint64_t{1} << 20;
/// Limit in bytes for the extras that are packed into one chunk. A damaged byte makes all extras of
/// its chunk unreadable, so the limit keeps the loss small.
constexpr std::uint64_t kExtrasTogether = std::uint64_t{1} << 18;

}  // namespace

Result<void> FileWriter::start() {
  if (auto status = chunks_.start(start_); !status) return status;
  return write_schema();
}

void FileWriter::go_on(std::vector<std::byte> schema, container::ChunkWriter::State state,
                       std::map<std::string, std::uint64_t> streams, std::uint64_t steps,
                       std::uint64_t digest, std::vector<double> times) {
  schema_payload_ = std::move(schema);
  ByteReader version(schema_payload_);
  container::get_version(version, start_);
  chunks_.go_on(std::move(state), start_);
  stream_bytes_ = std::move(streams);
  steps_ = steps;
  digest_ = digest;
  times_ = std::move(times);
}

Result<void> FileWriter::go_on_with_parts(std::span<const std::byte> payload) {
  ByteReader in(payload);
  if (!container::get(in, parts_, version_of(ChunkKind::step_values), payload.size()))
    return corrupt("its header is invalid", "step values");
  const auto bytes = in.get_bytes(in.left());
  part_bytes_.assign(bytes.begin(), bytes.end());
  return {};
}

Result<void> FileWriter::adopt(const container::Index& part, std::uint64_t bytes) {
  if (auto status = chunks_.adopt(part.entries, bytes); !status) return status;
  for (const auto& [name, size] : part.streams) stream_bytes_[name] += size;
  steps_ = std::max(steps_, part.steps);
  digest_ += part.digest;
  return {};
}

container::Index FileWriter::take_part(container::Index totals) {
  totals.entries = chunks_.take_entries();
  for (const auto& [name, bytes] : std::exchange(stream_bytes_, {}))
    totals.streams.push_back({name, bytes});
  totals.steps = step_values_ ? step_values_->steps() : 0;
  totals.version = version_of(ChunkKind::index);
  totals.digest = std::exchange(digest_, 0);
  return totals;
}

Result<void> FileWriter::write_schema() {
  if (!schema_payload_.empty()) return write(ChunkKind::schema, schema_payload_);
  ByteWriter blob, payload;
  put(blob, *schema_);
  container::put_version(payload, start_);
  put_packed(payload, blob.bytes, Packing::with_dictionary);
  return write(ChunkKind::schema, payload.bytes);
}

/// Writes any chunk except the index.
Result<void> FileWriter::write(ChunkKind kind, std::span<const std::byte> payload,
                               const container::IndexEntry& entry) {
  return write(kind, payload, entry, container::version_of_chunk(kind, start_));
}
Result<void> FileWriter::write(ChunkKind kind, std::span<const std::byte> payload,
                               const container::IndexEntry& entry, std::uint8_t version) {
  if (kind != ChunkKind::extra)
    if (auto status = write_extras(); !status) return status;
  if (kind != ChunkKind::step_values)
    if (auto status = write_parts(); !status) return status;
  return chunks_.write(kind, payload, entry, version);
}

Result<void> FileWriter::write_group(const EncodedGroup& group) {
  const container::GroupHeader& header = group.header;
  const auto& streams = group.streams;
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
  entry.segment = group.segment;
  entry.first_cell = header.first_cell;
  entry.cells = header.cells;
  entry.first_vertex = header.first_vertex;
  entry.vertices = header.vertices;
  entry.box = header.box;
  digest_ += header.digest;
  return write(ChunkKind::group, payload.bytes, entry, header.version);
}

StepEncoder& FileWriter::begin_steps(StepTopology& topology, std::vector<std::uint64_t> elements,
                                     std::uint32_t key_steps, KeptSteps kept, Level level) {
  step_values_.emplace(*schema_, topology, std::move(elements), key_steps, std::move(kept), level,
                       [this](const auto& header, auto first, auto bytes, auto digest) {
                         return add_part(header, first, bytes, digest);
                       });
  if (has_digests_) step_values_->use_digests();
  return *step_values_;
}
void FileWriter::use_bundles(std::uint64_t waiting_bytes, std::uint64_t pairs,
                             std::uint64_t bytes) {
  if (container::version_of_chunk(ChunkKind::step_values, start_) == 0) return;
  step_values_->use_bundles([this](auto parts, auto data) { return write_bundle(parts, data); },
                            waiting_bytes, pairs, bytes);
}

/// Writes a bundle as one chunk.
Result<void> FileWriter::write_bundle(std::span<const container::StepPart> parts,
                                      std::span<const std::byte> bytes) {
  if (auto status = write_parts(); !status) return status;
  ByteWriter payload;
  const std::uint8_t version = container::with_digest(container::kBundleVersion, has_digests_);
  container::put(payload, parts, version);
  payload.put_bytes(bytes);
  container::IndexEntry entry;
  for (const container::StepPart& part : parts) {
    entry.parts.push_back(container::entry_of(part.header));
    digest_ += part.digest;
  }
  for_each_share(parts, [&](std::uint32_t array, std::uint64_t share) {
    stream_bytes_[array_key(array)] += share;
  });
  return write(ChunkKind::step_values, payload.bytes, entry, version);
}

Result<void> FileWriter::check_step_values(std::uint32_t array,
                                           std::span<const std::byte> values) const {
  if (array >= schema_->arrays.size() || !schema_->arrays[array].per_step)
    return misuse("array " + std::to_string(array) + " is not a stepped array", "steps");
  const ArrayInfo& info = schema_->arrays[array];
  if (values.size() % (scalar_bytes(info.type) * info.components) != 0)
    return misuse("values end within an element", "steps");
  return {};
}

/// Returns true if this part may share a chunk with other parts: it is small, belongs to group 0
/// and covers the whole array. Every other part is stored in a chunk of its own. As a result, a
/// reader of one array reads little data of other arrays, and if several writers write parts of one
/// array, these parts are adjacent in the file.
bool FileWriter::may_share_chunk(const container::StepPart& part) const {
  return container::version_of_chunk(ChunkKind::step_values, start_) > 0 &&
         part.header.group == 0 && part.header.count == step_values_->elements(part.header.array) &&
         part.bytes <= container::kPartBytesTogether;
}

Result<void> FileWriter::add_part(const container::StepHeader& header, std::uint64_t first,
                                  std::span<const std::byte> bytes, std::uint64_t digest) {
  if (auto status = write_extras(); !status) return status;
  const container::StepPart part{header, bytes.size(), digest};
  const bool with_others = may_share_chunk(part);
  if (!with_others || parts_.size() == container::kMostStepParts ||
      part_bytes_.size() + bytes.size() > container::kPartBytesTogether)
    if (auto status = write_parts(); !status) return status;
  parts_.push_back(part);
  part_bytes_.insert(part_bytes_.end(), bytes.begin(), bytes.end());
  stream_bytes_[array_key(header.array)] += bytes.size();
  return with_others ? Result<void>() : write_parts(first);
}

/// Writes the waiting parts as one chunk. `first` is the index of the first element of each part
/// within its array.
Result<void> FileWriter::write_parts(std::uint64_t first) {
  if (parts_.empty()) return {};
  ByteWriter payload;
  const std::uint8_t version = version_of(ChunkKind::step_values);
  container::put(payload, parts_, version);
  payload.put_bytes(part_bytes_);
  container::IndexEntry entry;
  for (const container::StepPart& part : parts_) {
    entry.parts.push_back(container::entry_of(part.header));
    entry.parts.back().first = first;
    digest_ += part.digest;
  }
  parts_.clear();
  part_bytes_.clear();
  return write(ChunkKind::step_values, payload.bytes, entry, version);
}

Result<void> FileWriter::set_step_times(std::span<const double> times) {
  const bool again = std::exchange(times_set_, true);
  const auto bits = [](double time) { return std::bit_cast<std::uint64_t>(time); };
  if (times.size() < times_.size() ||
      !std::equal(times_.begin(), times_.end(), times.begin(),
                  [&](double a, double b) { return bits(a) == bits(b); }))
    return misuse("the times of the first " + std::to_string(times_.size()) +
                      " steps are written and cannot change",
                  "steps");
  const std::size_t first = times_.size();
  times = times.subspan(first);
  if (auto status = end_step_array(); !status) return status;
  if (times.empty() && (again || container::version_of_chunk(ChunkKind::index, start_) > 0))
    return {};
  ByteWriter blob, payload;
  const std::uint8_t version = version_of(ChunkKind::step_times);
  if (has_digests_) {
    const std::uint64_t digest = digest_of_step_times(times, first);
    payload.put_u64(digest);
    digest_ += digest;
  }
  if (container::has_first_time(version)) payload.put_varint(first);
  container::put_times(blob, times, version);
  put_packed(payload, blob.bytes);
  times_.insert(times_.end(), times.begin(), times.end());
  steps_ = std::max<std::uint64_t>(steps_, times_.size());
  stream_bytes_["extras"] += payload.bytes.size();
  return write(ChunkKind::step_times, payload.bytes, {}, version);
}

Result<void> FileWriter::check(const Extra& extra) {
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
    return misuse("extra '" + extra.key + "': references must be int32 or int64", "extras");
  return {};
}

Result<void> FileWriter::add_extra(const Extra& extra) {
  if (auto status = end_step_array(); !status) return status;
  if (auto status = write_parts(); !status) return status;
  const std::uint64_t bytes = extra.key.size() + extra.data.size();
  if (extra_bytes_ + bytes > kExtrasTogether || extras_.size() == kMostExtras)
    if (auto status = write_extras(); !status) return status;
  extras_.push_back(extra);
  extra_bytes_ += bytes;
  return {};
}

/// Writes the extras that were added since the previous chunk was written.
Result<void> FileWriter::write_extras() {
  const std::vector<Extra> extras = std::exchange(extras_, {});
  extra_bytes_ = 0;
  const bool together = container::version_of_chunk(ChunkKind::extra, start_) > 0;
  for (std::size_t i = 0; i < extras.size(); i += together ? extras.size() : 1) {
    auto payload = together ? extras_payload(extras) : extra_payload(extras[i]);
    // If the unpacked extras exceed a reader's memory budget, pack them less tightly. This makes
    // the chunk larger. A larger file has a larger budget, so the extras fit into it.
    std::uint64_t bytes = 0;
    for (const Extra& extra : extras) bytes += bytes_of(extra);
    if (together && bytes > budget_.left(chunks_.offset() + payload.size()))
      payload = extras_payload(extras, Packing::bounded);
    budget_.take(bytes);
    stream_bytes_["extras"] += payload.size();
    if (auto status = write(ChunkKind::extra, payload); !status) return status;
  }
  return {};
}

/// Writes the chunks that were held back.
Result<void> FileWriter::write_waiting() {
  if (auto status = end_step_array(); !status) return status;
  if (auto status = write_parts(); !status) return status;
  return write_extras();
}

/// Sets the totals of an index that FileWriter counts itself.
void FileWriter::add_totals(container::Index& totals) const {
  totals.steps = std::max(steps_, step_values_ ? step_values_->steps() : 0);
  totals.version = version_of(ChunkKind::index);
  totals.digest = digest_;
  totals.streams.clear();
  for (const auto& [name, bytes] : stream_bytes_) totals.streams.push_back({name, bytes});
}

Result<void> FileWriter::commit(container::Index totals) {
  if (auto status = write_waiting(); !status) return status;
  add_totals(totals);
  return chunks_.commit(std::move(totals));
}

Result<SizeReport> FileWriter::finish(container::Index totals) {
  if (auto status = write_waiting(); !status) return status.error();
  if (chunks_.offset() >= kRepeatSchemaFrom)
    if (auto status = write_schema(); !status) return status.error();
  add_totals(totals);
  if (auto status = chunks_.finish(totals); !status) return status.error();
  return report_of(totals);
}

Result<SizeReport> FileWriter::finish_with_commit(container::Index totals) {
  if (auto status = commit(totals); !status) return status.error();
  if (auto status = chunks_.end(); !status) return status.error();
  return report_of(totals);
}

SizeReport FileWriter::report_of(const container::Index& totals) const {
  SizeReport report;
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
  return report;
}

}  // namespace shm
