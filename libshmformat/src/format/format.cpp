#include "format/format.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/binary.h"
#include "base/packing.h"

namespace shm::container {

std::string chunk_name(std::uint8_t kind) {
  switch (static_cast<ChunkKind>(kind)) {
    case ChunkKind::schema: return "schema";
    case ChunkKind::group: return "group";
    case ChunkKind::step_values: return "step values";
    case ChunkKind::step_times: return "step times";
    case ChunkKind::extra: return "extra";
    case ChunkKind::index: return "index";
    case ChunkKind::members: return "members";
  }
  return "chunk of kind " + std::to_string(kind);
}

std::string stream_name(StreamKind kind) {
  switch (kind) {
    case StreamKind::connectivity: return "connectivity";
    case StreamKind::corner_order: return "corner order";
    case StreamKind::cell_numbers: return "cell numbers";
    case StreamKind::vertex_numbers: return "vertex numbers";
    case StreamKind::geometry: return "geometry";
    case StreamKind::array: return "array";
    case StreamKind::imports: return "imports";
  }
  return "unknown stream";
}

void put_version(ByteWriter& out, const FileStart& start) {
  out.put_u16(start.major);
  out.put_u16(start.minor);
  out.put_u32(start.needed_features);
}
void get_version(ByteReader& in, FileStart& start) {
  start.major = in.get_u16();
  start.minor = in.get_u16();
  start.needed_features = in.get_u32();
}

void put(ByteWriter& out, const FileStart& start) {
  for (std::uint8_t byte : kSignature) out.put_u8(byte);
  put_version(out, start);
}
bool get(ByteReader& in, FileStart& start) {
  bool ok = true;
  for (std::uint8_t byte : kSignature) ok &= in.get_u8() == byte;
  get_version(in, start);
  return ok && in.ok();
}

bool has_long_header(const ChunkHeader& header, const FileStart& start) {
  return start.minor < 10 || header.kind >= 16 || header.version >= 8 ||
         header.flags > kChunkOptional || header.segment >= 1u << 16 ||
         header.payload_bytes >= 1u << 24;
}

std::size_t header_bytes(std::span<const std::byte> beginning) {
  ByteReader in(beginning);
  return in.get_u32() == kLongMark ? kLongHeaderBytes : kShortHeaderBytes;
}

void put(ByteWriter& out, const ChunkHeader& header) {
  ByteWriter head;
  head.put_u32(header.is_long ? kLongMark : kShortMark);
  if (header.is_long) {
    head.put_u8(header.kind);
    head.put_u8(header.version);
    head.put_u8(header.flags);
    head.put_u8(0);
    head.put_u32(header.sequence);
    head.put_u32(header.segment);
    head.put_u64(header.payload_bytes);
  } else {
    const auto fields =
        static_cast<unsigned>(header.kind | header.version << 4 | header.flags << 7);
    head.put_u32(fields | static_cast<std::uint32_t>(header.payload_bytes) << 8);
    head.put_u32(header.sequence);
    head.put_u16(static_cast<std::uint16_t>(header.segment));
  }
  head.put_u32(header.payload_checksum);
  head.put_u32(checksum(head.bytes));
  out.put_bytes(head.bytes);
}

HeaderState get(ByteReader& in, ChunkHeader& header) {
  ByteReader ahead = in;
  header.is_long = ahead.get_u32() == kLongMark;
  const auto bytes = in.get_bytes(std::min<std::size_t>(header.bytes(), in.left()));
  ByteReader head(bytes);
  const std::uint32_t mark = head.get_u32();
  if (mark != kLongMark && mark != kShortMark) return HeaderState::bad_mark;
  if (header.is_long) {
    header.kind = head.get_u8();
    header.version = head.get_u8();
    header.flags = head.get_u8();
    head.get_u8();  // skips the reserved byte, which is always zero; the checksum covers this byte
    header.sequence = head.get_u32();
    header.segment = head.get_u32();
    header.payload_bytes = head.get_u64();
  } else {
    const std::uint32_t fields = head.get_u32();
    header.kind = fields & 15;
    header.version = fields >> 4 & 7;
    header.flags = fields >> 7 & 1;
    header.payload_bytes = fields >> 8;
    header.sequence = head.get_u32();
    header.segment = head.get_u16();
  }
  header.payload_checksum = head.get_u32();
  const std::uint32_t stated = head.get_u32();
  return head.ok() && stated == checksum(bytes.first(bytes.size() - 4)) ? HeaderState::good
                                                                        : HeaderState::bad_checksum;
}
bool is_known_version(ChunkKind kind, std::uint8_t version) {
  if (has_digest(version)) {
    const bool may_have_digest = kind == ChunkKind::group || kind == ChunkKind::step_values ||
                                 kind == ChunkKind::step_times || kind == ChunkKind::index;
    if (!may_have_digest || version == kWithDigest) return false;
    version = without_digest(version);
  }
  return version <= (kind == ChunkKind::step_values ? kBundleVersion : version_of_chunk(kind, {}));
}
bool is_known(const ChunkHeader& header) {
  return header.kind >= static_cast<std::uint8_t>(ChunkKind::schema) &&
         header.kind <= static_cast<std::uint8_t>(ChunkKind::index) &&
         is_known_version(static_cast<ChunkKind>(header.kind), header.version) &&
         (header.segment == 0 || header.kind == static_cast<std::uint8_t>(ChunkKind::group));
}

// --- short numbers and differences

namespace {

/// Writes a double in short form: the number of bytes, then the bytes, beginning with the byte that
/// contains the sign. Trailing zero bytes are omitted.
void put_short(ByteWriter& out, double number) {
  auto bits = std::bit_cast<std::uint64_t>(number);
  const int bytes = 8 - (bits == 0 ? 8 : std::countr_zero(bits) / 8);
  out.put_u8(static_cast<std::uint8_t>(bytes));
  for (int i = 0; i < bytes; ++i, bits <<= 8) out.put_u8(static_cast<std::uint8_t>(bits >> 56));
}
double get_short(ByteReader& in) {
  const std::uint8_t count = in.get_u8();
  // fails if `count` is above 8
  const auto bytes = in.get_bytes(count <= 8 ? count : ~std::uint64_t{0});
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bits |= std::to_integer<std::uint64_t>(bytes[i]) << (56 - 8 * i);
  return std::bit_cast<double>(bits);
}

void put_difference(ByteWriter& out, std::uint64_t number, std::uint64_t before) {
  out.put_signed(static_cast<std::int64_t>(number - before));
}
std::uint64_t get_difference(ByteReader& in, std::uint64_t before) {
  return before + static_cast<std::uint64_t>(in.get_signed());
}
void get_difference(ByteReader& in, std::uint32_t before, std::uint32_t& number) {
  number = static_cast<std::uint32_t>(get_difference(in, before));
}

}  // namespace

// --- groups

void put(ByteWriter& payload, const GroupHeader& header) {
  ByteWriter out;
  if (has_digest(header.version)) out.put_u64(header.digest);
  out.put_varint(header.first_cell);
  out.put_varint(header.first_vertex);
  out.put_varint(header.cells);
  out.put_varint(header.vertices);
  out.put_varint(header.imported_vertices);
  out.put_varint(header.unused_vertices);
  out.put_varint(header.max_active_vertices);
  out.put_varint(header.decoded_bytes);
  for (double side : header.box) header.version == 0 ? out.put_f64(side) : put_short(out, side);
  out.put_varint(header.streams.size());
  for (const StreamEntry& stream : header.streams) {
    out.put_u8(static_cast<std::uint8_t>(stream.kind));
    if (stream.kind == StreamKind::array) out.put_varint(stream.array);
    out.put_u8(static_cast<std::uint8_t>(stream.codec));
    if (header.version == 0) out.put_varint(stream.needs);
    out.put_varint(stream.bytes);
    out.put_u32(stream.checksum);
  }
  out.put_u32(checksum(out.bytes));
  payload.put_bytes(out.bytes);
}
bool get(ByteReader& in, GroupHeader& header, std::uint8_t version) {
  const std::size_t begin = in.position();
  header.version = version;
  header.digest = has_digest(version) ? in.get_u64() : 0;
  header.first_cell = in.get_varint();
  header.first_vertex = in.get_varint();
  const std::uint64_t cells = in.get_varint();
  header.cells = static_cast<std::uint32_t>(cells);
  header.vertices = in.get_varint();
  header.imported_vertices = in.get_varint();
  header.unused_vertices = in.get_varint();
  header.max_active_vertices = in.get_varint();
  header.decoded_bytes = in.get_varint();
  for (double& side : header.box) side = version == 0 ? in.get_f64() : get_short(in);
  header.streams.clear();
  const std::uint64_t streams = in.get_count(7);
  for (std::uint64_t i = 0; i < streams && in.ok(); ++i) {
    StreamEntry stream;
    stream.kind = static_cast<StreamKind>(in.get_u8());
    if (stream.kind == StreamKind::array) stream.array = in.get_varint32();
    stream.codec = static_cast<Codec>(in.get_u8());
    if (version == 0) stream.needs = in.get_varint32();
    stream.bytes = in.get_varint();
    stream.checksum = in.get_u32();
    header.streams.push_back(stream);
  }
  const std::uint32_t sum = checksum(in.since(begin));
  return in.get_u32() == sum && in.ok() && cells <= kMaxGroupCells &&
         header.unused_vertices <= header.vertices;
}

// --- step values: a chunk has one part in version 0, any number of parts in version 1

namespace {

void put_only(ByteWriter& out, const StepHeader& header) {
  out.put_varint(header.array);
  out.put_varint(header.step);
  out.put_varint(header.reference_step);
  out.put_u8(header.reference == StepReference::trend ? 1 : 0);
  out.put_varint(header.group);
  out.put_varint(header.count);
  out.put_u8(static_cast<std::uint8_t>(header.codec));
}
bool get_only(ByteReader& in, StepHeader& header) {
  header.array = in.get_varint32();
  header.step = in.get_varint();
  header.reference_step = in.get_varint();
  const std::uint8_t trend = in.get_u8();
  const bool refers = header.reference_step != header.step;
  header.reference = !refers      ? StepReference::nothing
                     : trend != 0 ? StepReference::trend
                                  : StepReference::before;
  header.group = in.get_varint32();
  header.count = in.get_varint();
  header.codec = static_cast<Codec>(in.get_u8());
  return in.ok() && trend <= (refers ? 1 : 0) && header.codec != kBundleCodec;
}

/// Number of kinds of references to other steps.
constexpr std::uint64_t kReferences = 3;

/// Returns the number by which a file states the reference of step values: 0 if they have none.
/// Otherwise it combines the kind of the reference and the distance to the reference step.
std::uint64_t reference_number(const StepHeader& header) {
  if (header.reference == StepReference::nothing) return 0;
  const std::uint64_t back = header.step - header.reference_step;
  return kReferences * (back - 1) + static_cast<std::uint64_t>(header.reference);
}
bool take_reference(std::uint64_t number, StepHeader& header) {
  header.reference_step = header.step;
  header.reference = StepReference::nothing;
  if (number == 0) return true;
  const std::uint64_t back = (number - 1) / kReferences + 1;
  header.reference_step = header.step - back;
  header.reference = static_cast<StepReference>((number - 1) % kReferences + 1);
  return back <= header.step;
}

void put_part(ByteWriter& out, const StepPart& part, const StepHeader& before) {
  const StepHeader& header = part.header;
  put_difference(out, header.array, before.array);
  put_difference(out, header.step, before.step);
  put_difference(out, header.group, before.group);
  out.put_varint(header.count);
  out.put_varint(reference_number(header));
  out.put_u8(static_cast<std::uint8_t>(header.codec));
  out.put_varint(part.bytes);
}
bool get_part(ByteReader& in, StepPart& part, const StepHeader& before) {
  StepHeader& header = part.header;
  get_difference(in, before.array, header.array);
  header.step = get_difference(in, before.step);
  get_difference(in, before.group, header.group);
  header.count = in.get_varint();
  const bool refers = take_reference(in.get_varint(), header);
  header.codec = static_cast<Codec>(in.get_u8());
  part.bytes = in.get_varint();
  return in.ok() && refers && header.codec != kBundleCodec;
}

void put_bundle(ByteWriter& out, std::span<const StepPart> parts) {
  const StepHeader& first = parts[0].header;
  out.put_varint(first.group);
  out.put_varint(first.step);
  out.put_varint(first.steps);
  out.put_varint(parts.size());
  std::uint32_t next = 0;
  for (const StepPart& part : parts) {
    out.put_varint(part.header.array - next);
    out.put_varint(part.header.arrays);
    out.put_varint(part.header.count);
    next = part.header.array + part.header.arrays;
  }
}
bool get_bundle(ByteReader& in, std::vector<StepPart>& parts, std::uint64_t payload_bytes) {
  StepHeader header;
  header.codec = kBundleCodec;
  header.group = in.get_varint32();
  header.step = header.reference_step = in.get_varint32();
  header.steps = in.get_varint();
  const std::uint64_t count = in.get_varint();
  if (count == 0 || count > kMostStepParts) return false;
  if (header.steps == 0 || header.steps > std::min(kMostBundlePairs, 0x100000000u - header.step))
    return false;
  parts.assign(static_cast<std::size_t>(count), {});
  std::uint64_t next = 0, pairs = 0;
  for (StepPart& part : parts) {
    const std::uint64_t array = next + in.get_varint32();
    header.arrays = in.get_varint32();
    header.count = in.get_varint();
    next = array + header.arrays;
    pairs += header.arrays * header.steps;
    if (header.arrays == 0 || next > 0xffffffffu || header.count == 0 || pairs > kMostBundlePairs)
      return false;
    header.array = static_cast<std::uint32_t>(array);
    part.header = header;
  }
  parts[0].bytes = payload_bytes - std::min<std::uint64_t>(in.position(), payload_bytes);
  return in.ok();
}

}  // namespace

void put(ByteWriter& out, std::span<const StepPart> parts, std::uint8_t version) {
  if (has_digest(version)) {
    std::uint64_t digest = 0;
    for (const StepPart& part : parts) digest += part.digest;
    out.put_u64(digest);
    version = without_digest(version);
  }
  if (version == 0) return put_only(out, parts[0].header);
  if (version == kBundleVersion) return put_bundle(out, parts);
  out.put_varint(parts.size());
  StepHeader before;
  for (const StepPart& part : parts) {
    put_part(out, part, before);
    before = part.header;
  }
}
bool get(ByteReader& in, std::vector<StepPart>& parts, std::uint8_t version,
         std::uint64_t payload_bytes) {
  const std::uint64_t digest = has_digest(version) ? in.get_u64() : 0;
  version = without_digest(version);
  if (version == kBundleVersion) {
    if (!get_bundle(in, parts, payload_bytes)) return false;
    parts[0].digest = digest;
    return true;
  }
  const std::uint64_t count = version == 0 ? 1 : in.get_varint();
  if (count == 0 || count > kMostStepParts) return false;
  parts.assign(static_cast<std::size_t>(count), {});
  StepHeader before;
  std::uint64_t sum = 0;
  for (StepPart& part : parts) {
    if (!(version == 0 ? get_only(in, part.header) : get_part(in, part, before))) return false;
    if (part.header.step > 0xffffffffu || part.header.count == 0) return false;
    before = part.header;
    if (part.bytes > payload_bytes - sum) return false;
    sum += part.bytes;
  }
  const std::uint64_t left = payload_bytes - std::min<std::uint64_t>(in.position(), payload_bytes);
  parts[0].digest = digest;
  if (version == 0) parts[0].bytes = sum = left;
  return in.ok() && sum == left;
}

StepEntry entry_of(const StepHeader& header) {
  return {header.array, header.step,      0,           header.count, header.arrays, header.steps,
          header.group, header.reference, header.codec};
}

// --- step times: version 0 stores them one by one, version 1 as residuals in byte planes

namespace {

/// Returns the bits of the time that is expected after `times`: the previous time plus the
/// difference between the two previous times. An expected time that is not finite is 0.
std::uint64_t expected_time(std::span<const double> times) {
  const std::size_t count = times.size();
  if (count == 0) return 0;
  const double last = times[count - 1];
  const double expected = count == 1 ? last : last + (last - times[count - 2]);
  return std::isfinite(expected) ? std::bit_cast<std::uint64_t>(expected) : 0;
}

}  // namespace

void put_times(ByteWriter& out, std::span<const double> times, std::uint8_t version) {
  if (version == 0) {
    for (const double time : times) out.put_f64(time);
    return;
  }
  for (std::uint32_t b = 0; b < 8; ++b)
    for (std::size_t i = 0; i < times.size(); ++i) {
      const std::uint64_t r =
          std::bit_cast<std::uint64_t>(times[i]) - expected_time(times.first(i));
      out.put_u8(static_cast<std::uint8_t>((r << 1 ^ (0 - (r >> 63))) >> 8 * b));
    }
}

bool get_times(std::span<const std::byte> bytes, std::vector<double>& times, std::uint8_t version) {
  const std::size_t count = bytes.size() / 8;
  if (bytes.size() % 8 != 0) return false;
  times.clear();
  times.reserve(count);
  if (version == 0) {
    for (ByteReader in(bytes); in.left() > 0;) in.get_f64(times.emplace_back());
    return true;
  }
  for (std::size_t i = 0; i < count; ++i) {
    std::uint64_t z = 0;
    for (std::uint32_t b = 0; b < 8; ++b)
      z |= std::to_integer<std::uint64_t>(bytes[b * count + i]) << 8 * b;
    times.push_back(std::bit_cast<double>(expected_time(times) + (z >> 1 ^ (0 - (z & 1)))));
  }
  return true;
}

// --- the index: version 0 stores its entries one by one, version 1 field by field, compressed

void put(ByteWriter& out, std::span<const NamedBytes> streams) {
  out.put_varint(streams.size());
  for (const NamedBytes& stream : streams) {
    out.put_text(stream.name);
    out.put_varint(stream.bytes);
  }
}
bool get(ByteReader& in, std::vector<NamedBytes>& streams) {
  streams.clear();
  for (std::uint64_t n = in.get_count(2); n > 0 && in.ok(); --n) {
    NamedBytes stream;
    stream.name = in.get_text();
    stream.bytes = in.get_varint();
    streams.push_back(std::move(stream));
  }
  return in.ok();
}

namespace {

// --- both versions

void put_totals(ByteWriter& out, const Index& index) {
  for (std::uint64_t v : {index.vertices, index.cells, index.hexahedra, index.max_active_vertices,
                          index.steps, index.segments, index.imported_vertices})
    out.put_varint(v);
  out.put_varint(index.block_cells.size());
  for (std::uint64_t cells : index.block_cells) out.put_varint(cells);
}
void get_totals(ByteReader& in, Index& index) {
  for (std::uint64_t* v :
       {&index.vertices, &index.cells, &index.hexahedra, &index.max_active_vertices, &index.steps,
        &index.segments, &index.imported_vertices})
    *v = in.get_varint();
  for (std::uint64_t n = in.get_count(1); n > 0 && in.ok(); --n)
    index.block_cells.push_back(in.get_varint());
}

// --- version 0

void put_ranges(ByteWriter& out, const Index& index) {
  out.put_varint(index.ranges.size());
  for (const ArrayRange& range : index.ranges) {
    out.put_varint(range.array);
    out.put_varint(range.minimum.size());
    for (std::size_t c = 0; c < range.minimum.size(); ++c) {
      out.put_f64(range.minimum[c]);
      out.put_f64(range.maximum[c]);
    }
  }
}
void get_ranges(ByteReader& in, Index& index) {
  for (std::uint64_t n = in.get_count(2); n > 0 && in.ok(); --n) {
    ArrayRange range;
    range.array = in.get_varint32();
    for (std::uint64_t c = in.get_count(16); c > 0 && in.ok(); --c) {
      range.minimum.push_back(in.get_f64());
      range.maximum.push_back(in.get_f64());
    }
    index.ranges.push_back(std::move(range));
  }
}

void put_lines(ByteWriter& out, const Index& index) {
  out.put_varint(index.previous_index);
  put_totals(out, index);
  put(out, index.streams);
  put_ranges(out, index);
  out.put_varint(index.entries.size());
  for (const IndexEntry& entry : index.entries) {
    out.put_u8(entry.kind);
    out.put_varint(entry.offset);
    out.put_varint(entry.bytes);
    if (entry.is(ChunkKind::group)) {
      out.put_varint(entry.segment);
      for (std::uint64_t v : {entry.first_cell, entry.cells, entry.first_vertex, entry.vertices})
        out.put_varint(v);
      for (double v : entry.box) out.put_f64(v);
      out.put_varint(entry.header_bytes);
    } else if (entry.is(ChunkKind::step_values)) {
      const StepEntry part = entry.parts.empty() ? StepEntry{} : entry.parts[0];
      out.put_varint(part.array);
      for (std::uint64_t v : {part.step, part.first, part.count}) out.put_varint(v);
      out.put_varint(part.group);
      out.put_u8(static_cast<std::uint8_t>(part.reference));
      out.put_u8(static_cast<std::uint8_t>(part.codec));
    }
  }
}

bool get_lines(ByteReader& in, Index& index, std::uint64_t max_entries) {
  index.previous_index = in.get_varint();
  get_totals(in, index);
  get(in, index.streams);
  get_ranges(in, index);
  const std::uint64_t entries = in.get_count(3);
  if (entries > max_entries) return false;
  for (std::uint64_t n = entries; n > 0 && in.ok(); --n) {
    IndexEntry entry;
    entry.kind = in.get_u8();
    entry.offset = in.get_varint();
    entry.bytes = in.get_varint();
    if (entry.is(ChunkKind::group)) {
      entry.segment = in.get_varint32();
      for (std::uint64_t* v :
           {&entry.first_cell, &entry.cells, &entry.first_vertex, &entry.vertices})
        *v = in.get_varint();
      for (double& v : entry.box) v = in.get_f64();
      entry.header_bytes = in.get_varint();
    } else if (entry.is(ChunkKind::step_values)) {
      StepEntry& part = entry.parts.emplace_back();
      part.array = in.get_varint32();
      for (std::uint64_t* v : {&part.step, &part.first, &part.count}) *v = in.get_varint();
      part.group = in.get_varint32();
      part.reference = static_cast<StepReference>(in.get_u8());
      part.codec = static_cast<Codec>(in.get_u8());
    }
    index.entries.push_back(std::move(entry));
  }
  return in.ok() && in.left() == 0;
}

// --- version 1

/// Returns the maximum unpacked size in bytes of an index that may be packed. A larger index is
/// stored without packing.
std::uint64_t most_packed_bytes(std::uint64_t entries) {
  return (std::uint64_t{1} << 20) + 1024 * std::min<std::uint64_t>(entries, std::uint64_t{1} << 40);
}

/// Calls visit(group, previous group) for each group in `entries`. The previous group of the first
/// group is null.
template <class Entries, class Visit>
void for_each_group(Entries& entries, Visit&& visit) {
  decltype(entries.data()) before = nullptr;
  for (auto& entry : entries)
    if (entry.is(ChunkKind::group)) {
      visit(entry, before);
      before = &entry;
    }
}
/// Calls visit(part, previous part) for each part of step values in `entries`. The previous part of
/// the first part is null.
template <class Entries, class Visit>
void for_each_part(Entries& entries, Visit&& visit) {
  decltype(entries.data()->parts.data()) before = nullptr;
  for (auto& entry : entries)
    for (auto& part : entry.parts) {
      visit(part, before);
      before = &part;
    }
}

/// Fields of index entries; each field forms a column. The fields in kCounts are stored unchanged.
/// The fields in kNumbers usually differ little from one entry to the next, so they are stored as
/// differences.
constexpr std::uint64_t IndexEntry::*kCounts[] = {&IndexEntry::cells, &IndexEntry::vertices,
                                                  &IndexEntry::header_bytes};
constexpr std::uint32_t StepEntry::*kNumbers[] = {&StepEntry::array, &StepEntry::group};

void put_columns(ByteWriter& out, const std::vector<IndexEntry>& entries) {
  using Group = const IndexEntry&;
  using Part = const StepEntry&;
  const auto groups = [&](auto&& put_one) { for_each_group(entries, put_one); };
  const auto parts = [&](auto&& put_one) { for_each_part(entries, put_one); };
  out.put_varint(entries.size());
  for (const IndexEntry& entry : entries) out.put_u8(entry.kind);
  for (const IndexEntry& entry : entries) out.put_varint(entry.bytes);
  groups([&](Group entry, const IndexEntry* before) {
    put_difference(out, entry.segment, before == nullptr ? 0 : before->segment);
  });
  for (const auto field : kCounts)
    groups([&](Group entry, const IndexEntry*) { out.put_varint(entry.*field); });
  groups([&](Group entry, const IndexEntry*) {
    for (double side : entry.box) put_short(out, side);
  });
  for (const IndexEntry& entry : entries)
    if (entry.is(ChunkKind::step_values)) out.put_varint(entry.parts.size());
  for (const auto field : kNumbers)
    parts([&](Part entry, const StepEntry* before) {
      put_difference(out, entry.*field, before == nullptr ? 0 : before->*field);
    });
  parts([&](Part entry, const StepEntry* before) {
    put_difference(out, entry.step, before == nullptr ? 0 : before->step);
  });
  parts([&](Part entry, const StepEntry*) { out.put_varint(entry.count); });
  parts([&](Part entry, const StepEntry*) {
    out.put_u8(static_cast<std::uint8_t>(entry.reference));
  });
  parts([&](Part entry, const StepEntry*) { out.put_u8(static_cast<std::uint8_t>(entry.codec)); });
  parts([&](Part entry, const StepEntry*) {
    if (entry.codec != kBundleCodec) return;
    out.put_varint(entry.arrays);
    out.put_varint(entry.steps);
  });
}

bool get_columns(ByteReader& in, Index& index, std::uint64_t max_entries) {
  std::vector<IndexEntry>& entries = index.entries;
  using Group = IndexEntry&;
  using Part = StepEntry&;
  const auto groups = [&](auto&& get_one) { for_each_group(entries, get_one); };
  const auto parts = [&](auto&& get_one) { for_each_part(entries, get_one); };
  const std::uint64_t count = in.get_count(2);
  if (count > max_entries) return false;
  entries.resize(static_cast<std::size_t>(count));
  for (IndexEntry& entry : entries) entry.kind = in.get_u8();
  std::uint64_t end = index.previous_index == 0 ? kFileStartBytes : index.previous_index;
  for (IndexEntry& entry : entries) {
    entry.offset = end;
    entry.bytes = in.get_varint();
    if (entry.bytes < kShortHeaderBytes || entry.bytes > ~std::uint64_t{0} - end) return false;
    end += entry.bytes;
  }
  groups([&](Group entry, const IndexEntry* before) {
    get_difference(in, before == nullptr ? 0 : before->segment, entry.segment);
  });
  for (const auto field : kCounts)
    groups([&](Group entry, const IndexEntry*) { entry.*field = in.get_varint(); });
  groups([&](Group entry, const IndexEntry* before) {
    entry.first_cell = before == nullptr ? 0 : before->first_cell + before->cells;
    entry.first_vertex = before == nullptr ? 0 : before->first_vertex + before->vertices;
    for (double& side : entry.box) side = get_short(in);
  });
  // Total number of parts so far; checked against the number of remaining bytes.
  std::uint64_t sum = 0;
  constexpr std::uint64_t kLeastPartBytes = 6;
  for (IndexEntry& entry : entries) {
    if (!entry.is(ChunkKind::step_values)) continue;
    const std::uint64_t of_chunk = in.get_varint();
    if (of_chunk == 0 || of_chunk > kMostStepParts || of_chunk > entry.bytes / 3) return false;
    sum += of_chunk;
    if (sum > in.left() / kLeastPartBytes) return false;
    entry.parts.resize(static_cast<std::size_t>(of_chunk));
  }
  for (const auto field : kNumbers)
    parts([&](Part entry, const StepEntry* before) {
      get_difference(in, before == nullptr ? 0 : before->*field, entry.*field);
    });
  parts([&](Part entry, const StepEntry* before) {
    entry.step = get_difference(in, before == nullptr ? 0 : before->step);
  });
  parts([&](Part entry, const StepEntry* before) {
    const bool goes_on =
        before != nullptr && before->array == entry.array && before->step == entry.step;
    entry.count = in.get_varint();
    entry.first = goes_on ? before->first + before->count : 0;
  });
  parts([&](Part entry, const StepEntry*) {
    entry.reference = static_cast<StepReference>(in.get_u8());
  });
  parts([&](Part entry, const StepEntry*) { entry.codec = static_cast<Codec>(in.get_u8()); });
  bool are_bundles_small = true;
  parts([&](Part entry, const StepEntry*) {
    if (entry.codec != kBundleCodec) return;
    entry.arrays = in.get_varint32();
    entry.steps = in.get_varint();
    are_bundles_small = are_bundles_small && entry.arrays > 0 && entry.steps > 0 &&
                        entry.steps <= kMostBundlePairs &&
                        entry.arrays <= kMostBundlePairs / entry.steps;
  });
  return in.ok() && in.left() == 0 && are_bundles_small;
}

}  // namespace

void put(ByteWriter& out, const Index& index) {
  if (index.version == 0) {
    put_lines(out, index);
    return;
  }
  ByteWriter blob;
  if (has_digest(index.version)) out.put_u64(index.digest);
  blob.put_varint(index.previous_index);
  put_totals(blob, index);
  put_columns(blob, index.entries);
  const bool packs = blob.bytes.size() <= most_packed_bytes(index.entries.size());
  put_packed(out, blob.bytes, packs ? Packing::with_dictionary : Packing::none);
}

bool get(ByteReader& in, Index& index, std::uint8_t version, std::uint64_t max_entries) {
  index = {};
  index.version = version;
  if (version == 0) return get_lines(in, index, max_entries) && index.previous_index == 0;
  if (has_digest(version)) index.digest = in.get_u64();
  const std::uint64_t most = std::max<std::uint64_t>(in.left(), most_packed_bytes(max_entries));
  const auto blob = get_packed(in, most);
  if (!blob) return false;
  ByteReader fields(*blob);
  index.previous_index = fields.get_varint();
  get_totals(fields, index);
  if (!get_columns(fields, index, max_entries)) return false;
  return index.previous_index == 0 ||
         (!index.entries.empty() && index.entries[0].is(ChunkKind::index));
}

std::vector<std::byte> index_payload(const Index& index, std::uint64_t offset) {
  ByteWriter payload;
  put(payload, index);
  if (has_trailer_inside(index.version)) put_trailer(payload, offset);
  return std::move(payload.bytes);
}
std::optional<std::uint64_t> offset_in_index(std::span<const std::byte> payload) {
  if (payload.size() < kTrailerBytes) return std::nullopt;
  ByteReader end(payload.last(kTrailerBytes));
  std::uint64_t offset = 0;
  return get_trailer(end, offset) ? std::optional(offset) : std::nullopt;
}
bool get_index_payload(std::span<const std::byte> payload, Index& index, std::uint8_t version,
                       std::uint64_t offset, std::uint64_t max_entries) {
  if (has_trailer_inside(version)) {
    if (offset_in_index(payload) != offset) return false;
    payload = payload.first(payload.size() - kTrailerBytes);
  }
  ByteReader in(payload);
  if (!get(in, index, version, max_entries) || index.previous_index >= offset) return false;
  if (version == 0 || index.entries.empty()) return true;
  const IndexEntry& last = index.entries.back();
  return last.offset + last.bytes <= offset;
}

void put(ByteWriter& out, const MemberList& list) {
  put_version(out, list.start);
  out.put_varint(list.members.size());
  for (const Member& member : list.members) {
    out.put_text(member.name);
    out.put_varint(member.bytes);
  }
}
bool get(ByteReader& in, MemberList& list) {
  get_version(in, list.start);
  const std::uint64_t count = in.get_count(2);
  list.members.clear();
  for (std::uint64_t i = 0; i < count && in.ok(); ++i) {
    Member member;
    member.name = in.get_text();
    member.bytes = in.get_varint();
    list.members.push_back(std::move(member));
  }
  return in.ok() && in.left() == 0;
}

void put_trailer(ByteWriter& out, std::uint64_t index_offset) {
  ByteWriter tail;
  tail.put_u64(index_offset);
  tail.put_u32(checksum(tail.bytes));
  tail.put_u32(kTrailerMark);
  out.put_bytes(tail.bytes);
}
bool get_trailer(ByteReader& in, std::uint64_t& index_offset) {
  const auto bytes = in.get_bytes(kTrailerBytes);
  if (!in.ok()) return false;
  ByteReader tail(bytes);
  index_offset = tail.get_u64();
  return tail.get_u32() == checksum(bytes.first(8)) && tail.get_u32() == kTrailerMark;
}

}  // namespace shm::container
