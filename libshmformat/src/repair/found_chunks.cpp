#include "repair/found_chunks.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/binary.h"
#include "base/errors.h"
#include "format/chunk_reader.h"
#include "format/random_chunks.h"

namespace shm {

using container::ChunkHeader;
using container::ChunkKind;
using container::FoundChunk;
using container::IndexEntry;

namespace {

bool fits(const FoundChunk& chunk, std::uint32_t sequence, const IndexEntry& listed) {
  return chunk.header.sequence == sequence && chunk.header.kind == listed.kind &&
         chunk.bytes() == listed.bytes && chunk.header.segment == listed.segment;
}

bool holds_the_same(const FoundChunk& a, const FoundChunk& b) {
  return a.header.kind == b.header.kind && a.header.segment == b.header.segment &&
         a.header.payload_bytes == b.header.payload_bytes &&
         a.header.payload_checksum == b.header.payload_checksum;
}

Damage damage_of(DamageKind kind, const FoundChunk& chunk, std::uint64_t size) {
  Damage damage{kind, container::chunk_name(chunk.header.kind), chunk.offset, 0};
  damage.bytes = std::min(chunk.bytes(), size - chunk.offset);
  if (chunk.is(ChunkKind::group)) damage.segment = chunk.header.segment;
  return damage;
}

/// Returns the number of pairs of an array and a step in an entry for a bundle; 0 for other
/// entries.
std::uint64_t pairs_of(const container::StepEntry& part) {
  return part.codec == container::kBundleCodec ? part.arrays * part.steps : 0;
}

}  // namespace

Result<FoundChunks> FoundChunks::of(RandomSource& source, const ReadLimits& limits) {
  FoundChunks known(source, limits);
  if (auto status = known.read(); !status) return status.error();
  return known;
}

Result<void> FoundChunks::read() {
  auto scan = container::scan_chunks(*source_, limits_.max_chunk_bytes);
  if (!scan) return scan.error();
  scan_ = std::move(*scan);
  drop_uncommitted();
  if (!scan_.start && scan_.chunks.empty()) return corrupt("contains no part of a .shm file");
  if (std::any_of(scan_.chunks.begin(), scan_.chunks.end(),
                  [](const FoundChunk& chunk) { return chunk.is(ChunkKind::members); }) ||
      (scan_.start && (scan_.start->needed_features & container::kArchiveFeature) != 0))
    return unsupported("is an archive of several files");
  for (const FoundChunk& chunk : scan_.chunks)
    if (chunk.whole && !container::is_known(chunk.header) &&
        (chunk.header.flags & container::kChunkOptional) == 0)
      return unsupported("this reader does not support the chunk, and the chunk is not optional",
                         container::chunk_name(chunk.header.kind), chunk.offset);
  if (auto status = find_schema(); !status) return status;
  if (auto status = find_index(); !status) return status;
  judge_start();
  if (auto status = index_ ? judge_by_index() : judge_by_numbers(); !status) return status;
  judge_end();
  std::stable_sort(damages_.begin(), damages_.end(),
                   [](const Damage& a, const Damage& b) { return a.offset < b.offset; });
  return {};
}

/// Removes the chunks after the last index if the file has no later index: the program that wrote
/// the file ended before it committed them. An index that extends beyond the end of the file does
/// not count.
void FoundChunks::drop_uncommitted() {
  auto& chunks = scan_.chunks;
  const auto last = std::find_if(chunks.rbegin(), chunks.rend(), [&](const FoundChunk& chunk) {
    return chunk.is(ChunkKind::index) && container::is_known(chunk.header) &&
           chunk.bytes() <= source_->size() - chunk.offset;
  });
  if (last == chunks.rend() || last == chunks.rbegin() || !last->whole ||
      !container::has_trailer_inside(last->header.version) ||
      scan_.index_offset.value_or(0) > last->offset)
    return;
  chunks.erase(last.base(), chunks.end());
  scan_.end = chunks.back().offset + chunks.back().bytes();
  scan_.trailer = true;
}

Result<std::vector<std::byte>> FoundChunks::payload_of(const FoundChunk& chunk,
                                                       std::uint64_t most) {
  const std::uint64_t begin = chunk.offset + chunk.header.bytes();
  // Reads at most the bytes before the next chunk, even if the header states a larger size. All
  // payloads together are then not larger than the file.
  std::vector<std::byte> payload(static_cast<std::size_t>(
      std::min({most, chunk.header.payload_bytes, chunk.room - chunk.header.bytes()})));
  if (auto status = source_->read_at(begin, payload); !status) return status.error();
  return payload;
}

/// Finds the first undamaged copy of the schema. Fails if the copies differ: the file then consists
/// of parts of two files, and the schema of one file does not describe the values of the other.
Result<void> FoundChunks::find_schema() {
  const FoundChunk* first = nullptr;
  for (const FoundChunk& chunk : scan_.chunks) {
    if (!chunk.whole || !chunk.is(ChunkKind::schema)) continue;
    if (first != nullptr && !holds_the_same(*first, chunk))
      return corrupt("differs from the copy at byte " + std::to_string(first->offset) +
                         ": the file consists of parts of two files",
                     "schema", chunk.offset);
    if (first == nullptr) first = &chunk;
  }
  if (first != nullptr) {
    const FoundChunk& chunk = *first;
    auto payload = payload_of(chunk, limits_.max_chunk_bytes);
    if (!payload) return payload.error();
    schema_payload_ = std::move(*payload);
    has_long_headers_ = chunk.header.is_long;
    const std::vector<std::byte> bytes = beginning();
    std::span<const std::byte> left(bytes);
    auto schema = container::ChunkReader(limits_).find_schema(left);
    if (!schema && schema.error().code != ErrorCode::corrupt) return schema.error();
    if (schema) schema_ = std::move(*schema);
    if (!schema_) schema_payload_.clear();
  }
  return {};
}

std::vector<std::byte> FoundChunks::beginning() const {
  ByteReader in(schema_payload_);
  container::FileStart start;
  container::get_version(in, start);
  ByteWriter out;
  container::put(out, start);
  ChunkHeader header;
  header.kind = static_cast<std::uint8_t>(ChunkKind::schema);
  header.payload_bytes = schema_payload_.size();
  header.payload_checksum = checksum(schema_payload_);
  header.is_long = has_long_headers_ || container::has_long_header(header, start);
  container::put(out, header);
  out.put_bytes(schema_payload_);
  return std::move(out.bytes);
}

/// Returns the index that was written at `offset`, even if its chunk is elsewhere now. Returns
/// nullopt if it is damaged.
Result<std::optional<container::Index>> FoundChunks::index_written_at(std::uint64_t offset) {
  for (const FoundChunk& chunk : scan_.chunks) {
    if (!chunk.whole || !chunk.is(ChunkKind::index) || written_at(chunk) != offset) continue;
    const auto payload = payload_of(chunk, limits_.max_chunk_bytes);
    if (!payload) return payload.error();
    container::Index index;
    const std::uint64_t most = std::min<std::uint64_t>(
        chunk.header.sequence, source_->size() / container::kShortHeaderBytes);
    if (container::get_index_payload(*payload, index, chunk.header.version, offset, most))
      return std::optional(std::move(index));
  }
  return std::optional<container::Index>();
}

/// Returns the offset at which an index chunk was written, as its trailer states.
std::uint64_t FoundChunks::written_at(const FoundChunk& index) {
  std::array<std::byte, container::kTrailerBytes> end{};
  const bool inside = container::has_trailer_inside(index.header.version) &&
                      index.header.payload_bytes >= end.size() &&
                      source_->read_at(index.offset + index.bytes() - end.size(), end);
  return inside ? container::offset_in_index(end).value_or(kNoOffset) : index.offset;
}

Result<void> FoundChunks::find_index() {
  if (scan_.chunks.empty()) return {};
  const FoundChunk& last = scan_.chunks.back();
  if (!last.whole || !last.is(ChunkKind::index)) return {};
  // If only the last index of a live file is lost, the index before it does not list all chunks.
  if (scan_.index_offset == last.offset + last.bytes()) return {};
  std::vector<std::size_t> sizes;
  const auto read = container::whole_index(
      [this](std::uint64_t offset) { return index_written_at(offset); }, written_at(last), sizes);
  if (!read) return read.error();
  if (!*read || (*read)->entries.size() != last.header.sequence) return {};
  container::Index index = **read;
  std::uint64_t pairs = 0;
  for (const IndexEntry& entry : index.entries)
    for (const container::StepEntry& part : entry.parts) pairs += pairs_of(part);
  if (pairs > container::most_bundle_pairs(source_->size())) return {};
  const auto contradicted = is_contradicted(index);
  if (!contradicted) return contradicted.error();
  if (*contradicted) return {};
  index_ = std::move(index);
  index_offset_ = last.offset;
  return {};
}

/// Returns true if all chunks are undamaged but the index does not match them. The index is then
/// wrong.
Result<bool> FoundChunks::is_contradicted(const container::Index& index) {
  container::ChunkList list;
  std::uint64_t end = container::kFileStartBytes;
  for (std::size_t i = 0; i + 1 < scan_.chunks.size(); ++i) {
    const FoundChunk& chunk = scan_.chunks[i];
    if (!chunk.whole || chunk.header.sequence != i || chunk.offset != end) return false;
    end += chunk.bytes();
  }
  if (end != scan_.chunks.back().offset) return false;
  for (std::size_t i = 0; i + 1 < scan_.chunks.size(); ++i) {
    const FoundChunk& chunk = scan_.chunks[i];
    const bool is_group = chunk.is(ChunkKind::group), has_steps = chunk.is(ChunkKind::step_values);
    if (!container::is_known(chunk.header) || !(is_group || has_steps)) {
      list.add(chunk.header);
      continue;
    }
    const auto payload =
        payload_of(chunk, is_group ? limits_.max_chunk_bytes : container::kMostStepHeadBytes);
    if (!payload) return payload.error();
    ByteReader in(*payload);
    container::GroupHeader group;
    std::vector<container::StepPart> parts;
    if (is_group ? !container::get(in, group, chunk.header.version)
                 : !container::get(in, parts, chunk.header.version, chunk.header.payload_bytes))
      return false;  // this damage is reported elsewhere
    if (is_group)
      list.add_group(chunk.header, group, in.position());
    else
      list.add_step_values(chunk.header, parts);
  }
  return list.difference(index).has_value();
}

// --- with an index

Result<void> FoundChunks::judge_by_index() {
  const std::vector<FoundChunk>& found = scan_.chunks;
  // Undamaged chunks by chunk number. The index is not included.
  std::vector<std::size_t> by_number(found.size() - 1);
  for (std::size_t i = 0; i < by_number.size(); ++i) by_number[i] = i;
  std::erase_if(by_number, [&](std::size_t i) { return !found[i].whole; });
  std::stable_sort(by_number.begin(), by_number.end(), [&](std::size_t a, std::size_t b) {
    return found[a].header.sequence < found[b].header.sequence;
  });
  std::vector<bool> taken(found.size());
  for (std::uint32_t i = 0; i < index_->entries.size(); ++i) {
    const IndexEntry& listed = index_->entries[i];
    const auto place = std::lower_bound(
        found.begin(), found.end(), listed.offset,
        [](const FoundChunk& chunk, std::uint64_t offset) { return chunk.offset < offset; });
    const bool there =
        place != found.end() && place->offset == listed.offset && fits(*place, i, listed);
    if (there && place->whole) {
      taken[static_cast<std::size_t>(place - found.begin())] = true;
      if (auto status = take(*place, &listed); !status) return status;
      continue;
    }
    auto other = std::lower_bound(
        by_number.begin(), by_number.end(), i,
        [&](std::size_t k, std::uint32_t n) { return found[k].header.sequence < n; });
    if (other != by_number.end() && fits(found[*other], i, listed)) {
      taken[*other] = true;
      damages_.push_back(damage_of(DamageKind::out_of_order, found[*other], source_->size()));
      if (auto status = take(found[*other], &listed); !status) return status;
    } else if (there) {
      if (auto status = take(*place, &listed); !status) return status;
    } else {
      add_lost(listed);
    }
  }
  for (const std::size_t i : by_number)
    if (!taken[i])
      damages_.push_back(damage_of(found[i].header.sequence < index_->entries.size()
                                       ? DamageKind::repeated
                                       : DamageKind::stray,
                                   found[i], source_->size()));
  return {};
}

/// Reports a chunk that the index lists but that was not found in the file.
void FoundChunks::add_lost(const IndexEntry& listed) {
  const std::uint64_t size = source_->size();
  Damage damage{DamageKind::damaged, container::chunk_name(listed.kind), listed.offset, 0};
  damage.bytes = listed.offset < size ? std::min(listed.bytes, size - listed.offset) : 0;
  // If an undamaged chunk overlaps the position of the lost chunk, the bytes of the lost chunk are
  // not in the file. It is then reported as missing instead of damaged.
  const auto& found = scan_.chunks;
  const auto next = std::lower_bound(
      found.begin(), found.end(), listed.offset,
      [](const FoundChunk& chunk, std::uint64_t offset) { return chunk.offset < offset; });
  const bool before = next != found.begin() && std::prev(next)->whole &&
                      std::prev(next)->offset + std::prev(next)->bytes() > listed.offset;
  const bool within =
      next != found.end() && next->whole && next->offset < listed.offset + damage.bytes;
  if (before || within || damage.bytes == 0) {
    damage.kind = DamageKind::missing;
    damage.bytes = 0;
  }
  if (listed.is(ChunkKind::group)) {
    damage.segment = listed.segment;
    damage.first_cell = listed.first_cell;
    damage.cells = listed.cells;
  }
  add_damage(std::move(damage), listed.parts);
}

/// Reports damage to a chunk. Damage to step values is reported once per array and step.
void FoundChunks::add_damage(Damage damage, const std::vector<container::StepEntry>& parts) {
  if (parts.empty()) {
    damages_.push_back(std::move(damage));
    return;
  }
  for (const container::StepEntry& part : parts)
    for (std::uint64_t s = 0; s < part.steps; ++s)
      for (std::uint32_t a = 0; a < part.arrays; ++a) {
        damage.arrays = {part.array + a};
        damage.step = part.step + s;
        damages_.push_back(damage);
        damage.chunks = 0;
      }
}

// --- files without an index: damage is found from the chunk headers

Result<void> FoundChunks::judge_by_numbers() {
  std::vector<std::size_t> order(scan_.chunks.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto& found = scan_.chunks;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const FoundChunk &x = found[a], &y = found[b];
    return x.header.sequence != y.header.sequence ? x.header.sequence < y.header.sequence
                                                  : x.whole > y.whole;
  });
  const FoundChunk* before = nullptr;
  std::uint64_t farthest = 0;
  for (const std::size_t i : order) {
    const FoundChunk& chunk = found[i];
    if (before != nullptr && before->header.sequence == chunk.header.sequence) {
      if (chunk.whole && !holds_the_same(*before, chunk))
        return corrupt("has the same number as the chunk at byte " +
                           std::to_string(before->offset) +
                           ", but different contents: the file consists of parts of two files",
                       container::chunk_name(chunk.header.kind), chunk.offset);
      if (chunk.whole) damages_.push_back(damage_of(DamageKind::repeated, chunk, source_->size()));
      continue;
    }
    // judge_end() handles the last index. Version 0 has only one index, the last chunk.
    const bool is_end = chunk.is(ChunkKind::index) && &chunk == &found.back();
    if (chunk.is(ChunkKind::index) && !is_end &&
        !container::has_trailer_inside(chunk.header.version))
      continue;
    if (chunk.offset < farthest)
      damages_.push_back(damage_of(DamageKind::out_of_order, chunk, source_->size()));
    add_gap(before, chunk);
    farthest = std::max(farthest, chunk.offset + chunk.bytes());
    if (!is_end)
      if (auto status = take(chunk, nullptr); !status) return status;
    before = &chunk;
  }
  return {};
}

/// Reports a gap between two chunks: either chunk numbers are missing between them, or there are
/// bytes between them.
void FoundChunks::add_gap(const FoundChunk* before, const FoundChunk& after) {
  const std::uint64_t end =
      before == nullptr ? container::kFileStartBytes : before->offset + before->bytes();
  const std::uint64_t chunks =
      after.header.sequence - (before == nullptr ? 0 : std::uint64_t{before->header.sequence} + 1);
  const std::uint64_t bytes = end < after.offset ? after.offset - end : 0;
  // Bytes after a damaged chunk are not reported, because they are part of the damage of that
  // chunk, which has been reported already.
  if (chunks == 0 && (bytes == 0 || (before != nullptr && !before->whole))) return;
  Damage damage{DamageKind::damaged, "chunk", std::min(end, source_->size()), bytes};
  damage.chunks = chunks;
  if (chunks == 0) damage.kind = DamageKind::stray;
  if (bytes == 0) damage.kind = DamageKind::missing;
  if (before == nullptr && chunks == 1) damage.section = container::chunk_name(1);
  if (chunks > 0 && damage.section == "chunk") unplaced_.push_back(damages_.size());
  damages_.push_back(std::move(damage));
}

/// For each Damage entry between the previous readable group and `after`, records the cells that
/// are missing between these two groups.
void FoundChunks::guess_cells(const FoundGroup& after) {
  const std::uint64_t end = group_before_ ? group_before_->end_cell() : 0;
  for (const std::size_t i : unplaced_) {
    if (after.entry.first_cell <= end) continue;
    damages_[i].first_cell = end;
    damages_[i].cells = after.entry.first_cell - end;
    if (group_before_ && group_before_->entry.segment == after.entry.segment)
      damages_[i].segment = after.entry.segment;
  }
  unplaced_.clear();
  group_before_ = after;
}

// --- chunks

/// Records a chunk, damaged or undamaged, by its number.
Result<void> FoundChunks::take(const FoundChunk& chunk, const IndexEntry* listed) {
  std::optional<Damage> damage;
  if (!chunk.whole) damage = damage_of(DamageKind::damaged, chunk, source_->size());
  if (chunk.is(ChunkKind::group)) {
    auto looked = look_at_group(chunk);
    if (!looked) return looked.error();
    FoundGroup& group = *looked;
    if (chunk.whole && !group.has_mesh)
      damage = damage_of(DamageKind::damaged, chunk, source_->size());
    if (damage && listed != nullptr) {
      damage->first_cell = listed->first_cell;
      damage->cells = listed->cells;
    } else if (damage && group.readable) {
      damage->first_cell = group.entry.first_cell;
      damage->cells = group.entry.cells;
    }
    if (damage) damage->arrays = group.lost_arrays;
    if (group.readable && listed == nullptr) guess_cells(group);
    groups_.push_back(std::move(group));
  } else if (chunk.is(ChunkKind::step_values)) {
    if (chunk.whole)
      if (auto status = take_parts(chunk); !status) return status;
  }
  if (damage) {
    if (chunk.is(ChunkKind::group) && !damage->first_cell) unplaced_.push_back(damages_.size());
    add_damage(std::move(*damage),
               listed == nullptr ? std::vector<container::StepEntry>() : listed->parts);
  }
  chunks_.push_back(chunk);
  return {};
}

/// Determines which bitstreams of a group are undamaged.
Result<FoundGroup> FoundChunks::look_at_group(const FoundChunk& chunk) {
  FoundGroup group;
  group.sequence = chunk.header.sequence;
  group.entry.kind = chunk.header.kind;
  group.entry.segment = chunk.header.segment;
  group.entry.offset = chunk.offset;
  group.entry.bytes = chunk.bytes();
  if (chunk.header.payload_bytes > limits_.max_chunk_bytes) return group;
  const auto payload = payload_of(chunk, chunk.header.payload_bytes);
  if (!payload) return payload.error();
  ByteReader in(*payload);
  container::GroupHeader header;
  if (!container::get(in, header, chunk.header.version)) return group;
  group.readable = true;
  group.entry.first_cell = header.first_cell;
  group.entry.cells = header.cells;
  group.entry.first_vertex = header.first_vertex;
  group.entry.vertices = header.vertices;
  group.entry.box = header.box;
  group.entry.header_bytes = in.position();
  if (header.first_cell > ~std::uint64_t{0} - header.cells) return group;
  bool mesh = true;
  for (const container::StreamEntry& stream : header.streams) {
    const auto bytes = in.get_bytes(stream.bytes);
    if (in.ok() && (chunk.whole || checksum(bytes) == stream.checksum)) continue;
    // If a group refers to an array that does not exist, the group belongs to another file.
    if (stream.kind == container::StreamKind::array && schema_ &&
        stream.array < schema_->arrays.size())
      group.lost_arrays.push_back(stream.array);
    else
      mesh = false;
  }
  group.has_mesh = mesh && (in.ok() ? in.left() == 0 : !chunk.whole);
  if (!group.has_mesh) group.lost_arrays.clear();
  std::sort(group.lost_arrays.begin(), group.lost_arrays.end());
  return group;
}

Result<void> FoundChunks::take_parts(const FoundChunk& chunk) {
  const auto bytes = payload_of(chunk, container::kMostStepHeadBytes);
  if (!bytes) return bytes.error();
  ByteReader in(*bytes);
  std::vector<container::StepPart> parts;
  if (!container::get(in, parts, chunk.header.version, chunk.header.payload_bytes)) return {};
  std::uint64_t pairs = 0;
  for (const container::StepPart& part : parts) pairs += pairs_of(container::entry_of(part.header));
  if (pairs > container::most_bundle_pairs(source_->size()) - bundle_pairs_) {
    damages_.push_back(damage_of(DamageKind::damaged, chunk, source_->size()));
    return {};
  }
  bundle_pairs_ += pairs;
  for (const container::StepPart& part : parts)
    parts_.push_back({chunk.header.sequence, chunk.offset, chunk.bytes(),
                      container::entry_of(part.header), part.header.reference_step});
  return {};
}

// --- beginning and end

void FoundChunks::judge_start() {
  const std::uint64_t bytes = std::min<std::uint64_t>(container::kFileStartBytes, source_->size());
  bool ok = scan_.start.has_value();
  if (ok && !schema_payload_.empty()) {
    ByteReader in(schema_payload_);
    container::FileStart again;
    container::get_version(in, again);
    ok = *scan_.start == again;
  }
  if (!ok) damages_.push_back({DamageKind::damaged, "file start", 0, bytes});
}

void FoundChunks::judge_end() {
  const std::uint64_t size = source_->size();
  if (index_) {
    // A trailer at the end of the file that points to a later index belongs to this file, too.
    const std::uint64_t end = scan_.chunks.back().offset + scan_.chunks.back().bytes();
    if (container::has_trailer_inside(index_->version) && end < size &&
        scan_.index_offset.value_or(0) > index_offset_)
      damages_.push_back({DamageKind::damaged, "chunk", end, size - end});
    if (scan_.trailer) return;
    const std::uint64_t after = scan_.chunks.back().offset + scan_.chunks.back().bytes();
    damages_.push_back({after < size ? DamageKind::damaged : DamageKind::missing, "end record",
                        after, std::min<std::uint64_t>(size - after, container::kTrailerBytes)});
    return;
  }
  std::uint64_t end = end_of_chunks();
  if (chunks_.empty()) {  // the end of the schema is unknown
    damages_.push_back(
        {end < size ? DamageKind::damaged : DamageKind::missing, "schema", end, size - end});
    end = size;
  }
  damages_.push_back(
      {end < size ? DamageKind::damaged : DamageKind::missing, "index", end, size - end});
  if (!scan_.index_offset && !(end < size && scan_.trailer))
    damages_.push_back({DamageKind::missing, "end record", size, 0});
}

std::uint64_t FoundChunks::end_of_chunks() const {
  const std::uint64_t size = source_->size();
  std::uint64_t end = std::min<std::uint64_t>(container::kFileStartBytes, size);
  for (const FoundChunk& chunk : chunks_)
    end = std::max(end, std::min(size, chunk.offset + chunk.bytes()));
  return end;
}

bool FoundChunks::ends_at_index() const {
  if (index_) return true;
  if (scan_.index_offset && *scan_.index_offset == end_of_chunks()) return true;
  return !scan_.chunks.empty() && !chunks_.empty() && scan_.chunks.back().is(ChunkKind::index) &&
         scan_.chunks.back().header.sequence == chunks_.back().header.sequence + 1;
}

}  // namespace shm
