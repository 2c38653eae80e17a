// Damage: what KnownChunks found, as users see it.
#include "shm/damage.h"

#include <algorithm>
#include <span>
#include <utility>

#include "bytes/checksum.h"
#include "container/chunk_writer.h"
#include "index_maker.h"
#include "known_chunks.h"

namespace shm {
namespace {

using container::ChunkHeader;
using container::ChunkKind;
using container::IndexEntry;

bool is_where_things_are(const Damage& damage) {
  return damage.section == "index" || damage.section == "end record" ||
         damage.section == "file start" || damage.section == "schema" ||
         damage.kind == DamageKind::repeated || damage.kind == DamageKind::out_of_order ||
         damage.kind == DamageKind::stray;
}

/// At most what tells where things are is lost, as far as is known.
bool has_all_that_is_known(const KnownChunks& known) {
  return known.schema() &&
         std::all_of(known.damages().begin(), known.damages().end(), is_where_things_are);
}

/// The schema said again stands for the one that is lost.
bool is_restorable(const KnownChunks& known) {
  if (!known.index() || !has_all_that_is_known(known)) return false;
  const auto& entries = known.index()->entries;
  if (entries.empty() || !entries[0].is(ChunkKind::schema)) return false;
  const std::uint64_t schema_bytes = known.beginning().size() - container::kFileStartBytes;
  std::uint64_t end = container::kFileStartBytes;
  for (const IndexEntry& entry : entries) {
    if (entry.is(ChunkKind::index)) return false;  // which does not list itself
    if (entry.is(ChunkKind::schema) && entry.bytes != schema_bytes) return false;
    if (entry.offset != end || entry.bytes > ~std::uint64_t{0} - end) return false;
    end += entry.bytes;
  }
  return true;
}

/// Nobody would miss chunks behind the last one that is known. But they took room: where it is not
/// known that there was none, the index must fill what is left of the file.
Result<container::Index> index_anew(RandomSource& source, const KnownChunks& known,
                                    const ReadLimits& limits) {
  IndexMaker maker(source, known, limits);
  auto index = maker.make();
  const std::uint64_t room = source.size() - known.end_of_chunks();
  if (index && !known.ends_at_index() &&
      room != container::kChunkHeaderBytes + maker.payload_bytes() + container::kTrailerBytes)
    return Error{
        ErrorCode::corrupt, "perhaps there were more chunks", "index", known.end_of_chunks(), {}};
  return index;
}

}  // namespace

Result<DamageReport> find_damage(RandomSource& source, const ReadLimits& limits) {
  auto known = KnownChunks::of(source, limits);
  if (!known) return known.error();
  DamageReport report;
  report.damages = known->damages();
  report.schema = known->schema();
  report.restorable = is_restorable(*known);
  report.lacks_index = !known->index() && has_all_that_is_known(*known);
  report.complete = has_all_that_is_known(*known) && known->ends_at_index();
  if (known->index()) {
    report.vertices = known->index()->vertices;
    report.cells = known->index()->cells;
    report.steps = known->index()->steps;
  }
  return report;
}

Result<void> write_in_order(RandomSource& source, ByteSink& sink, const ReadLimits& limits) {
  const auto known = KnownChunks::of(source, limits);
  if (!known) return known.error();
  const auto corrupt = [](std::uint64_t offset) {
    return Error{ErrorCode::corrupt, "not all chunks are whole", "index", offset, {}};
  };
  if (known->index() ? !is_restorable(*known) : !has_all_that_is_known(*known))
    return corrupt(kNoOffset);
  std::optional<container::Index> anew;
  if (!known->index()) {
    auto made = index_anew(source, *known, limits);
    if (!made) return made.error();
    anew = std::move(*made);
  }
  const std::vector<std::byte> beginning = known->beginning();
  if (auto good = sink.write(beginning); !good) return good;
  const auto& chunks = known->chunks();
  const auto& entries = (anew ? *anew : *known->index()).entries;
  const auto schema_again =
      std::span(beginning).subspan(container::kFileStartBytes + container::kChunkHeaderBytes);
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < entries.size(); ++i) {
    while (next < chunks.size() && chunks[next].header.sequence < i) ++next;
    if (i == 0) continue;
    if (next < chunks.size() && chunks[next].header.sequence == i && chunks[next].whole) {
      if (auto good = sink.copy(source, chunks[next].offset, chunks[next].bytes()); !good)
        return good;
      continue;
    }
    if (entries[i].kind != static_cast<std::uint8_t>(ChunkKind::schema))
      return corrupt(entries[i].offset);
    ChunkHeader header;
    header.kind = entries[i].kind;
    header.sequence = i;
    header.payload_bytes = schema_again.size();
    header.payload_checksum = checksum(schema_again);
    ByteWriter out;
    container::put(out, header);
    out.put_bytes(schema_again);
    if (auto good = sink.write(out.bytes); !good) return good;
  }
  const std::uint64_t offset = entries.back().offset + entries.back().bytes;
  if (anew) {
    container::ChunkWriter end(sink);
    end.go_on({offset, static_cast<std::uint32_t>(entries.size()), entries});
    return end.finish(std::move(*anew));
  }
  if (auto good = sink.copy(source, known->index_offset(), known->index_bytes()); !good)
    return good;
  ByteWriter trailer;
  container::put_trailer(trailer, offset);
  return sink.write(trailer.bytes);
}

}  // namespace shm
