#include "container/format.h"

#include "bytes/binary.h"

namespace shm::container {
namespace {

void put_box(ByteWriter& out, const std::array<double, 6>& box) {
  for (double v : box) out.put_f64(v);
}
void get_box(ByteReader& in, std::array<double, 6>& box) {
  for (double& v : box) v = in.get_f64();
}

}  // namespace

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
  bool good = true;
  for (std::uint8_t byte : kSignature) good &= in.get_u8() == byte;
  get_version(in, start);
  return good && in.ok();
}

void put(ByteWriter& out, const ChunkHeader& header) {
  ByteWriter head;
  head.put_u32(kSyncMark);
  head.put_u8(header.kind);
  head.put_u8(header.version);
  head.put_u8(header.flags);
  head.put_u8(0);
  head.put_u32(header.sequence);
  head.put_u32(header.segment);
  head.put_u64(header.payload_bytes);
  head.put_u32(header.payload_checksum);
  head.put_u32(checksum(head.bytes));
  out.put_bytes(head.bytes);
}
HeaderState get(ByteReader& in, ChunkHeader& header) {
  const auto bytes = in.get_bytes(kChunkHeaderBytes);
  ByteReader head(bytes);
  if (head.get_u32() != kSyncMark) return HeaderState::bad_mark;
  header.kind = head.get_u8();
  header.version = head.get_u8();
  header.flags = head.get_u8();
  head.get_u8();  // zero; the checksum covers it
  header.sequence = head.get_u32();
  header.segment = head.get_u32();
  header.payload_bytes = head.get_u64();
  header.payload_checksum = head.get_u32();
  const std::uint32_t stated = head.get_u32();
  return stated == checksum(bytes.first(kChunkHeaderBytes - 4)) ? HeaderState::good
                                                                : HeaderState::bad_checksum;
}
bool is_known(const ChunkHeader& header) {
  return header.kind >= static_cast<std::uint8_t>(ChunkKind::schema) &&
         header.kind <= static_cast<std::uint8_t>(ChunkKind::index) && header.version == 0 &&
         (header.segment == 0 || header.kind == static_cast<std::uint8_t>(ChunkKind::group));
}

void put(ByteWriter& payload, const GroupHeader& header) {
  ByteWriter out;
  out.put_varint(header.first_cell);
  out.put_varint(header.first_vertex);
  out.put_varint(header.cells);
  out.put_varint(header.vertices);
  out.put_varint(header.imported_vertices);
  out.put_varint(header.unused_vertices);
  out.put_varint(header.max_active_vertices);
  out.put_varint(header.decoded_bytes);
  put_box(out, header.box);
  out.put_varint(header.streams.size());
  for (const StreamEntry& stream : header.streams) {
    out.put_u8(static_cast<std::uint8_t>(stream.kind));
    if (stream.kind == StreamKind::array) out.put_varint(stream.array);
    out.put_u8(static_cast<std::uint8_t>(stream.codec));
    out.put_varint(stream.needs);
    out.put_varint(stream.bytes);
    out.put_u32(stream.checksum);
  }
  out.put_u32(checksum(out.bytes));
  payload.put_bytes(out.bytes);
}
bool get(ByteReader& in, GroupHeader& header) {
  const std::size_t begin = in.position();
  header.first_cell = in.get_varint();
  header.first_vertex = in.get_varint();
  const std::uint64_t cells = in.get_varint();
  header.cells = static_cast<std::uint32_t>(cells);
  header.vertices = in.get_varint();
  header.imported_vertices = in.get_varint();
  header.unused_vertices = in.get_varint();
  header.max_active_vertices = in.get_varint();
  header.decoded_bytes = in.get_varint();
  get_box(in, header.box);
  header.streams.clear();
  const std::uint64_t streams = in.get_count(8);
  for (std::uint64_t i = 0; i < streams && in.ok(); ++i) {
    StreamEntry stream;
    stream.kind = static_cast<StreamKind>(in.get_u8());
    if (stream.kind == StreamKind::array) stream.array = in.get_varint32();
    stream.codec = static_cast<Codec>(in.get_u8());
    stream.needs = in.get_varint32();
    stream.bytes = in.get_varint();
    stream.checksum = in.get_u32();
    header.streams.push_back(stream);
  }
  const std::uint32_t sum = checksum(in.since(begin));
  return in.get_u32() == sum && in.ok() && cells <= kMaxGroupCells &&
         header.unused_vertices <= header.vertices;
}

void put(ByteWriter& out, const StepHeader& header) {
  out.put_varint(header.array);
  out.put_varint(header.step);
  out.put_varint(header.reference_step);
  out.put_u8(header.trend ? 1 : 0);
  out.put_varint(header.group);
  out.put_varint(header.count);
  out.put_u8(static_cast<std::uint8_t>(header.codec));
}
bool get(ByteReader& in, StepHeader& header) {
  header.array = in.get_varint32();
  header.step = in.get_varint();
  header.reference_step = in.get_varint();
  const std::uint8_t trend = in.get_u8();
  header.trend = trend != 0;
  header.group = in.get_varint32();
  header.count = in.get_varint();
  header.codec = static_cast<Codec>(in.get_u8());
  return in.ok() && header.step <= 0xffffffffu && header.count >= 1 && trend <= 1;
}

void put(ByteWriter& out, const Index& index) {
  out.put_varint(index.previous_index);
  for (std::uint64_t v : {index.vertices, index.cells, index.hexahedra, index.max_active_vertices,
                          index.steps, index.segments, index.imported_vertices})
    out.put_varint(v);
  out.put_varint(index.block_cells.size());
  for (std::uint64_t cells : index.block_cells) out.put_varint(cells);
  out.put_varint(index.streams.size());
  for (const NamedBytes& stream : index.streams) {
    out.put_text(stream.name);
    out.put_varint(stream.bytes);
  }
  out.put_varint(index.ranges.size());
  for (const ArrayRange& range : index.ranges) {
    out.put_varint(range.array);
    out.put_varint(range.minimum.size());
    for (std::size_t c = 0; c < range.minimum.size(); ++c) {
      out.put_f64(range.minimum[c]);
      out.put_f64(range.maximum[c]);
    }
  }
  out.put_varint(index.entries.size());
  for (const IndexEntry& entry : index.entries) {
    out.put_u8(entry.kind);
    out.put_varint(entry.offset);
    out.put_varint(entry.bytes);
    if (entry.kind == static_cast<std::uint8_t>(ChunkKind::group)) {
      out.put_varint(entry.segment);
      for (std::uint64_t v : {entry.first_cell, entry.cells, entry.first_vertex, entry.vertices})
        out.put_varint(v);
      put_box(out, entry.box);
      out.put_varint(entry.header_bytes);
    } else if (entry.kind == static_cast<std::uint8_t>(ChunkKind::step_values)) {
      out.put_varint(entry.array);
      for (std::uint64_t v : {entry.step, entry.first, entry.count}) out.put_varint(v);
      out.put_varint(entry.group);
      out.put_u8(static_cast<std::uint8_t>(entry.reference));
      out.put_u8(static_cast<std::uint8_t>(entry.codec));
    }
  }
}
bool get(ByteReader& in, Index& index, std::uint64_t max_entries) {
  index = {};
  index.previous_index = in.get_varint();
  for (std::uint64_t* v :
       {&index.vertices, &index.cells, &index.hexahedra, &index.max_active_vertices, &index.steps,
        &index.segments, &index.imported_vertices})
    *v = in.get_varint();
  for (std::uint64_t n = in.get_count(1); n > 0 && in.ok(); --n)
    index.block_cells.push_back(in.get_varint());
  for (std::uint64_t n = in.get_count(2); n > 0 && in.ok(); --n) {
    NamedBytes stream;
    stream.name = in.get_text();
    stream.bytes = in.get_varint();
    index.streams.push_back(stream);
  }
  for (std::uint64_t n = in.get_count(2); n > 0 && in.ok(); --n) {
    ArrayRange range;
    range.array = in.get_varint32();
    for (std::uint64_t c = in.get_count(16); c > 0 && in.ok(); --c) {
      range.minimum.push_back(in.get_f64());
      range.maximum.push_back(in.get_f64());
    }
    index.ranges.push_back(range);
  }
  const std::uint64_t entries = in.get_count(3);
  if (entries > max_entries) return false;
  for (std::uint64_t n = entries; n > 0 && in.ok(); --n) {
    IndexEntry entry;
    entry.kind = in.get_u8();
    entry.offset = in.get_varint();
    entry.bytes = in.get_varint();
    if (entry.kind == static_cast<std::uint8_t>(ChunkKind::group)) {
      entry.segment = in.get_varint32();
      for (std::uint64_t* v :
           {&entry.first_cell, &entry.cells, &entry.first_vertex, &entry.vertices})
        *v = in.get_varint();
      get_box(in, entry.box);
      entry.header_bytes = in.get_varint();
    } else if (entry.kind == static_cast<std::uint8_t>(ChunkKind::step_values)) {
      entry.array = in.get_varint32();
      for (std::uint64_t* v : {&entry.step, &entry.first, &entry.count}) *v = in.get_varint();
      entry.group = in.get_varint32();
      entry.reference = static_cast<StepReference>(in.get_u8());
      entry.codec = static_cast<Codec>(in.get_u8());
    }
    index.entries.push_back(entry);
  }
  return in.ok() && in.left() == 0;
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
