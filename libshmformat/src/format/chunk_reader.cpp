#include "format/chunk_reader.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "format/schema.h"

namespace shm::container {

Error ChunkReader::wrong(std::string detail, ErrorCode code) const {
  return Error{code, std::move(detail), section_, chunk_offset_};
}

std::size_t ChunkReader::wanted(std::span<const std::byte> beginning) const {
  switch (state_) {
    case State::start: return kFileStartBytes;
    case State::header:
    case State::after_index:
      return beginning.size() < kShortHeaderBytes ? kShortHeaderBytes : header_bytes(beginning);
    case State::payload: return static_cast<std::size_t>(header_.payload_bytes);
    case State::trailer: return kTrailerBytes;
    case State::behind_end: break;
  }
  return 0;
}

Result<void> ChunkReader::read(std::span<const std::byte> bytes) {
  const std::uint64_t begin = std::exchange(offset_, offset_ + bytes.size());
  switch (state_) {
    case State::start: return read_start(ByteReader(bytes));
    case State::header:
    case State::after_index: chunk_offset_ = begin; return read_header(ByteReader(bytes));
    case State::payload: return read_payload(bytes);
    case State::trailer: return read_trailer(ByteReader(bytes));
    case State::behind_end: break;
  }
  return {};
}

Result<void> ChunkReader::read_start(ByteReader in) {
  if (!get(in, start_)) return wrong("this is not a .shm file");
  if (!is_known_version(start_))
    return wrong("format version " + std::to_string(start_.major) + "." +
                     std::to_string(start_.minor) + " is not supported by this reader",
                 ErrorCode::unsupported);
  if ((start_.needed_features & kArchiveFeature) != 0)
    return wrong("is an archive of several files, each with its own mesh", ErrorCode::unsupported);
  if ((start_.needed_features & ~kKnownFeatures) != 0)
    return wrong("the file needs features " + std::to_string(start_.needed_features) +
                     ", which this reader does not support",
                 ErrorCode::unsupported);
  section_ = "chunk header";
  state_ = State::header;
  return {};
}

Result<void> ChunkReader::read_header(ByteReader in) {
  section_ = "chunk header";
  switch (get(in, header_)) {
    case HeaderState::good: break;
    case HeaderState::bad_mark: return wrong("no chunk begins at this position");
    case HeaderState::bad_checksum: return wrong("checksum of the chunk header does not match");
  }
  section_ = chunk_name(header_.kind);
  if (header_.sequence != next_sequence_++)
    return wrong("a chunk before this chunk is missing or out of order");
  if (header_.payload_bytes > limits_.max_chunk_bytes)
    return wrong("the chunk has " + std::to_string(header_.payload_bytes) +
                     " bytes, but the limit is " + std::to_string(limits_.max_chunk_bytes),
                 ErrorCode::over_limit);
  if (!has_schema_ && header_.kind != static_cast<std::uint8_t>(ChunkKind::schema))
    return wrong("the first chunk is not the schema");
  state_ = State::payload;
  return {};
}

Result<void> ChunkReader::read_payload(std::span<const std::byte> payload) {
  state_ = State::header;
  if (checksum(payload) != header_.payload_checksum)
    return wrong("checksum of the chunk does not match");
  if (!is_known(header_) && (header_.flags & kChunkOptional) == 0)
    return wrong("this reader does not support the chunk, and the chunk is not optional",
                 ErrorCode::unsupported);
  return {};
}

void ChunkReader::end_index() {
  if (has_trailer_inside(header_.version)) {
    state_ = State::after_index;
    return;
  }
  section_ = "end record";
  state_ = State::trailer;
}

bool ChunkReader::is_next_header(std::span<const std::byte> bytes) const {
  ByteReader in(bytes);
  ChunkHeader next;
  return get(in, next) == HeaderState::good && next.sequence == next_sequence_;
}

Result<void> ChunkReader::read_trailer(ByteReader in) {
  std::uint64_t index_offset = 0;
  if (!get_trailer(in, index_offset) || index_offset != chunk_offset_)
    return wrong("the last 16 bytes do not point to the index");
  state_ = State::behind_end;
  return {};
}

Result<Schema> ChunkReader::read_schema(std::span<const std::byte> payload) {
  ByteReader in(payload);
  FileStart again;
  get_version(in, again);
  if (!in.ok() || again != start_)
    return wrong("version or features differ from those at the start of the file");
  const auto blob = unpack(in, limits_.max_chunk_bytes);
  if (!blob) return blob.error();
  ByteReader fields(*blob);
  Schema schema;
  ReadLimits limits = limits_;
  limits.max_unpacked_bytes = budget();
  if (auto status = get(fields, schema, limits); !status)
    return wrong(status.error().detail, status.error().code);
  budget_.take(bytes_of(schema));
  schema.earlier_values = has_earlier_values(start_);
  if (auto status = check_schema(schema, limits_); !status) {
    const bool limit = status.error().code == ErrorCode::over_limit;
    return wrong(status.error().detail, limit ? ErrorCode::over_limit : ErrorCode::corrupt);
  }
  has_schema_ = true;
  return schema;
}

Result<std::vector<std::byte>> ChunkReader::unpack(ByteReader& in, std::uint64_t limit) const {
  const std::uint64_t size = stated_packed_size(in);
  if (has_bounded_blobs(start_) && size > most_unpacked(in.left()))
    return wrong("unpacks to more bytes than its packed size permits");
  limit = std::min(limit, budget());
  if (size > limit)
    return wrong(
        "unpacks to " + std::to_string(size) + " bytes, but the limit is " + std::to_string(limit),
        ErrorCode::over_limit);
  auto blob = get_packed(in, limit);
  if (!blob) return wrong("cannot be unpacked");
  return std::move(*blob);
}

Result<std::optional<Schema>> ChunkReader::find_schema(std::span<const std::byte>& bytes) {
  std::optional<Schema> found;
  while (!found && bytes.size() >= wanted(bytes)) {
    const auto part = bytes.first(wanted(bytes));
    bytes = bytes.subspan(part.size());
    const bool payload = state_ == State::payload;
    if (auto status = read(part); !status) return status.error();
    if (!payload || !is_known(header_)) continue;
    auto schema = read_schema(part);
    if (!schema) return schema.error();
    found = std::move(*schema);
  }
  return found;
}

namespace {

/// Converts the compact records of a ChunkList back to index entries.
class EntryReader {
 public:
  /// Reads the records of the chunks from `offset` on.
  EntryReader(std::span<const std::byte> lines, std::uint64_t offset)
      : in_(lines), offset_(offset) {}

  struct Line {
    IndexEntry entry;
    bool is_known = false;
  };
  Line next();

 private:
  ByteReader in_;
  std::uint64_t offset_, cells_ = 0, vertices_ = 0;
  StepEntry part_before_;
  bool has_part_ = false;
};

EntryReader::Line EntryReader::next() {
  Line line;
  IndexEntry& entry = line.entry;
  entry.kind = in_.get_u8();
  line.is_known = in_.get_u8() != 0;
  entry.offset = offset_;
  entry.bytes = in_.get_varint();
  offset_ += entry.bytes;
  if (!line.is_known) return line;
  if (entry.is(ChunkKind::group)) {
    entry.segment = in_.get_varint32();
    entry.first_cell = cells_;
    entry.cells = in_.get_varint();
    cells_ += entry.cells;
    entry.first_vertex = vertices_;
    entry.vertices = in_.get_varint();
    vertices_ += entry.vertices;
    for (double& side : entry.box) in_.get_f64(side);
    entry.header_bytes = in_.get_varint();
  } else if (entry.is(ChunkKind::step_values)) {
    for (std::uint64_t parts = in_.get_varint(); parts > 0 && in_.ok(); --parts) {
      StepEntry part;
      part.array = in_.get_varint32();
      part.step = in_.get_varint();
      part.group = in_.get_varint32();
      part.count = in_.get_varint();
      part.reference = static_cast<StepReference>(in_.get_u8());
      part.codec = static_cast<Codec>(in_.get_u8());
      part.arrays = in_.get_varint32();
      part.steps = in_.get_varint();
      if (has_part_ && part_before_.array == part.array && part_before_.step == part.step)
        part.first = part_before_.first + part_before_.count;
      part_before_ = part;
      has_part_ = true;
      entry.parts.push_back(part);
    }
  }
  return line;
}

/// Returns the name of the first field in which two index entries differ, or an empty string.
std::string_view difference_of(const StepEntry& listed, const StepEntry& there) {
  if (listed.array != there.array) return "array";
  if (listed.step != there.step) return "step";
  if (listed.arrays != there.arrays) return "count of arrays";
  if (listed.steps != there.steps) return "count of steps";
  if (listed.first != there.first) return "first element";
  if (listed.count != there.count) return "count of elements";
  if (listed.group != there.group) return "group";
  if (listed.reference != there.reference) return "reference";
  return listed.codec != there.codec ? "codec" : "";
}

std::string_view difference_of(const IndexEntry& listed, const EntryReader::Line& line) {
  const IndexEntry& there = line.entry;
  if (listed.kind != there.kind) return "kind";
  if (listed.offset != there.offset) return "offset";
  if (listed.bytes != there.bytes) return "length";
  if (!line.is_known) return "";
  if (listed.segment != there.segment) return "segment";
  if (listed.first_cell != there.first_cell) return "first cell";
  if (listed.cells != there.cells) return "count of cells";
  if (listed.first_vertex != there.first_vertex) return "first vertex";
  if (listed.vertices != there.vertices) return "count of vertices";
  if (listed.box != there.box) return "box";
  if (listed.header_bytes != there.header_bytes) return "header length";
  if (listed.parts.size() != there.parts.size()) return "count of parts";
  for (std::size_t p = 0; p < there.parts.size(); ++p)
    if (const auto field = difference_of(listed.parts[p], there.parts[p]); !field.empty())
      return field;
  return "";
}

}  // namespace

void ChunkList::put_chunk(const ChunkHeader& header, bool is_known) {
  lines_.put_u8(header.kind);
  lines_.put_u8(is_known ? 1 : 0);
  lines_.put_varint(header.chunk_bytes());
  end_ += header.chunk_bytes();
  ++count_;
}

void ChunkList::add_index(const ChunkHeader& header, std::uint64_t previous_index) {
  const IndexPosition* const before = index_at(previous_index);
  indexes_.push_back(
      {end_, count_, lines_.bytes.size(), before == nullptr ? 1 : before->followed + 1});
  put_chunk(header, true);
}

const ChunkList::IndexPosition* ChunkList::index_at(std::uint64_t offset) const {
  const auto found = std::lower_bound(
      indexes_.begin(), indexes_.end(), offset,
      [](const IndexPosition& index, std::uint64_t wanted) { return index.offset < wanted; });
  return found != indexes_.end() && found->offset == offset ? &*found : nullptr;
}

void ChunkList::add(const ChunkHeader& header) { put_chunk(header, container::is_known(header)); }

void ChunkList::add_group(const ChunkHeader& header, const GroupHeader& group,
                          std::uint64_t header_bytes) {
  put_chunk(header, true);
  lines_.put_varint(header.segment);
  lines_.put_varint(group.cells);
  lines_.put_varint(group.vertices);
  for (const double side : group.box) lines_.put_f64(side);
  lines_.put_varint(header_bytes);
}

void ChunkList::add_step_values(const ChunkHeader& header, std::span<const StepPart> parts) {
  put_chunk(header, true);
  lines_.put_varint(parts.size());
  for (const StepPart& part : parts) {
    const StepEntry entry = entry_of(part.header);
    lines_.put_varint(entry.array);
    lines_.put_varint(entry.step);
    lines_.put_varint(entry.group);
    lines_.put_varint(entry.count);
    lines_.put_u8(static_cast<std::uint8_t>(entry.reference));
    lines_.put_u8(static_cast<std::uint8_t>(entry.codec));
    lines_.put_varint(entry.arrays);
    lines_.put_varint(entry.steps);
  }
}

std::optional<std::string> ChunkList::difference(const Index& index) const {
  IndexPosition from{kFileStartBytes, 0, 0, 0};
  if (index.previous_index != 0) {
    const IndexPosition* const before = index_at(index.previous_index);
    if (before == nullptr)
      return "refers to an index at byte " + std::to_string(index.previous_index) +
             ", where no index begins";
    if (before->followed == kMostIndexes) return "refers to too many indexes";
    from = *before;
  }
  const auto& entries = index.entries;
  if (entries.size() != count_ - from.count)
    return "lists " + std::to_string(entries.size()) + " chunks, but the file has " +
           std::to_string(count_ - from.count);
  EntryReader lines(std::span(lines_.bytes).subspan(from.line), from.offset);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const EntryReader::Line line = lines.next();
    const std::string_view field = difference_of(entries[i], line);
    if (!field.empty())
      return "entry " + std::to_string(i) + ", of the " + chunk_name(line.entry.kind) +
             " at byte " + std::to_string(line.entry.offset) + ", has a different " +
             std::string(field);
  }
  return std::nullopt;
}

}  // namespace shm::container
