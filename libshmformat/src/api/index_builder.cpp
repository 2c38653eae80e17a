#include "api/index_builder.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <variant>
#include <vector>

#include "base/errors.h"
#include "format/schema.h"

namespace shm {

using container::ChunkKind;
using container::FoundChunk;
using container::IndexEntry;

namespace {

Error not_all(std::uint64_t offset) { return corrupt("some chunks are damaged", "index", offset); }

}  // namespace

IndexBuilder::IndexBuilder(RandomSource& source, const FoundChunks& found, const ReadLimits& limits,
                           std::uint8_t version)
    : source_(&source), found_(&found), decoder_(limits) {
  index_.version = version;
  if (version > 0) return;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto& arrays = found.schema()->arrays;
  for (std::uint32_t a = 0; a < arrays.size(); ++a) {
    const std::size_t n = arrays[a].components;
    if (!arrays[a].per_step)
      index_.ranges.push_back(
          {a, std::vector<double>(n, kInfinity), std::vector<double>(n, -kInfinity)});
  }
}

Result<container::Index> IndexBuilder::make() {
  const std::vector<std::byte> beginning = found_->beginning();
  IndexEntry schema;
  schema.kind = static_cast<std::uint8_t>(ChunkKind::schema);
  schema.offset = container::kFileStartBytes;
  schema.bytes = beginning.size() - container::kFileStartBytes;
  index_.entries.push_back(schema);
  if (auto status = decode(beginning); !status) return status.error();
  for (const FoundChunk& chunk : found_->chunks()) {
    if (chunk.header.sequence == 0 && chunk.is(ChunkKind::schema))
      continue;  // The schema was decoded together with the file start.
    if (auto status = add(chunk); !status) return status.error();
  }
  auto made = decoder_.held();
  if (!made) return made.error();
  made->version = container::with_digest(index_.version, container::has_digest(made->version));
  made->ranges = std::move(index_.ranges);
  made->entries = std::move(index_.entries);
  return made;
}

Result<void> IndexBuilder::add(const FoundChunk& chunk) {
  auto entry = entry_of(chunk);
  if (!entry) return entry.error();
  entry->offset = index_.entries.back().offset + index_.entries.back().bytes;
  index_.entries.push_back(*entry);
  const std::size_t pieces = pieces_;
  constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20;
  std::vector<std::byte> bytes;
  for (std::uint64_t done = 0; done < chunk.bytes(); done += bytes.size()) {
    bytes.resize(static_cast<std::size_t>(std::min(kPieceBytes, chunk.bytes() - done)));
    if (auto status = source_->read_at(chunk.offset + done, bytes); !status) return status;
    if (auto status = decode(bytes); !status) return status;
  }
  std::uint64_t expected = 0;
  for (const container::StepEntry& part : index_.entries.back().parts)
    expected += part.arrays * part.steps;
  if (pieces_ != pieces + expected) return not_all(chunk.offset);
  return {};
}

/// Returns the index entry of a chunk, without its offset. If the chunk contains step values, the
/// field `first` of the entry is not set either.
Result<IndexEntry> IndexBuilder::entry_of(const FoundChunk& chunk) {
  if (!chunk.whole || chunk.header.sequence != index_.entries.size()) return not_all(chunk.offset);
  IndexEntry entry;
  entry.kind = chunk.header.kind;
  entry.bytes = chunk.bytes();
  if (chunk.is(ChunkKind::group)) {
    const FoundGroup& group = found_->groups()[groups_++];
    if (!container::is_known(chunk.header) || !group.readable) return not_all(chunk.offset);
    return group.entry;
  }
  if (chunk.is(ChunkKind::step_values)) {
    const auto& parts = found_->parts();
    for (; parts_ < parts.size() && parts[parts_].sequence == chunk.header.sequence; ++parts_)
      entry.parts.push_back(parts[parts_].values);
    if (!container::is_known(chunk.header) || entry.parts.empty()) return not_all(chunk.offset);
    piece_of_chunk_ = 0;
  }
  return entry;
}

Result<void> IndexBuilder::decode(std::span<const std::byte> bytes) {
  if (auto status = decoder_.feed(bytes); !status) return status;
  while (true) {
    const auto progress = decoder_.advance();
    if (!progress) return progress.error();
    if (*progress != Decoder::Progress::item_ready) return {};
    const Item item = decoder_.take();
    if (const auto* block = std::get_if<MeshBlock>(&item)) widen_ranges(*block);
    if (const auto* piece = std::get_if<StepPiece>(&item)) {
      auto& parts = index_.entries.back().parts;
      if (piece_of_chunk_ < parts.size()) parts[piece_of_chunk_++].first = piece->first;
      ++pieces_;
    }
  }
}

void IndexBuilder::widen_ranges(const MeshBlock& block) {
  for (container::ArrayRange& range : index_.ranges) {
    const ArrayInfo& info = found_->schema()->arrays[range.array];
    const std::vector<std::byte>& values = block.arrays[range.array];
    const std::size_t width = scalar_bytes(info.type), stride = width * info.components;
    for (std::size_t c = 0; c < info.components && !values.empty(); ++c) {
      const ValueRange more =
          range_of(info.type, values.data() + c * width, values.size() / stride, stride);
      range.minimum[c] = std::min(range.minimum[c], more.minimum);
      range.maximum[c] = std::max(range.maximum[c], more.maximum);
    }
  }
}

}  // namespace shm
