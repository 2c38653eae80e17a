#include "random/indexed_file.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

#include "base/binary.h"
#include "base/errors.h"
#include "base/packing.h"
#include "codecs/shared/digest.h"
#include "format/chunk_reader.h"
#include "format/random_chunks.h"
#include "format/schema.h"

namespace shm {

using container::ChunkKind;
using container::IndexEntry;
using container::kLongHeaderBytes;
using container::kShortHeaderBytes;

/// Checks the totals of the index against the limits.
Result<void> IndexedFile::expect_limits() const {
  for (const auto& [count, limit, unit] :
       {std::tuple(index_.vertices, limits_.max_vertices, " vertices"),
        std::tuple(index_.cells, limits_.max_cells, " cells")})
    if (count > limit)
      return over_limit(
          "has " + std::to_string(count) + unit + ", but the limit is " + std::to_string(limit),
          "index", index_offset_);
  return {};
}

Result<void> IndexedFile::open() {
  if (auto status = read_index(); !status) return status;
  if (auto status = expect_limits(); !status) return status;
  if (auto status = list_groups(); !status) return status;
  return read_schema();
}

Result<void> IndexedFile::open_damaged() {
  const ByteRange all{0, source_->size()};
  source_->prefetch({&all, 1});
  const auto known = FoundChunks::of(*source_, limits_);
  if (!known) return known.error();
  if (!known->schema())
    return corrupt("no copy of the schema is undamaged; the file cannot be read without a schema",
                   "schema");
  decodable_ = std::make_unique<const DecodableParts>(DecodableParts::of(*known));
  index_offset_ = decodable_->index_offset;
  index_ = decodable_->totals;
  if (auto status = expect_limits(); !status) return status;
  for (const auto* entries : {&decodable_->extras, &decodable_->step_times})
    index_.entries.insert(index_.entries.end(), entries->begin(), entries->end());
  groups_ = decodable_->groups;
  first_group_ = decodable_->first_group;
  if (first_group_.size() - 1 > limits_.max_segments) return wrong_index("has too many segments");
  for (std::size_t s = 0; s + 1 < first_group_.size(); ++s) {
    const IndexEntry& first = groups_[first_group_[s]];
    segments_.push_back({first.first_cell, 0, first.first_vertex, 0, 0, first.box});
    for (std::size_t g = first_group_[s]; g < first_group_[s + 1]; ++g) add_to_segment(groups_[g]);
  }
  look_at_beginning(decodable_->beginning);
  std::span<const std::byte> beginning(decodable_->beginning);
  auto schema = container::ChunkReader(limits_).find_schema(beginning);
  if (!schema) return schema.error();
  if (!*schema) return corrupt("is invalid", "schema");
  schema_ = std::make_unique<const Schema>(std::move(**schema));
  return {};
}

void IndexedFile::drop_step_entries() {
  std::erase_if(index_.entries,
                [](const IndexEntry& entry) { return entry.is(ChunkKind::step_values); });
  index_.entries.shrink_to_fit();
}

Result<std::vector<std::byte>> IndexedFile::read_chunk(const IndexEntry& entry,
                                                       std::uint8_t* version) {
  return container::read_chunk(*source_, entry, limits_.max_chunk_bytes, version);
}

auto IndexedFile::read_chunk_of_parts(const IndexEntry& entry) -> Result<Payload> {
  constexpr std::size_t kSmall = std::size_t{1} << 16;
  if (kept_offset_ == kNoOffset || kept_offset_ != entry.offset || kept_bytes_ != entry.bytes) {
    kept_offset_ = kNoOffset;
    auto payload = read_chunk(entry, &kept_version_);
    if (!payload) return payload.error();
    kept_ = std::move(*payload);
    kept_bytes_ = entry.bytes;
    if (kept_.size() <= kSmall) kept_offset_ = entry.offset;
  }
  return Payload{kept_, kept_version_};
}

/// Reads a chunk of step times and appends its times to `times`. In a damaged file, the times of
/// lost chunks before it are NaN.
Result<void> IndexedFile::read_step_times(const IndexEntry& entry, std::vector<double>& times) {
  const std::string section = container::chunk_name(entry.kind);
  std::uint8_t version = 0;
  const auto payload = read_chunk(entry, &version);
  if (!payload) return payload.error();
  ByteReader in(*payload);
  const std::uint64_t digest = container::has_digest(version) ? in.get_u64() : 0;
  const std::uint64_t first = container::has_first_time(version) ? in.get_varint() : 0;
  std::uint64_t limit = std::min(most_bytes_of_times(limits_), budget().left(source_->size()));
  if (first < times.size() || (first > times.size() && !decodable_) ||
      first > limit / sizeof(double))
    return corrupt("its times do not follow those of the step times before it", section,
                   entry.offset);
  limit -= first * sizeof(double);
  const std::uint64_t size = stated_packed_size(in);
  if (has_bounded_blobs() && size > most_unpacked(in.left()))
    return corrupt("unpacks to more bytes than its packed size permits", section, entry.offset);
  if (size > limit) return over_limit("unpacks to more than the limit", section, entry.offset);
  const auto blob = get_packed(in, limit);
  std::vector<double> more;
  if (!blob || !container::get_times(*blob, more, version))
    return corrupt("cannot be unpacked", section, entry.offset);
  if (container::has_digest(version) && digest_of_step_times(more, first) != digest)
    return corrupt(std::string("the decoded times") + kNotTheDigest, section, entry.offset);
  times.resize(static_cast<std::size_t>(first), std::numeric_limits<double>::quiet_NaN());
  times.insert(times.end(), more.begin(), more.end());
  return {};
}

UnpackBudget IndexedFile::budget() const {
  UnpackBudget budget(limits_.max_unpacked_bytes);
  budget.take(bytes_of(schema()));
  return budget;
}

Result<std::vector<Extra>> IndexedFile::read_extras() {
  std::vector<Extra> extras;
  UnpackBudget budget = this->budget();
  for (const IndexEntry& entry : index_.entries) {
    if (entry.kind != static_cast<std::uint8_t>(ChunkKind::extra)) continue;
    std::uint8_t version = 0;
    const auto payload = read_chunk(entry, &version);
    if (!payload) return payload.error();
    auto some = get_extras(*payload, version,
                           std::min(limits_.max_extra_bytes, budget.left(source_->size())));
    if (!some)
      return Error{some.error().code, some.error().detail, container::chunk_name(entry.kind),
                   entry.offset};
    for (const Extra& extra : *some) budget.take(bytes_of(extra));
    std::move(some->begin(), some->end(), std::back_inserter(extras));
  }
  return extras;
}

Result<std::vector<double>> IndexedFile::read_step_times() {
  std::vector<double> times;
  for (const IndexEntry& entry : index_.entries) {
    if (entry.kind != static_cast<std::uint8_t>(ChunkKind::step_times)) continue;
    if (auto status = read_step_times(entry, times); !status) return status.error();
  }
  return times;
}

void IndexedFile::prefetch_groups(std::span<const std::size_t> groups) {
  heads_.clear();
  std::vector<ByteRange> ranges;
  for (const std::size_t group : groups)
    ranges.push_back({groups_[group].offset, groups_[group].bytes});
  source_->prefetch(ranges);
}

/// Returns the total length in bytes of the chunk header and the group header, assuming that the
/// chunk header has the form that writers choose.
std::uint64_t IndexedFile::head_bytes(const IndexEntry& group) const {
  container::ChunkHeader header;
  header.segment = group.segment;
  header.payload_bytes = group.bytes - std::min<std::uint64_t>(group.bytes, kShortHeaderBytes);
  header.is_long = has_long_headers_ || container::has_long_header(header, {});
  return std::min(group.bytes, header.bytes() + group.header_bytes);
}

void IndexedFile::prefetch_streams(std::span<const std::size_t> groups, const WantsStream& wants) {
  constexpr std::size_t kMostHeads = 1 << 14, kMostBytes = std::size_t{1} << 22;
  heads_.clear();
  if (groups.size() > kMostHeads) return;
  std::size_t held = 0;
  std::vector<ByteRange> ranges;
  for (const std::size_t group : groups)
    ranges.push_back({groups_[group].offset, head_bytes(groups_[group])});
  source_->prefetch(ranges);
  ranges.clear();
  for (const std::size_t group : groups) {
    auto head = read_group_head(group);
    if (!head) return;
    held += head->bytes.size();
    if (held > kMostBytes) break;
    for (std::size_t s = 0; s < head->header.streams.size(); ++s)
      if (wants(head->header, head->header.streams[s]))
        ranges.push_back({head->stream_offset[s], head->header.streams[s].bytes});
    heads_.emplace(group, std::move(*head));
  }
  source_->prefetch(ranges);
}

Result<IndexedFile::GroupHead> IndexedFile::read_group_head(std::size_t group) {
  if (auto ahead = heads_.extract(group)) return std::move(ahead.mapped());
  const IndexEntry& entry = groups_[group];
  const std::string section = "group " + std::to_string(group);
  if (entry.bytes < kShortHeaderBytes || entry.header_bytes > entry.bytes - kShortHeaderBytes ||
      entry.header_bytes > limits_.max_chunk_bytes)
    return corrupt("the index states a wrong header length", section, entry.offset);
  auto bytes = container::read_bytes(*source_, entry.offset, head_bytes(entry), section);
  if (!bytes) return bytes.error();
  const std::uint64_t all = container::header_bytes(*bytes) + entry.header_bytes;
  if (bytes->size() < all &&
      all <= entry.bytes) {  // The chunk header is long although a short header would suffice.
    bytes = container::read_bytes(*source_, entry.offset, all, section);
    if (!bytes) return bytes.error();
  }
  const auto chunk = container::checked_header(*bytes, entry);
  if (!chunk) return chunk.error();
  if (entry.header_bytes > chunk->payload_bytes || bytes->size() < all)
    return corrupt("the index states a wrong header length", section, entry.offset);
  GroupHead head;
  head.payload_offset = entry.offset + chunk->bytes();
  const auto begin = bytes->begin() + static_cast<std::ptrdiff_t>(chunk->bytes());
  head.bytes.assign(begin, begin + static_cast<std::ptrdiff_t>(entry.header_bytes));
  ByteReader in(head.bytes);
  if (!container::get(in, head.header, chunk->version) || in.left() != 0)
    return corrupt("the group header is invalid", section, entry.offset);
  if (auto status = expect_group(group, head.header); !status) return status.error();
  std::uint64_t left = chunk->payload_bytes - entry.header_bytes;
  for (const container::StreamEntry& stream : head.header.streams) {
    head.stream_offset.push_back(entry.offset + entry.bytes - left);
    if (stream.bytes > left)
      return corrupt(container::stream_name(stream.kind) + ": ends beyond the group", section,
                     entry.offset);
    left -= stream.bytes;
  }
  if (left != 0) return corrupt("bytes are left over after the last stream", section, entry.offset);
  return head;
}

Result<std::vector<std::byte>> IndexedFile::read_stream(std::size_t group, const GroupHead& head,
                                                        std::size_t stream) {
  const container::StreamEntry& entry = head.header.streams[stream];
  const std::string section = "group " + std::to_string(group);
  const std::string name = container::stream_name(entry.kind);
  if (entry.bytes > limits_.max_chunk_bytes)
    return over_limit(name + ": " + std::to_string(entry.bytes) + " bytes, but the limit is " +
                          std::to_string(limits_.max_chunk_bytes),
                      section, groups_[group].offset);
  auto bytes = container::read_bytes(*source_, head.stream_offset[stream], entry.bytes, section);
  if (bytes && checksum(*bytes) != entry.checksum)
    return corrupt(name + ": checksum does not match", section, groups_[group].offset);
  return bytes;
}

Result<container::GroupChunk> IndexedFile::read_group(std::size_t group,
                                                      const DecodedParts& parts) {
  const IndexEntry& entry = groups_[group];
  container::GroupChunk out;
  out.offset = entry.offset;
  out.number = group;
  if (parts.has_all_values()) {
    auto whole = read_chunk(entry, &out.version);
    if (!whole) return whole.error();
    out.payload = std::move(*whole);
    return out;
  }
  auto head = read_group_head(group);
  if (!head) return head.error();
  if (entry.offset + entry.bytes - head->payload_offset > limits_.max_chunk_bytes)
    return over_limit("the chunk has " + std::to_string(entry.bytes) + " bytes, but the limit is " +
                          std::to_string(limits_.max_chunk_bytes),
                      "group " + std::to_string(group), entry.offset);
  out.version = head->header.version;
  out.payload = std::move(head->bytes);
  std::vector<std::byte>& payload = out.payload;
  const auto& streams = head->header.streams;
  const std::uint64_t begin = head->payload_offset;
  // Only the bytes up to the end of the last wanted stream are read. If the file is cut off after
  // this stream, the group can still be read.
  std::uint64_t needed = payload.size();
  for (std::size_t s = 0; s < streams.size(); ++s)
    if (parts.includes(streams[s]))
      needed = std::max(needed, head->stream_offset[s] - begin + streams[s].bytes);
  if (needed > source_->size() - std::min(source_->size(), begin))
    return truncated("ends beyond the file", "group " + std::to_string(group), entry.offset);
  payload.resize(static_cast<std::size_t>(needed));
  for (std::size_t s = 0; s < streams.size();) {
    // Adjacent wanted streams are read in one call.
    std::uint64_t bytes = 0;
    std::size_t end = s;
    for (; end < streams.size() && parts.includes(streams[end]); ++end) bytes += streams[end].bytes;
    if (bytes > 0) {
      const auto from = static_cast<std::size_t>(head->stream_offset[s] - begin);
      const auto into = std::span(payload).subspan(from, static_cast<std::size_t>(bytes));
      if (auto status = source_->read_at(head->stream_offset[s], into); !status)
        return status.error();
    }
    s = std::max(end, s + 1);
  }
  return out;
}

// --- opening

Result<void> IndexedFile::read_index() {
  auto place = container::last_index(*source_);
  if (!place && place.error().code == ErrorCode::corrupt)  // not even the first chunk is there
    place = container::last_chunk(*source_, ChunkKind::index);
  if (!place) return place.error();
  index_offset_ = place->offset;
  index_bytes_ = place->bytes;
  const auto read = [&](std::uint64_t offset) -> Result<std::optional<container::Index>> {
    std::uint8_t version = 0;
    const auto payload = container::read_chunk(*source_, *place, limits_.max_chunk_bytes, &version);
    if (!payload) return payload.error();
    container::Index index;
    if (!container::get_index_payload(*payload, index, version, offset, offset / kShortHeaderBytes))
      return corrupt("is invalid", "index", offset);
    if (index.previous_index != 0) *place = index.entries[0];
    return std::optional(std::move(index));
  };
  auto index = container::whole_index(read, index_offset_, index_sizes_);
  if (!index) return index.error();
  if (!*index) return wrong_index("refers to too many indexes");
  index_ = std::move(**index);
  return {};
}

Result<void> IndexedFile::list_groups() {
  for (const IndexEntry& entry : index_.entries) {
    if (entry.kind != static_cast<std::uint8_t>(ChunkKind::group)) continue;
    if (segments_.empty() || entry.segment + 1 != segments_.size()) {
      if (entry.segment != segments_.size() || entry.segment >= limits_.max_segments)
        return wrong_index("its segments are out of order, or there are too many");
      segments_.push_back({entry.first_cell, 0, entry.first_vertex, 0, 0, entry.box});
      first_group_.push_back(groups_.size());
    }
    add_to_segment(entry);
    if (entry.offset > source_->size() || entry.bytes > source_->size() - entry.offset ||
        (!groups_.empty() && entry.offset < groups_.back().offset + groups_.back().bytes))
      return wrong_index("its groups overlap or are out of order");
    groups_.push_back(entry);
  }
  first_group_.push_back(groups_.size());
  return {};
}

/// Adds a group to the last segment.
void IndexedFile::add_to_segment(const IndexEntry& entry) {
  SegmentInfo& segment = segments_.back();
  segment.cells += entry.cells;
  segment.vertices += entry.vertices;
  segment.bytes += entry.bytes;
  for (std::size_t c = 0; c < 3; ++c) {
    segment.box[c] = std::min(segment.box[c], entry.box[c]);
    segment.box[3 + c] = std::max(segment.box[3 + c], entry.box[3 + c]);
  }
}

Result<void> IndexedFile::expect_group(std::size_t group,
                                       const container::GroupHeader& header) const {
  const IndexEntry& entry = groups_[group];
  if (header.cells == entry.cells && header.vertices == entry.vertices &&
      header.first_cell == entry.first_cell && header.first_vertex == entry.first_vertex &&
      header.box == entry.box)
    return {};
  return wrong_index("differs from the header of group " + std::to_string(group));
}

Result<void> IndexedFile::expect_totals() const {
  if (decodable_) return {};  // If some groups are lost, the totals cannot be checked.
  std::uint64_t vertices = 0, cells = 0;
  bool ok = index_.block_cells.size() == schema().blocks.size();
  for (const IndexEntry& group : groups_) {
    ok = ok && group.first_vertex == vertices && group.first_cell == cells &&
         group.vertices <= index_.vertices - vertices && group.cells <= index_.cells - cells;
    if (!ok) break;
    vertices += group.vertices;
    cells += group.cells;
  }
  ok = ok && vertices == index_.vertices && cells == index_.cells;
  for (std::uint64_t of_block : index_.block_cells) {
    ok = ok && of_block <= cells;
    cells -= of_block;
  }
  return ok && cells == 0 ? Result<void>()
                          : wrong_index("the sizes of its groups do not add up to its totals");
}

/// Sets has_long_headers_: all chunk headers are long if the header of the first chunk is long.
/// `bytes` are the first bytes of the file.
void IndexedFile::look_at_beginning(std::span<const std::byte> bytes) {
  const auto first = bytes.subspan(std::min(bytes.size(), container::kFileStartBytes));
  has_long_headers_ = container::header_bytes(first) == kLongHeaderBytes;
}

/// Reads the file start and the first chunk, which is the schema.
Result<void> IndexedFile::read_schema() {
  if (index_.entries.empty() ||
      index_.entries[0].kind != static_cast<std::uint8_t>(ChunkKind::schema) ||
      index_.entries[0].offset != container::kFileStartBytes ||
      index_offset_ < container::kFileStartBytes ||
      index_.entries[0].bytes > index_offset_ - container::kFileStartBytes)
    return wrong_index("does not list the schema");
  constexpr std::uint64_t kPiece = std::uint64_t{1} << 16;
  const std::uint64_t end = container::kFileStartBytes + index_.entries[0].bytes;
  container::ChunkReader file(limits_);
  std::vector<std::byte> bytes;  // bytes that `file` has not consumed yet
  for (std::uint64_t position = 0; position < end;) {
    const std::size_t kept = bytes.size();
    bytes.resize(kept + static_cast<std::size_t>(std::min(kPiece, end - position)));
    const auto piece = std::span(bytes).subspan(kept);
    if (auto status = source_->read_at(position, piece); !status) return status;
    if (position == 0) look_at_beginning(piece);
    position += piece.size();
    std::span<const std::byte> left(bytes);
    auto schema = file.find_schema(left);
    if (!schema) return schema.error();
    if (*schema) {
      schema_ = std::make_unique<const Schema>(std::move(**schema));
      return {};
    }
    bytes.erase(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(left.size()));
  }
  return wrong_index("lists a wrong length of the schema");
}

}  // namespace shm
