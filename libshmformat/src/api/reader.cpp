// Decoder: finds chunks in the bytes that a caller feeds, and decodes items from the chunks.
// Reader: reads the bytes from a source and passes them to a Decoder.
#include "shm/reader.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <utility>

#include "api/kept_steps.h"
#include "base/binary.h"
#include "base/errors.h"
#include "base/packing.h"
#include "codecs/shared/digest.h"
#include "format/chunk_reader.h"
#include "format/format.h"
#include "format/schema.h"
#include "pipeline/mesh_decoder.h"
#include "steps/step_decoder.h"

namespace shm {

using container::ChunkKind;

namespace {

constexpr std::size_t kReadBytes = std::size_t{1} << 16;  // number of bytes per read

}  // namespace

class __attribute__((visibility("hidden"))) Decoder::Impl {
 public:
  Impl(const ReadLimits& limits, const ReadOptions& options)
      : limits_(within_sizes(limits)), options_(options), file_(limits) {}

  void feed(std::span<const std::byte> bytes) {
    if (file_.state() ==
        State::behind_end) {  // Bytes after the end record are counted, but not stored.
      trailing_bytes_ += bytes.size();
      keep_tail(bytes);
      return;
    }
    if (at_ > 0 && at_ == buffer_.size()) {
      buffer_.clear();
      at_ = 0;
    } else if (at_ > (std::size_t{1} << 20)) {
      buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(at_));
      at_ = 0;
    }
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  }
  void end_of_input() { ended_ = true; }
  /// Keeps the last bytes of the input.
  void keep_tail(std::span<const std::byte> bytes) {
    tail_.insert(tail_.end(), bytes.begin(), bytes.end());
    if (tail_.size() > container::kTrailerBytes)
      tail_.erase(tail_.begin(), tail_.end() - container::kTrailerBytes);
  }

  Result<Progress> advance() {
    if (error_) return *error_;
    auto result = work();
    if (!result) error_ = result.error();
    return result;
  }

  Item take() {
    Item item = std::move(*item_);
    item_.reset();
    return item;
  }
  void reuse(MeshBlock&& block) {
    if (mesh_) mesh_->reuse(std::move(block));
  }
  const Schema* schema() const { return schema_ ? schema_.get() : nullptr; }
  const std::optional<Error>& error() const { return error_; }
  Result<container::Index> held() const;

 private:
  using State = container::ChunkReader::State;

  Result<Progress> work();
  bool may_read_ahead() const;
  Result<void> read_on();
  Result<void> count_block(const MeshBlock& block);
  Result<void> count_bytes(std::uint64_t bytes);
  Result<Progress> missing();
  Result<void> read_payload(std::span<const std::byte> payload);
  Result<void> read_schema(std::span<const std::byte> payload);
  void look_at_group(std::span<const std::byte> payload);
  Result<void> read_step_values(std::span<const std::byte> payload);
  Result<void> take_piece(Result<StepPiece> piece);
  Result<void> read_next_of_bundle();
  Result<void> read_next_part();
  Result<void> read_step_times(std::span<const std::byte> payload);
  Result<void> read_extra(std::span<const std::byte> payload);
  Result<void> read_index(std::span<const std::byte> payload);
  std::string contents_of_chunk() const;
  std::uint64_t elements_of(std::uint32_t array) const;
  std::map<std::string, std::uint64_t> streams() const;
  Error wrong(std::string detail, ErrorCode code = ErrorCode::corrupt) const {
    return file_.wrong(std::move(detail), code);
  }
  std::span<const std::byte> ahead() const {
    return std::span<const std::byte>(buffer_).subspan(at_);
  }
  bool has_next() const { return ahead().size() >= file_.wanted(ahead()); }
  /// Decides whether the file ends at the index that was read last. Precondition: the next part is
  /// complete, or the input has ended.
  bool ends_at_index() const {
    if (file_.state() != State::after_index || options_.file_bytes > file_.offset()) return false;
    return file_.offset() == options_.file_bytes || !has_next() || !file_.is_next_header(ahead());
  }

  ReadLimits limits_;
  ReadOptions options_;
  container::ChunkReader file_;
  std::vector<std::byte> buffer_;
  std::size_t at_ = 0;  // number of bytes of buffer_ that file_ has consumed
  bool ended_ = false;
  std::optional<Error> error_;
  std::optional<Item> item_;
  std::vector<Extra> extras_;  // extras of the current chunk that have not been taken yet
  std::size_t next_extra_ = 0;
  // Parts of step values in the current chunk that have not been decoded yet; their bytes are in
  // part_bytes_.
  std::deque<container::StepPart> parts_;
  std::optional<BundleChunk>
      bundle_;                      // bundle of the current chunk, if not all of it has been read
  std::size_t next_of_bundle_ = 0;  // index of the next pair of an array and a step
  std::uint64_t bundle_pairs_ = 0;  // number of pairs in all bundles so far
  std::uint64_t step_bytes_ = 0;    // total size of all chunks of step values so far
  std::vector<std::byte> part_bytes_;
  std::uint64_t digest_ = 0;  // sum of the digests of all chunks so far, except groups
  bool has_digests_ = false;  // true if any chunk so far has a digest
  // Digest of the current chunk of step values, if it is checked.
  std::optional<std::uint64_t> step_digest_;
  std::vector<container::StepPart> checked_parts_;  // parts of that chunk
  // Error that occurred while reading ahead. advance() reports it after all earlier blocks have
  // been taken.
  std::optional<Error> error_ahead_;

  container::ChunkList chunks_;  // chunks read so far, to check the index
  // Schema. It is on the heap, so that pointers to it stay valid if the decoder is moved.
  std::unique_ptr<Schema> schema_;
  std::vector<std::byte> schema_bytes_;
  std::unique_ptr<MeshDecoder> mesh_;
  // Topology for step values; set only if the schema has stepped arrays.
  std::optional<StepTopology> topology_;
  // Decoder of step values; created with the first step values.
  std::optional<StepDecoder> step_values_;
  std::uint64_t steps_ = 0, decoded_bytes_ = 0;
  std::uint64_t step_times_ = 0;       // number of step times so far
  std::uint64_t committed_bytes_ = 0;  // end of the last index; 0 before the first index
  std::map<std::string, std::uint64_t> stream_bytes_;
  // Stream names of the arrays, set with the first step values.
  std::vector<std::string> array_names_;
  bool totals_taken_ = false;
  std::uint64_t trailing_bytes_ = 0;
  std::vector<std::byte> tail_;   // the last bytes after the last index, at most those of a trailer
  std::uint64_t last_index_ = 0;  // offset of the last index
  std::uint64_t index_bytes_ = 0;               // size of all decoded indexes so far
  std::optional<std::uint64_t> stated_digest_;  // digest of the mesh, if the index has one
};

Result<Decoder::Progress> Decoder::Impl::work() {
  while (!item_) {
    if (next_extra_ < extras_.size()) {
      item_ = std::move(extras_[next_extra_++]);
      break;
    }
    if ((!parts_.empty() || bundle_) && !error_ahead_) {
      if (auto status = bundle_ ? read_next_of_bundle() : read_next_part(); !status)
        error_ahead_ = status.error();
      continue;
    }
    const bool complete = has_next();
    if (mesh_ && !(complete && may_read_ahead()) && mesh_->is_busy()) {
      auto block = mesh_->next_block(!may_read_ahead());
      if (!block) return block.error();
      if (*block) {
        if (auto status = count_block(**block); !status) return status.error();
        item_ = std::move(**block);
        break;
      }
      if (!may_read_ahead()) continue;  // all groups read so far are decoded
    }
    if (error_ahead_) return *error_ahead_;
    if ((complete || ended_ || file_.offset() == options_.file_bytes) && ends_at_index()) {
      file_.end_file();
      keep_tail(ahead());
    }
    if (file_.state() == State::behind_end) {
      if (!ended_) return Progress::need_input;
      if (totals_taken_) return Progress::finished;
      // If the trailer at the end of the file points to a later index, a chunk before it is
      // damaged.
      if (container::offset_in_index(tail_).value_or(0) > last_index_)
        return corrupt("no chunk begins at this position, but the file has a later index",
                       "chunk header", file_.offset());
      totals_taken_ = true;
      Totals totals;
      totals.vertices = mesh_->vertices();
      totals.cells = mesh_->cells();
      totals.hexahedra = mesh_->hexahedra();
      totals.max_active_vertices = mesh_->max_active_vertices();
      totals.block_cells = mesh_->block_cells();
      totals.segment_starts = mesh_->segment_starts();
      totals.segment_connectivity = mesh_->segment_connectivity();
      totals.imported_vertices = mesh_->imported_vertices();
      totals.steps = steps_;
      totals.digest = stated_digest_;
      totals.total_bytes = file_.offset();
      totals.trailing_bytes = trailing_bytes_ + ahead().size();
      totals.streams = streams();
      std::uint64_t coded = 0;
      for (const auto& [name, bytes] : totals.streams) coded += bytes;
      totals.streams["container"] = file_.offset() - coded;
      item_ = std::move(totals);
      break;
    }
    if (!complete) return missing();
    if (auto status = read_on(); !status) error_ahead_ = status.error();
  }
  return Progress::item_ready;
}

/// Returns true if the decoder may read the next chunk header or group now. With threads, this is
/// possible before the caller has taken all earlier blocks.
bool Decoder::Impl::may_read_ahead() const {
  if (error_ahead_ || (ended_ && !has_next())) return false;
  const bool group = file_.state() == State::payload &&
                     file_.header().kind == static_cast<std::uint8_t>(ChunkKind::group);
  return (group || file_.state() == State::header) && mesh_ && mesh_->wants_group();
}

Result<void> Decoder::Impl::read_on() {
  const auto bytes = ahead().first(file_.wanted(ahead()));
  at_ += bytes.size();
  const bool payload = file_.state() == State::payload;
  auto status = file_.read(bytes);
  return status && payload ? read_payload(bytes) : status;
}

/// Checks that everything decoded so far is within the limits. The error has no offset, since no
/// single chunk is the cause.
Result<void> Decoder::Impl::count_block(const MeshBlock& block) {
  const auto over = [&](std::uint64_t limit, const std::string& what) {
    return over_limit("has more " + what + " than the limit of " + std::to_string(limit), "mesh");
  };
  if (mesh_->vertices() > limits_.max_vertices) return over(limits_.max_vertices, "vertices");
  if (mesh_->cells() > limits_.max_cells) return over(limits_.max_cells, "cells");
  if (topology_) topology_->add_vertex_numbers(block.vertex_numbers);
  std::uint64_t bytes = block.xyz.size() + 8 * std::uint64_t{block.corners.size()};
  for (const auto& values : block.arrays) bytes += values.size();
  return count_bytes(bytes);
}

Result<void> Decoder::Impl::count_bytes(std::uint64_t bytes) {
  if (bytes > limits_.max_decoded_bytes - decoded_bytes_)
    return over_limit(
        "decodes to more than the limit of " + std::to_string(limits_.max_decoded_bytes) + " bytes",
        "mesh");
  decoded_bytes_ += bytes;
  return {};
}

Result<Decoder::Progress> Decoder::Impl::missing() {
  if (!ended_) return Progress::need_input;
  const std::uint64_t end = file_.offset() + ahead().size();
  if (file_.state() == State::start)
    return truncated(end == 0 ? "the file is empty" : "the file ends within its first 16 bytes",
                     "signature", end);
  if (committed_bytes_ > 0)
    return truncated(
        "the file ends within a chunk that follows its last index; that index ends at "
        "byte " +
            std::to_string(committed_bytes_),
        file_.section(), end);
  return truncated("the file ends here, within or before a chunk, without an end record",
                   file_.section(), end);
}

Result<void> Decoder::Impl::read_payload(std::span<const std::byte> payload) {
  const container::ChunkHeader& header = file_.header();
  // A chunk of an unknown kind is skipped. Earlier checks ensure that it is optional.
  if (!container::is_known(header)) {
    chunks_.add(header);
    return {};
  }
  has_digests_ = has_digests_ || container::has_digest(header.version);
  switch (static_cast<ChunkKind>(header.kind)) {
    case ChunkKind::schema: chunks_.add(header); return read_schema(payload);
    case ChunkKind::group:
      if (step_values_) return wrong("mesh groups come before step values");
      if (committed_bytes_ > 0) return wrong("mesh groups come before the first index");
      look_at_group(payload);
      return mesh_->begin_group(
          {{payload.begin(), payload.end()}, header.version, file_.chunk_offset()}, header.segment);
    case ChunkKind::step_values: return read_step_values(payload);
    case ChunkKind::step_times: chunks_.add(header); return read_step_times(payload);
    case ChunkKind::extra: chunks_.add(header); return read_extra(payload);
    case ChunkKind::index: return read_index(payload);
    case ChunkKind::members:
      break;  // This chunk occurs only in archives, which an earlier check refuses.
  }
  return {};
}

Result<void> Decoder::Impl::read_schema(std::span<const std::byte> payload) {
  // The second copy of the schema, which helps to repair files, must equal the first copy.
  if (schema_) {
    if (payload.size() == schema_bytes_.size() &&
        std::equal(payload.begin(), payload.end(), schema_bytes_.begin()))
      return {};
    return wrong("the repeated schema differs from the first");
  }
  auto schema = file_.read_schema(payload);
  if (!schema) return schema.error();
  schema_ = std::make_unique<Schema>(std::move(*schema));
  schema_bytes_.assign(payload.begin(), payload.end());
  mesh_ = std::make_unique<MeshDecoder>(*schema_, limits_, options_);
  if (has_steps(*schema_))
    topology_.emplace(*schema_, limits_.max_group_bytes,
                      needs_of_steps(*schema_, options_.check_digests),
                      to_size(options_.kept_topology_bytes));
  return {};
}

std::uint64_t Decoder::Impl::elements_of(std::uint32_t array) const {
  return shm::elements_of(*schema_, array, mesh_->vertices(), mesh_->block_cells());
}

/// Records the header of the group. It is needed to check the index, and to decode the group's
/// topology again for step values.
void Decoder::Impl::look_at_group(std::span<const std::byte> payload) {
  ByteReader in(payload);
  container::GroupHeader header;
  if (!container::get(in, header, file_.header().version))
    return;  // decoding the group will report the error
  chunks_.add_group(file_.header(), header, in.position());
  if (!topology_) return;
  std::vector<std::span<const std::byte>> streams;
  for (const container::StreamEntry& entry : header.streams)
    streams.push_back(in.get_bytes(entry.bytes));
  if (in.ok()) topology_->add_group(file_.header().segment, header, streams);
}

Result<void> Decoder::Impl::read_step_values(std::span<const std::byte> payload) {
  if (!topology_) return wrong("does not belong to a stepped array");
  if (!step_values_) {
    std::vector<std::uint64_t> elements(schema_->arrays.size());
    for (std::uint32_t a = 0; a < elements.size(); ++a) elements[a] = elements_of(a);
    step_values_.emplace(*schema_, limits_, *topology_, std::move(elements),
                         kept_steps(limits_.max_kept_steps_bytes, limits_.temporary_folder));
  }
  ByteReader in(payload);
  std::vector<container::StepPart> parts;
  if (!container::get(in, parts, file_.header().version, payload.size()))
    return wrong("its header is invalid");
  chunks_.add_step_values(file_.header(), parts);
  digest_ += parts[0].digest;
  step_digest_.reset();
  step_values_->take_digest();
  const bool checks = options_.check_digests && container::has_digest(file_.header().version);
  step_values_->use_digests(checks);
  if (checks) {
    step_digest_ = parts[0].digest;
    checked_parts_ = parts;
  }
  if (array_names_.empty()) array_names_ = array_stream_names(*schema_);
  step_bytes_ += file_.header().chunk_bytes();
  if (parts[0].header.codec == Codec::bundle) {
    for (const container::StepPart& part : parts)
      bundle_pairs_ += part.header.arrays * part.header.steps;
    if (bundle_pairs_ > container::most_bundle_pairs(step_bytes_ - file_.header().chunk_bytes()))
      return wrong(container::kTooManyBundlePairs);
    if (parts[0].header.step + parts[0].header.steps > limits_.max_steps)
      return wrong("the limit is " + std::to_string(limits_.max_steps) + " steps",
                   ErrorCode::over_limit);
    auto bundle = BundleChunk::read(*schema_, parts, in.get_bytes(in.left()));
    if (!bundle) return wrong(bundle.error().detail, bundle.error().code);
    for_each_share(parts, [&](std::uint32_t array, std::uint64_t share) {
      stream_bytes_[array_names_[array]] += share;
    });
    bundle_ = std::move(*bundle);
    next_of_bundle_ = 0;
    return read_next_of_bundle();
  }
  for (const container::StepPart& part : parts) {
    if (part.header.array >= schema_->arrays.size())
      return wrong("does not belong to a stepped array");
    stream_bytes_[array_names_[part.header.array]] += part.bytes;
  }
  parts_.assign(parts.begin(), parts.end());
  const auto left = in.get_bytes(in.left());
  part_bytes_.assign(left.begin(), left.end());
  return read_next_part();
}

Result<void> Decoder::Impl::read_next_part() {
  const container::StepPart part = parts_.front();
  parts_.pop_front();
  std::uint64_t bytes_left = part.bytes;
  for (const container::StepPart& later : parts_) bytes_left += later.bytes;
  return take_piece(step_values_->read(part.header,
                                       std::span(part_bytes_)
                                           .last(static_cast<std::size_t>(bytes_left))
                                           .first(static_cast<std::size_t>(part.bytes)),
                                       file_.offset()));
}

Result<void> Decoder::Impl::read_next_of_bundle() {
  auto piece = step_values_->read(*bundle_, next_of_bundle_++, file_.offset());
  if (next_of_bundle_ == bundle_->pairs()) bundle_.reset();
  return take_piece(std::move(piece));
}

Result<void> Decoder::Impl::take_piece(Result<StepPiece> piece) {
  if (!piece) return wrong(piece.error().detail, piece.error().code);
  if (auto status = count_bytes(piece->values.size()); !status) return status;
  if (step_digest_ && parts_.empty() && !bundle_ && *step_digest_ != step_values_->take_digest())
    return wrong("the decoded values of " + contents_of_chunk() + kNotTheDigest);
  steps_ = std::max(steps_, piece->step + 1);
  item_ = std::move(*piece);
  return {};
}

/// Describes the chunk of step values whose digest is checked: its arrays, steps and segment.
std::string Decoder::Impl::contents_of_chunk() const {
  std::uint32_t first_array = ~std::uint32_t{0}, last_array = 0;
  std::uint64_t first_step = ~std::uint64_t{0}, last_step = 0;
  for (const auto& [header, bytes, digest] : checked_parts_) {
    first_array = std::min(first_array, header.array);
    last_array = std::max(last_array, header.array + header.arrays - 1);
    first_step = std::min(first_step, header.step);
    last_step = std::max(last_step, header.step + header.steps - 1);
  }
  std::string text = "array '" + schema_->arrays[first_array].name + "'";
  if (last_array != first_array) text += " to array '" + schema_->arrays[last_array].name + "'";
  text += ", step " + std::to_string(first_step);
  if (last_step != first_step) text += " to " + std::to_string(last_step);
  return text + ", segment " +
         std::to_string(topology_->segment_of(checked_parts_[0].header.group)) + ",";
}

Result<void> Decoder::Impl::read_step_times(std::span<const std::byte> payload) {
  ByteReader in(payload);
  const bool has_digest = container::has_digest(file_.header().version);
  const std::uint64_t digest = has_digest ? in.get_u64() : 0;
  if (container::has_first_time(file_.header().version) ? in.get_varint() != step_times_
                                                        : step_times_ > 0)
    return wrong("its times do not follow those of the step times before it");
  const auto blob = file_.unpack(in, most_bytes_of_times(limits_) - step_times_ * sizeof(double));
  if (!blob) return blob.error();
  StepTimes times;
  times.first = step_times_;
  if (!container::get_times(*blob, times.times, file_.header().version))
    return wrong("ends within a number");
  if (has_digest && options_.check_digests &&
      digest_of_step_times(times.times, times.first) != digest)
    return wrong(std::string("the decoded times") + kNotTheDigest);
  digest_ += digest;
  file_.take_from_budget(blob->size());
  step_times_ += times.times.size();
  steps_ = std::max(steps_, step_times_);
  stream_bytes_["extras"] += payload.size();
  item_ = std::move(times);
  return {};
}

Result<void> Decoder::Impl::read_extra(std::span<const std::byte> payload) {
  auto extras = get_extras(payload, file_.header().version,
                           std::min(limits_.max_extra_bytes, file_.budget()));
  if (!extras) return wrong(extras.error().detail, extras.error().code);
  for (const Extra& extra : *extras) file_.take_from_budget(bytes_of(extra));
  stream_bytes_["extras"] += payload.size();
  extras_ = std::move(*extras);  // the caller has taken all extras of the previous chunk
  next_extra_ = 0;
  return {};
}

Result<void> Decoder::Impl::read_index(std::span<const std::byte> payload) {
  container::Index index;
  if (!container::get_index_payload(payload, index, file_.header().version, file_.chunk_offset(),
                                    file_.count()))
    return wrong("is invalid");
  const auto held = this->held();
  const bool same =
      held && index.vertices == held->vertices && index.cells == held->cells &&
      index.hexahedra == held->hexahedra &&
      index.max_active_vertices == held->max_active_vertices && index.steps == held->steps &&
      index.segments == held->segments && index.imported_vertices == held->imported_vertices &&
      index.block_cells == held->block_cells &&
      (!container::has_digest(index.version) || index.digest == held->digest) &&
      (index.version > 0 || (index.streams == held->streams && index.previous_index == 0));
  if (!same) return wrong("does not match the contents of the file");
  if (const auto difference = chunks_.difference(index)) return wrong(*difference);
  if (container::has_digest(index.version)) stated_digest_ = index.digest;
  // Many indexes that each list the same chunks would need time out of proportion to the file.
  index_bytes_ += payload.size() + index.entries.size() * sizeof(container::StepEntry) +
                  index.block_cells.size() * sizeof(std::uint64_t);
  if (index_bytes_ > container::most_index_bytes(file_.offset()))
    return wrong("the indexes of the file list more than the limit", ErrorCode::over_limit);
  last_index_ = container::has_trailer_inside(index.version) ? file_.chunk_offset() : kNoOffset;
  chunks_.add_index(file_.header(), index.previous_index);
  committed_bytes_ = file_.offset();
  file_.end_index();
  return {};
}

std::map<std::string, std::uint64_t> Decoder::Impl::streams() const {
  std::map<std::string, std::uint64_t> streams = stream_bytes_;
  for (const auto& [name, bytes] : mesh_->stream_bytes()) streams[name] += bytes;
  return streams;
}

Result<container::Index> Decoder::Impl::held() const {
  if (step_values_ && !step_values_->is_complete())
    return wrong("step values of some groups are missing");
  container::Index held;
  held.vertices = mesh_->vertices();
  held.cells = mesh_->cells();
  held.hexahedra = mesh_->hexahedra();
  held.max_active_vertices = mesh_->max_active_vertices();
  held.steps = steps_;
  held.segments = mesh_->segment_starts().size();
  held.imported_vertices = mesh_->imported_vertices();
  held.block_cells = mesh_->block_cells();
  held.digest = mesh_->digest() + digest_;
  held.version =
      container::with_digest(container::version_of_chunk(ChunkKind::index, {}), has_digests_);
  for (const auto& [name, bytes] : streams()) held.streams.push_back({name, bytes});
  return held;
}

Decoder::Decoder(const ReadLimits& limits) : Decoder(limits, {}) {}
Decoder::Decoder(const ReadLimits& limits, const ReadOptions& options)
    : impl_(std::make_unique<Impl>(limits, options)) {}
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;
Decoder::~Decoder() = default;

Result<void> Decoder::feed(std::span<const std::byte> bytes) {
  if (impl_->error()) return *impl_->error();
  impl_->feed(bytes);
  return {};
}
void Decoder::end_of_input() { impl_->end_of_input(); }
Result<Decoder::Progress> Decoder::advance() { return impl_->advance(); }
Item Decoder::take() { return impl_->take(); }
void Decoder::reuse(MeshBlock&& block) { impl_->reuse(std::move(block)); }
const Schema* Decoder::schema() const { return impl_->schema(); }
Result<container::Index> Decoder::held() const { return impl_->held(); }

// --- Reader

class __attribute__((visibility("hidden"))) Reader::Impl {
 public:
  Impl(ByteSource& source, const ReadLimits& limits, const ReadOptions& options)
      : source_(&source), decoder_(limits, options) {}

  /// Passes bytes to the decoder until the schema has been decoded.
  Result<void> open() {
    while (decoder_.schema() == nullptr) {
      auto progress = decoder_.advance();
      if (!progress) return progress.error();
      if (*progress == Decoder::Progress::need_input)
        if (auto status = fetch(); !status) return status;
    }
    return {};
  }
  Result<Item*> next() {
    if (auto* const block = item_ ? std::get_if<MeshBlock>(&*item_) : nullptr)
      decoder_.reuse(std::move(*block));
    item_.reset();
    while (true) {
      auto progress = decoder_.advance();
      if (!progress) return progress.error();
      switch (*progress) {
        case Decoder::Progress::finished: return static_cast<Item*>(nullptr);
        case Decoder::Progress::item_ready: item_ = decoder_.take(); return &*item_;
        case Decoder::Progress::need_input:
          if (auto status = fetch(); !status) return status.error();
      }
    }
  }
  const Decoder& decoder() const { return decoder_; }

 private:
  Result<void> fetch() {
    buffer_.resize(kReadBytes);
    auto count = source_->read(buffer_);
    if (!count) return count.error();
    if (*count == 0) decoder_.end_of_input();
    return decoder_.feed(std::span(buffer_).first(*count));
  }

  ByteSource* source_;
  Decoder decoder_;
  std::vector<std::byte> buffer_;
  std::optional<Item> item_;
};

Reader::Reader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Reader::Reader(Reader&&) noexcept = default;
Reader& Reader::operator=(Reader&&) noexcept = default;
Reader::~Reader() = default;

Result<Reader> Reader::open(ByteSource& source, const ReadLimits& limits,
                            const ReadOptions& options) {
  auto impl = std::make_unique<Impl>(source, limits, options);
  if (auto status = impl->open(); !status) return status.error();
  return Reader(std::move(impl));
}
const Schema& Reader::schema() const { return *impl_->decoder().schema(); }
Result<Item*> Reader::next() { return impl_->next(); }

}  // namespace shm
