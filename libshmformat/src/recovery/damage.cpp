// Damage: what FoundChunks found, as users see it.
#include "shm/damage.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "bytes/binary.h"
#include "container/chunk_writer.h"
#include "recovery/found_chunks.h"
#include "recovery/index_builder.h"

namespace shm {
namespace {

using container::ChunkHeader;
using container::ChunkKind;
using container::IndexEntry;

bool is_of_locations(const Damage& damage) {
  return damage.section == "index" || damage.section == "end record" ||
         damage.section == "file start" || damage.section == "schema" ||
         damage.kind == DamageKind::repeated || damage.kind == DamageKind::out_of_order ||
         damage.kind == DamageKind::stray;
}

/// At most what tells where things are is lost, as far as is found.
bool has_all_that_is_known(const FoundChunks& found) {
  return found.schema() &&
         std::all_of(found.damages().begin(), found.damages().end(), is_of_locations);
}

/// The repeated schema stands for the one that is lost.
bool is_restorable(const FoundChunks& found) {
  if (!found.index() || !has_all_that_is_known(found)) return false;
  const auto& entries = found.index()->entries;
  if (entries.empty() || !entries[0].is(ChunkKind::schema)) return false;
  const std::uint64_t schema_bytes = found.beginning().size() - container::kFileStartBytes;
  std::uint64_t end = container::kFileStartBytes;
  for (const IndexEntry& entry : entries) {
    if (entry.is(ChunkKind::index)) return false;  // which does not list itself
    if (entry.is(ChunkKind::schema) && entry.bytes != schema_bytes) return false;
    if (entry.offset != end || entry.bytes > ~std::uint64_t{0} - end) return false;
    end += entry.bytes;
  }
  return true;
}

Error not_restorable(std::string detail, std::uint64_t offset,
                     ErrorCode code = ErrorCode::corrupt) {
  return Error{code, std::move(detail), "index", offset, {}};
}

/// Which version the file has, as its schema says; nothing where none is whole.
std::optional<container::FileStart> start_of(const FoundChunks& found) {
  container::FileStart start;
  const std::vector<std::byte> beginning = found.beginning();
  ByteReader in(beginning);
  if (!container::get(in, start)) return std::nullopt;
  return start;
}

/// Version 0 has ranges, of arrays within a bound those of values that the file does not hold.
bool has_other_ranges(const FoundChunks& found) {
  const auto start = start_of(found);
  if (!found.schema() || !start || container::version_of_chunk(ChunkKind::index, *start) != 0)
    return false;
  const auto& arrays = found.schema()->arrays;
  return std::any_of(arrays.begin(), arrays.end(), [](const ArrayInfo& array) {
    return !array.per_step && array.quantization.lossy();
  });
}

/// Nobody would miss chunks behind the last one that is known. But they took room: where it is not
/// known that there was none, the index must fill what is left of the file, or nearly so.
Result<container::Index> index_anew(RandomSource& source, const FoundChunks& found,
                                    const ReadLimits& limits) {
  if (!has_all_that_is_known(found)) return not_restorable("not all chunks are whole", kNoOffset);
  const auto start = start_of(found);
  if (!start) return not_restorable("no schema is whole", kNoOffset);
  const std::uint8_t version = container::version_of_chunk(ChunkKind::index, *start);
  auto index = IndexBuilder(source, found, limits, version).make();
  if (!index) return index;
  ByteWriter payload;
  container::put(payload, *index);
  const std::uint64_t bytes = payload.bytes.size(), end = found.end_of_chunks();
  if (bytes > limits.max_chunk_bytes)
    return not_restorable("would take " + std::to_string(bytes) + " bytes, the limit is " +
                              std::to_string(limits.max_chunk_bytes),
                          end, ErrorCode::over_limit);
  // Another version of zstd packs otherwise, and of version 0 ranges of what is restored differ
  // from those of what was written: the index may have had some bytes more or less, but not so many
  // as a chunk has.
  ChunkHeader header;
  header.payload_bytes = bytes;
  header.is_long = container::has_long_header(header, *start);
  const std::uint64_t wanted = header.chunk_bytes() + container::kTrailerBytes;
  const std::uint64_t left = source.size() - end;
  const bool fills = std::max(left, wanted) - std::min(left, wanted) < header.bytes();
  if (!fills && !found.ends_at_index())
    return not_restorable("perhaps there were more chunks", end);
  return index;
}

/// All but the index and the trailer, in the order of `entries`; the first schema stands for others
/// that are lost.
Result<void> write_chunks(RandomSource& source, const FoundChunks& found,
                          std::span<const IndexEntry> entries, ByteSink& sink) {
  const std::vector<std::byte> beginning = found.beginning();
  if (auto good = sink.write(beginning); !good) return good;
  ByteReader in(beginning);
  container::FileStart start;
  ChunkHeader first;
  container::get(in, start);
  container::get(in, first);
  const auto schema_again = in.get_bytes(in.left());
  const auto& chunks = found.chunks();
  std::size_t next = 0;
  for (std::uint32_t i = 1; i < entries.size(); ++i) {
    while (next < chunks.size() && chunks[next].header.sequence < i) ++next;
    if (next < chunks.size() && chunks[next].header.sequence == i && chunks[next].whole) {
      if (auto good = sink.copy(source, chunks[next].offset, chunks[next].bytes()); !good)
        return good;
      continue;
    }
    if (!entries[i].is(ChunkKind::schema))
      return not_restorable("not all chunks are whole", entries[i].offset);
    ChunkHeader header = first;
    header.sequence = i;
    ByteWriter out;
    container::put(out, header);
    out.put_bytes(schema_again);
    if (auto good = sink.write(out.bytes); !good) return good;
  }
  return {};
}

Result<void> write_with_its_index(RandomSource& source, const FoundChunks& found, ByteSink& sink) {
  if (!is_restorable(found)) return not_restorable("not all chunks are whole", kNoOffset);
  const auto& entries = found.index()->entries;
  if (auto good = write_chunks(source, found, entries, sink); !good) return good;
  if (auto good = sink.copy(source, found.index_offset(), found.index_bytes()); !good) return good;
  ByteWriter trailer;
  container::put_trailer(trailer, entries.back().offset + entries.back().bytes);
  if (auto good = sink.write(trailer.bytes); !good) return good;
  return sink.commit();
}

Result<void> write_with_new_index(RandomSource& source, const FoundChunks& found, ByteSink& sink,
                                  const ReadLimits& limits) {
  auto index = index_anew(source, found, limits);
  if (!index) return index.error();
  const auto& entries = index->entries;
  if (auto good = write_chunks(source, found, entries, sink); !good) return good;
  container::ChunkWriter end(sink);
  end.go_on({entries.back().offset + entries.back().bytes,
             static_cast<std::uint32_t>(entries.size()), entries},
            *start_of(found));
  return end.finish(std::move(*index));
}

}  // namespace

Result<DamageReport> find_damage(RandomSource& source, const ReadLimits& limits) {
  auto found = FoundChunks::of(source, limits);
  if (!found) return found.error();
  DamageReport report;
  report.damages = found->damages();
  report.schema = found->schema();
  report.restorable = is_restorable(*found);
  report.lacks_index = !found->index() && has_all_that_is_known(*found);
  report.has_other_ranges = report.lacks_index && has_other_ranges(*found);
  report.complete = has_all_that_is_known(*found) && found->ends_at_index();
  if (found->index()) {
    report.vertices = found->index()->vertices;
    report.cells = found->index()->cells;
    report.steps = found->index()->steps;
  }
  return report;
}

Result<void> write_in_order(RandomSource& source, ByteSink& sink, const ReadLimits& limits) {
  const auto found = FoundChunks::of(source, limits);
  if (!found) return found.error();
  return found->index() ? write_with_its_index(source, *found, sink)
                        : write_with_new_index(source, *found, sink, limits);
}

}  // namespace shm
