#include "format/chunk_reader.h"

#include <algorithm>
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
    case State::header: chunk_offset_ = begin; return read_header(ByteReader(bytes));
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
                     std::to_string(start_.minor) + " is not one that this reader knows",
                 ErrorCode::unsupported);
  if ((start_.needed_features & kArchiveFeature) != 0)
    return wrong("is an archive of several files, each with its own mesh", ErrorCode::unsupported);
  if ((start_.needed_features & ~kKnownFeatures) != 0)
    return wrong("needs features " + std::to_string(start_.needed_features) +
                     " that this reader does not know",
                 ErrorCode::unsupported);
  section_ = "chunk header";
  state_ = State::header;
  return {};
}

Result<void> ChunkReader::read_header(ByteReader in) {
  section_ = "chunk header";
  switch (get(in, header_)) {
    case HeaderState::good: break;
    case HeaderState::bad_mark: return wrong("no chunk begins here");
    case HeaderState::bad_checksum: return wrong("checksum of the chunk header does not match");
  }
  section_ = chunk_name(header_.kind);
  if (header_.sequence != next_sequence_++)
    return wrong("a chunk is missing or out of order before this one");
  if (header_.payload_bytes > limits_.max_chunk_bytes)
    return wrong("a chunk of " + std::to_string(header_.payload_bytes) + " bytes, the limit is " +
                     std::to_string(limits_.max_chunk_bytes),
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
    return wrong("this reader does not know the chunk, which is not optional",
                 ErrorCode::unsupported);
  return {};
}

void ChunkReader::expect_trailer() {
  section_ = "end record";
  state_ = State::trailer;
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
    return wrong("version or features differ from the start of the file");
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
        "unpacks to " + std::to_string(size) + " bytes, the limit is " + std::to_string(limit),
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

}  // namespace shm::container
