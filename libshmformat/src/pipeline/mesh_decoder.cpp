#include "pipeline/mesh_decoder.h"

#include <algorithm>
#include <utility>

#include "base/binary.h"
#include "codecs/registry.h"

namespace shm {
namespace {

// Until the groups of the first segment exceed this size in bytes, they are decoded without
// threads. Decoding this amount of data takes about a millisecond.
constexpr std::size_t kAloneBytes = std::size_t{4} << 10;

}  // namespace

SegmentDecoder::SegmentDecoder(const Schema& schema, const ReadLimits& limits,
                               std::uint32_t segment, DecodedParts parts)
    : schema_(&schema), limits_(limits), parts_(std::move(parts)), digests_(schema) {
  start_.segment = segment;
}

Error SegmentDecoder::damaged(std::string detail, ErrorCode code) const {
  return Error{code, std::move(detail), "group " + std::to_string(group_number_), group_offset_};
}

Result<void> SegmentDecoder::begin_group(container::GroupChunk chunk) {
  payload_ = std::move(chunk.payload);
  group_offset_ = chunk.offset;
  group_number_ = chunk.number;
  ByteReader in(payload_);
  if (!container::get(in, group_, chunk.version)) return damaged("the group header is invalid");
  header_bytes_ = in.position();
  segment_bytes_ += payload_.size();
  if (!decoder_) {
    start_.first_cell = next_cell_ = group_.first_cell;
    start_.first_vertex = next_vertex_ = group_.first_vertex;
  }
  if (auto status = check_header(); !status) return status;
  if (!decoder_) {
    auto cell_bytes = std::make_shared<const std::vector<std::size_t>>(cell_data_bytes(*schema_));
    auto made = make_group_decoder(*schema_, start_, parts_, std::move(cell_bytes), group_);
    if (!made) return placed(made.error());
    decoder_ = std::move(*made);
  }
  if (auto status = decoder_->begin_group(group_, codec_of_cells(group_)); !status)
    return placed(status.error());
  constexpr std::uint64_t kColumnBytesEach = 512;
  decoder_->allow_memory(limit_with(limits_.max_column_bytes, kColumnBytesEach, segment_bytes_),
                         limits_.max_column_bytes / 4);
  if (auto status = begin_streams(); !status) return status;
  next_cell_ += group_.cells;
  next_vertex_ += group_.vertices;
  digest_ = 0;
  in_group_ = true;
  return {};
}

Result<void> SegmentDecoder::check_header() {
  if (group_.first_cell != next_cell_ || group_.first_vertex != next_vertex_)
    return damaged("the group does not continue where the previous group ended");
  if (start_.segment == 0 && group_.imported_vertices > 0)
    return damaged("the first segment cannot import vertices");
  const std::uint64_t file = group_offset_ + payload_.size();
  if (auto status = check_active(group_, limits_, file); !status) return placed(status.error());
  if (group_.decoded_bytes > limits_.max_group_bytes)
    return damaged("unpacks to " + std::to_string(group_.decoded_bytes) +
                       " bytes, but the limit is " + std::to_string(limits_.max_group_bytes),
                   ErrorCode::over_limit);
  return {};
}

Result<void> SegmentDecoder::begin_streams() {
  stream_bytes_.clear();
  ByteReader in(std::span<const std::byte>(payload_).subspan(header_bytes_));
  for (const container::StreamEntry& entry : group_.streams) {
    // A stream that is not decoded is not checked, and may be missing at the end of the payload.
    const bool is_included = parts_.includes(entry);
    const auto bytes =
        in.get_bytes(is_included ? entry.bytes : std::min<std::uint64_t>(entry.bytes, in.left()));
    const std::string name = container::stream_name(entry.kind);
    if (!in.ok()) return damaged(name + ": ends beyond the group");
    if (!is_included) continue;
    if (checksum(bytes) != entry.checksum) return damaged(name + ": checksum does not match");
    if (auto status = decoder_->begin_stream(entry, bytes); !status) return placed(status.error());
    const bool array = entry.kind == container::StreamKind::array;
    stream_bytes_[array ? array_stream_name(*schema_, entry.array) : name] += bytes.size();
  }
  if (in.left() != 0) return damaged("bytes are left over after the last stream");
  if (auto status = decoder_->end_streams(); !status) return placed(status.error());
  return {};
}

namespace {

/// Removes the vertices and values of the block, but keeps the allocated memory. Does not remove
/// the cells, because they are overwritten later.
void clear(MeshBlock& block) {
  block.vertex_numbers.clear();
  block.xyz.clear();
  block.imported.clear();
  for (auto& values : block.arrays) values.clear();
}

}  // namespace

Result<DecodedBlock> SegmentDecoder::next_block(MeshBlock&& room) {
  DecodedBlock decoded;
  decoded.mesh = std::move(room);
  clear(decoded.mesh);
  decoded.offset = group_offset_;
  if (auto status = decoder_->next_block(decoded); !status) return placed(status.error());
  const bool checks = container::has_digest(group_.version) && parts_.checks_digest();
  if (checks) digest_ += digests_.of(decoded.mesh);
  if (!decoder_->is_complete()) return decoded;
  auto end = decoder_->end_group();
  if (!end) return placed(end.error());
  if (checks && digest_ != group_.digest)
    return damaged(std::string("the decoded vertices, cells and values") + kNotTheDigest);
  end->digest = group_.digest;
  end->stream_bytes = std::move(stream_bytes_);
  decoded.group_end = std::move(*end);
  in_group_ = false;
  return decoded;
}

std::vector<std::uint64_t> SegmentDecoder::alive() const {
  return decoder_ ? decoder_->alive() : std::vector<std::uint64_t>();
}

// --- several segments

namespace {

std::size_t bytes_of(const MeshBlock& block) {
  std::size_t bytes = block.xyz.size() + block.imported.size() + 4 * block.cell_blocks.size() +
                      block.other_last_uses.size() * sizeof(OtherLastUse);
  for (const auto* numbers : {&block.vertex_numbers, &block.cell_numbers, &block.corner_begin,
                              &block.corners, &block.last_use, &block.vertices_before_cell})
    bytes += 8 * numbers->size();
  for (const auto& values : block.arrays) bytes += values.size();
  return bytes;
}

}  // namespace

class DecodingQueue::SegmentTask final : public DecodingQueue::Tasks::Task {
 public:
  SegmentTask(const DecodingQueue& queue, std::size_t segment, std::uint32_t number,
              DecodedParts parts)
      : check_(queue.check_),
        segment_(segment),
        decoder_(*queue.schema_, queue.limits_, number, std::move(parts)) {}

  Result<void> take(container::GroupChunk& chunk, const Tasks::Emit& emit) override {
    const std::uint64_t group = chunk.number;
    if (auto status = decoder_.begin_group(std::move(chunk)); !status) return status;
    if (check_)
      if (auto status = check_(group, decoder_.group()); !status) return status;
    while (decoder_.in_group()) {
      auto block = decoder_.next_block();
      if (!block) return block.error();
      const std::size_t bytes = bytes_of(block->mesh);
      emit({segment_, group, std::move(*block), {}}, bytes);
    }
    return {};
  }
  Result<void> end(const Tasks::Emit& emit) override {
    auto alive = decoder_.alive();
    const std::size_t bytes = alive.size() * 8;
    emit({segment_, 0, std::nullopt, std::move(alive)}, bytes);
    return {};
  }

 private:
  const Check& check_;
  std::size_t segment_;
  SegmentDecoder decoder_;
};

DecodingQueue::DecodingQueue(const Schema& schema, const ReadLimits& limits,
                             const ReadOptions& options, Check check)
    : schema_(&schema), limits_(limits), check_(std::move(check)) {
  if (options.threads == 1) return;
  const unsigned threads = thread_count(options.threads);
  const std::size_t ahead = to_size(options.max_ahead_bytes);
  if (threads > 1)
    tasks_ =
        std::make_unique<Tasks>(threads, Tasks::Limits{.in = std::max<std::size_t>(ahead / 4, 1),
                                                       .out = ahead - ahead / 4,
                                                       .alone = kAloneBytes});
}

void DecodingQueue::begin_segment(std::size_t segment, std::uint32_t number, DecodedParts parts) {
  if (tasks_) {
    tasks_->begin(std::make_unique<SegmentTask>(*this, segment, number, std::move(parts)));
    return;
  }
  leave_segment();
  segment_.reset(new Segment{segment, {*schema_, limits_, number, std::move(parts)}});
}

void DecodingQueue::leave_segment() {
  if (segment_) left_ = Output{segment_->segment, 0, std::nullopt, segment_->decoder.alive()};
  segment_.reset();
}

bool DecodingQueue::wants_group() const { return tasks_ ? tasks_->has_room() : !is_busy(); }

Result<void> DecodingQueue::add_group(container::GroupChunk chunk) {
  if (tasks_) {
    const std::size_t bytes = chunk.payload.size();
    tasks_->push(std::move(chunk), bytes);
    return {};
  }
  segment_->group = chunk.number;
  auto status = segment_->decoder.begin_group(std::move(chunk));
  if (status && check_) status = check_(segment_->group, segment_->decoder.group());
  if (!status) segment_.reset();
  return status;
}

void DecodingQueue::end() {
  if (tasks_)
    tasks_->end();
  else
    leave_segment();
}

bool DecodingQueue::is_busy() const {
  if (tasks_) return !tasks_->is_idle();
  return left_ || (segment_ && segment_->decoder.in_group());
}

Result<std::optional<DecodingQueue::Output>> DecodingQueue::next(Wait wait) {
  if (tasks_) return tasks_->next(wait);
  if (left_) return std::exchange(left_, std::nullopt);
  if (!segment_ || !segment_->decoder.in_group()) return std::optional<Output>();
  auto block = segment_->decoder.next_block(std::exchange(room_, {}));
  if (!block) return block.error();
  return std::optional<Output>({segment_->segment, segment_->group, std::move(*block), {}});
}

MeshDecoder::MeshDecoder(const Schema& schema, const ReadLimits& limits, const ReadOptions& options)
    : schema_(&schema),
      limits_(limits),
      checks_digests_(options.check_digests),
      queue_(schema, limits, options),
      block_cells_(schema.blocks.size()) {}

Error MeshDecoder::damaged(std::string detail, std::uint64_t group, std::uint64_t offset,
                           ErrorCode code) const {
  return Error{code, std::move(detail), "group " + std::to_string(group), offset};
}

Result<void> MeshDecoder::begin_group(container::GroupChunk chunk, std::uint32_t segment) {
  if (segments_begun_ == 0 || segment + 1 != segments_begun_)
    if (auto status = begin_segment(segment, chunk.offset); !status) return status;
  chunk.number = groups_begun_++;
  return queue_.add_group(std::move(chunk));
}

Result<void> MeshDecoder::begin_segment(std::uint32_t segment, std::uint64_t offset) {
  if (segment != segments_begun_)
    return damaged(
        "the group belongs neither to the segment of the previous group nor to the next segment",
        groups_begun_, offset);
  if (segment >= limits_.max_segments)
    return damaged("the file has more than " + std::to_string(limits_.max_segments) +
                       " segments, which is the limit",
                   groups_begun_, offset, ErrorCode::over_limit);
  ++segments_begun_;
  DecodedParts parts;
  parts.digest = checks_digests_;
  queue_.begin_segment(segment, segment, std::move(parts));
  return {};
}

Result<std::optional<MeshBlock>> MeshDecoder::next_block(bool wait) {
  using Wait = DecodingQueue::Wait;
  while (true) {
    auto output = queue_.next(wait ? Wait::for_output : Wait::no);
    if (!output) return output.error();
    if (!*output) return std::optional<MeshBlock>();
    if (!(*output)->block) {
      leave((*output)->left_alive, static_cast<std::uint32_t>((*output)->segment));
      continue;
    }
    DecodedBlock& block = *(*output)->block;
    if (auto status = join(block); !status) return status.error();
    return std::optional<MeshBlock>(std::move(block.mesh));
  }
}

/// Records the end of `segment`. `alive`: vertices that the segment has not finalized; later
/// segments may import them.
void MeshDecoder::leave(const std::vector<std::uint64_t>& alive, std::uint32_t segment) {
  for (std::uint64_t number : alive) alive_.insert_or_assign(number, segment);
}

/// Checks that the block begins at the end of the previous block, and adds its vertices and cells
/// to the totals. Also checks the bounding box of the group. (Functions that read only parts of a
/// file do not check it, because intact data can be used even if the box is wrong.)
Result<void> MeshDecoder::join(const DecodedBlock& block) {
  if (block.segment.segment == segment_starts_.size()) {
    if (block.segment.first_cell != cells_ || block.segment.first_vertex != vertices_)
      return damaged("the group does not continue where the previous group ended", groups_,
                     block.offset);
    segment_starts_.push_back(cells_);
    segment_connectivity_.push_back(block.connectivity);
  } else if (segment_connectivity_.back() == ConnectivityCodec::automatic) {
    // The segment had no codec yet, because its earlier groups contain only unused vertices.
    segment_connectivity_.back() = block.connectivity;
  }
  if (auto status = check_imports(block); !status) return status;
  if (block.group_end && !block.group_end->has_its_box)
    return damaged("the bounding box of the group does not match its vertices", groups_,
                   block.offset);
  count(block);
  return {};
}

/// Checks that the segment imports no vertex twice, and that earlier segments have left all
/// imported vertices alive.
Result<void> MeshDecoder::check_imports(const DecodedBlock& block) {
  for (std::uint64_t number : block.imported) {
    const auto found = alive_.find(number);
    if (found == alive_.end() || found->second == block.segment.segment)
      return damaged(
          "imports vertex " + std::to_string(number) + ", which no earlier segment has left alive",
          groups_, block.offset);
    found->second = block.segment.segment;
  }
  for (std::uint64_t number : block.finalized_imports) alive_.erase(number);
  return {};
}

void MeshDecoder::count(const DecodedBlock& block) {
  vertices_ += block.mesh.vertex_count();
  cells_ += block.mesh.cell_count();
  const std::vector<std::uint32_t>& blocks = block.mesh.cell_blocks;
  for (auto run = blocks.begin(); run != blocks.end();) {
    const auto end = std::find_if(run, blocks.end(), [&](std::uint32_t b) { return b != *run; });
    const auto cells = static_cast<std::uint64_t>(end - run);
    block_cells_[*run] += cells;
    if (is_hexahedral(schema_->blocks[*run])) hexahedra_ += cells;
    run = end;
  }
  if (!block.group_end) return;
  ++groups_;
  imported_vertices_ += block.group_end->imported_vertices;
  max_active_vertices_ = std::max(max_active_vertices_, block.group_end->max_active_vertices);
  digest_ += block.group_end->digest;
  for (const auto& [name, bytes] : block.group_end->stream_bytes) stream_bytes_[name] += bytes;
}

}  // namespace shm
