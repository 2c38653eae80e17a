// Damage: converts the findings of FoundChunks to the public description of damage.
#include "shm/damage.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "api/index_builder.h"
#include "base/binary.h"
#include "base/errors.h"
#include "format/chunk_writer.h"
#include "format/random_chunks.h"
#include "repair/found_chunks.h"

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

/// Returns true if no chunk that contains data is known to be damaged. Chunks that only state the
/// positions of other chunks, such as the index, may be damaged.
bool has_all_that_is_known(const FoundChunks& found) {
  return found.schema() &&
         std::all_of(found.damages().begin(), found.damages().end(), is_of_locations);
}

/// Returns true if the file can be repaired without rebuilding its index. The first copy of the
/// schema may be lost, because the second copy can replace it.
bool is_restorable(const FoundChunks& found) {
  if (!found.index() || !has_all_that_is_known(found)) return false;
  // Earlier indexes of a live file are not made anew.
  if (std::any_of(found.damages().begin(), found.damages().end(), [](const Damage& damage) {
        return damage.section == "index" &&
               (damage.kind == DamageKind::damaged || damage.kind == DamageKind::missing);
      }))
    return false;
  const auto& entries = found.index()->entries;
  if (entries.empty() || !entries[0].is(ChunkKind::schema)) return false;
  const std::uint64_t schema_bytes = found.beginning().size() - container::kFileStartBytes;
  std::uint64_t end = container::kFileStartBytes;
  for (const IndexEntry& entry : entries) {
    if (entry.is(ChunkKind::schema) && entry.bytes != schema_bytes) return false;
    if (entry.offset != end || entry.bytes > ~std::uint64_t{0} - end) return false;
    end += entry.bytes;
  }
  return true;
}

/// Returns the copy of the file start that the schema chunk contains, or nullopt if all copies of
/// the schema are damaged.
std::optional<container::FileStart> start_of(const FoundChunks& found) {
  container::FileStart start;
  const std::vector<std::byte> beginning = found.beginning();
  ByteReader in(beginning);
  if (!container::get(in, start)) return std::nullopt;
  return start;
}

/// Returns true if the array ranges in the rebuilt index would differ from those in the original
/// index. Only an index of version 0 has ranges. For a quantized array, the original range is that
/// of the values before quantization, which the file does not contain.
bool has_other_ranges(const FoundChunks& found) {
  const auto start = start_of(found);
  if (!found.schema() || !start || container::version_of_chunk(ChunkKind::index, *start) != 0)
    return false;
  const auto& arrays = found.schema()->arrays;
  return std::any_of(arrays.begin(), arrays.end(), [](const ArrayInfo& array) {
    return !array.per_step && array.quantization.lossy();
  });
}

/// Rebuilds the index. If the index is lost, no other part of the file shows whether the chunks
/// just before it are lost, too. Therefore, unless it is certain that no chunks are lost there, the
/// function compares the size of the rebuilt index with the number of bytes after the last known
/// chunk. The two numbers may differ by only a few bytes.
Result<container::Index> index_anew(RandomSource& source, const FoundChunks& found,
                                    const ReadLimits& limits) {
  if (!has_all_that_is_known(found)) return corrupt("some chunks are damaged", "index");
  const auto start = start_of(found);
  if (!start) return corrupt("no copy of the schema is undamaged", "index");
  const std::uint8_t version = container::version_of_chunk(ChunkKind::index, *start);
  auto index = IndexBuilder(source, found, limits, version).make();
  if (!index) return index;
  const std::uint64_t end = found.end_of_chunks();
  const std::uint64_t bytes = container::index_payload(*index, end).size();
  if (bytes > limits.max_chunk_bytes)
    return over_limit("would need " + std::to_string(bytes) + " bytes, but the limit is " +
                          std::to_string(limits.max_chunk_bytes),
                      "index", end);
  // The original index may be a few bytes longer or shorter than the rebuilt index. There are two
  // reasons: another version of zstd compresses differently, and in version 0 the ranges of
  // quantized values differ from those that were written. The difference in size must be smaller
  // than a chunk header, since every chunk is at least that large.
  ChunkHeader header;
  header.payload_bytes = bytes;
  header.is_long = container::has_long_header(header, *start);
  const std::uint64_t wanted =
      header.chunk_bytes() +
      (container::has_trailer_inside(version) ? 0 : container::kTrailerBytes);
  const std::uint64_t left = source.size() - end;
  const bool fills = std::max(left, wanted) - std::min(left, wanted) < header.bytes();
  if (!fills && !found.ends_at_index())
    return corrupt("there may have been more chunks", "index", end);
  return index;
}

/// Copies a chunk to the offset `to` of a file. Corrects the trailer of an index that states
/// another offset.
Result<void> copy_chunk(RandomSource& source, const IndexEntry& chunk, std::uint64_t to,
                        ByteSink& sink) {
  if (!chunk.is(ChunkKind::index)) return sink.copy(source, chunk.offset, chunk.bytes);
  auto bytes = container::read_bytes(source, chunk.offset, chunk.bytes, "index");
  if (!bytes) return bytes.error();
  ByteReader in(*bytes);
  ChunkHeader header;
  if (container::get(in, header) == container::HeaderState::good &&
      container::has_trailer_inside(header.version) &&
      header.payload_bytes >= container::kTrailerBytes) {
    const auto payload = std::span(*bytes).subspan(header.bytes());
    ByteWriter trailer, head;
    container::put_trailer(trailer, to);
    std::copy(trailer.bytes.begin(), trailer.bytes.end(),
              payload.last(container::kTrailerBytes).begin());
    header.payload_checksum = checksum(payload);
    container::put(head, header);
    std::copy(head.bytes.begin(), head.bytes.end(), bytes->begin());
  }
  return sink.write(*bytes);
}

/// Writes the whole file, except the last index and the trailer, in the order of `entries`. The
/// first undamaged schema replaces lost copies of the schema.
Result<void> write_chunks(RandomSource& source, const FoundChunks& found,
                          std::span<const IndexEntry> entries, ByteSink& sink) {
  const std::vector<std::byte> beginning = found.beginning();
  if (auto status = sink.write(beginning); !status) return status;
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
      IndexEntry chunk;
      chunk.kind = chunks[next].header.kind;
      chunk.offset = chunks[next].offset;
      chunk.bytes = chunks[next].bytes();
      if (auto status = copy_chunk(source, chunk, entries[i].offset, sink); !status) return status;
      continue;
    }
    if (!entries[i].is(ChunkKind::schema))
      return corrupt("some chunks are damaged", "index", entries[i].offset);
    ChunkHeader header = first;
    header.sequence = i;
    ByteWriter out;
    container::put(out, header);
    out.put_bytes(schema_again);
    if (auto status = sink.write(out.bytes); !status) return status;
  }
  return {};
}

Result<void> write_with_its_index(RandomSource& source, const FoundChunks& found, ByteSink& sink) {
  if (!is_restorable(found)) return corrupt("some chunks are damaged", "index");
  const auto& entries = found.index()->entries;
  if (auto status = write_chunks(source, found, entries, sink); !status) return status;
  const std::uint64_t end = entries.back().offset + entries.back().bytes;
  IndexEntry last;
  last.kind = static_cast<std::uint8_t>(ChunkKind::index);
  last.offset = found.index_offset();
  last.bytes = found.index_bytes();
  if (auto status = copy_chunk(source, last, end, sink); !status) return status;
  if (!container::has_trailer_inside(found.index()->version)) {
    ByteWriter trailer;
    container::put_trailer(trailer, end);
    if (auto status = sink.write(trailer.bytes); !status) return status;
  }
  return sink.commit();
}

Result<void> write_with_new_index(RandomSource& source, const FoundChunks& found, ByteSink& sink,
                                  const ReadLimits& limits) {
  auto index = index_anew(source, found, limits);
  if (!index) return index.error();
  const auto& entries = index->entries;
  if (auto status = write_chunks(source, found, entries, sink); !status) return status;
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
