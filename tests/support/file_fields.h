// File fields: the numbers and texts of which a .shm file consists. FieldWalk finds them, because
// it describes the layout of each part of a file, independently of the reader. A test can then
// replace a single field with another value. The bytes after the field stay the same and all
// checksums are corrected, so that the checks of the reader, and not a checksum, must detect the
// wrong value.
//
// spec: "Container", "Schema", "Group", "Step values", "Extras", "Index and trailer", "Archive",
// "Parity"
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "format/format.h"
#include "support/file_surgery.h"

namespace shm {

/// Encoding of a field. A short_f64 consists of a byte count and that number of bytes. A field of
/// type checksum is recomputed and never replaced.
enum class FieldType { u8, u16, u32, u64, varint, short_f64, text, checksum };

struct Field {
  std::string_view name;
  FieldType type = FieldType::u8;
  std::size_t begin = 0, end = 0;
  /// The offset of each element of a list, and the offset after the last element. Empty if the
  /// field is not the count of a list.
  std::vector<std::size_t> elements{};
};

/// Reads the stored form of a field as an unsigned number. Signed integers stay in their zigzag
/// form, floating-point numbers are returned as bits, and for a text, its length is returned.
inline std::uint64_t get_number(ByteReader& in, FieldType type) {
  switch (type) {
    case FieldType::u8: return in.get_u8();
    case FieldType::u16: return in.get_u16();
    case FieldType::checksum:
    case FieldType::u32: return in.get_u32();
    case FieldType::u64: return in.get_u64();
    case FieldType::varint: return in.get_varint();
    case FieldType::short_f64: {
      const std::uint8_t count = in.get_u8();
      const auto bytes = in.get_bytes(count <= 8 ? count : ~std::uint64_t{0});
      std::uint64_t bits = 0;
      for (std::size_t i = 0; i < bytes.size(); ++i)
        bits |= std::to_integer<std::uint64_t>(bytes[i]) << (56 - 8 * i);
      return bits;
    }
    case FieldType::text: break;
  }
  const std::uint64_t bytes = in.get_varint();
  (void)in.get_bytes(bytes);
  return bytes;
}

inline int bits_of(FieldType type) {
  return type == FieldType::u8 ? 8 : type == FieldType::u16 ? 16 : type == FieldType::u32 ? 32 : 64;
}

/// Writes a number in the form that get_number() returns. Precondition: `type` is a numeric type
/// and not checksum.
inline void put_number(ByteWriter& out, FieldType type, std::uint64_t number) {
  if (type == FieldType::varint) return out.put_varint(number);
  int bytes = bits_of(type) / 8;
  if (type == FieldType::short_f64) {
    while (bytes > 0 && (number >> (64 - 8 * bytes) & 0xff) == 0) --bytes;
    out.put_u8(static_cast<std::uint8_t>(bytes));
    for (int i = 0; i < bytes; ++i) out.put_u8(static_cast<std::uint8_t>(number >> (56 - 8 * i)));
    return;
  }
  for (int i = 0; i < bytes; ++i) out.put_u8(static_cast<std::uint8_t>(number >> (8 * i)));
}

/// Finds the fields at the beginning of a sequence of bytes.
class FieldWalk {
 public:
  explicit FieldWalk(std::span<const std::byte> bytes) : in_(bytes) {}

  std::vector<Field> fields;

  /// Returns true if all fields that have been read so far were complete.
  bool ok() const { return in_.ok(); }
  std::size_t position() const { return in_.position(); }

  // --- the layouts

  void version() {
    get("major", FieldType::u16);
    get("minor", FieldType::u16);
    get("needed features", FieldType::u32);
  }
  void chunk_header() {
    for (const char* name : {"kind", "version", "flags"}) get(name, FieldType::u8);
    for (const char* name : {"sequence", "segment"}) get(name, FieldType::u32);
  }
  /// Reads the fields that precede the packed bytes of a blob.
  void packing() {
    const std::uint64_t method = get("method", FieldType::u8);
    if (method != 3) get("unpacked bytes", FieldType::varint);
    if (method == 2) get("planes", FieldType::u8);
  }

  void schema() {
    get("order", FieldType::u8);
    get("corner order", FieldType::u8);
    get("delay", FieldType::varint);
    get("coordinate type", FieldType::u8);
    quantization();
    get("source format", FieldType::text);
    list("blocks", [&] {
      get("block id", FieldType::varint);
      get("block name", FieldType::text);
      get("shape", FieldType::u8);
      get("nodes", FieldType::varint);
    });
    list("arrays", [&] {
      get("array name", FieldType::text);
      const std::uint64_t location = get("location", FieldType::u8);
      get("type", FieldType::u8);
      get("components", FieldType::varint);
      get("per step", FieldType::u8);
      list("array blocks", [&] { get("array block", FieldType::varint); });
      if (location > 1 && location < 6) get("elements", FieldType::varint);
      get("role", FieldType::text);
      quantization();
    });
    if (in_.left() > 0) get("step references", FieldType::u8);
    if (in_.left() == 0) return;
    list("fills", [&] {
      get("fill array", FieldType::varint);
      get("fill", FieldType::u64);
    });
  }

  void digest(std::uint8_t version) {
    if (container::has_digest(version)) get("digest", FieldType::u64);
  }
  void group(std::uint8_t version) {
    digest(version);
    for (const char* name : {"first cell", "first vertex", "cells", "vertices", "imported vertices",
                             "unused vertices", "max active vertices", "decoded bytes"})
      get(name, FieldType::varint);
    box(version);
    list("streams", [&] {
      constexpr auto kArray = static_cast<std::uint64_t>(container::StreamKind::array);
      if (get("stream kind", FieldType::u8) == kArray) get("stream array", FieldType::varint);
      get("codec", FieldType::u8);
      if (version == 0) get("needs", FieldType::varint);
      get(kStreamBytes, FieldType::varint);
      get(kStreamChecksum, FieldType::checksum);
    });
  }
  static constexpr std::string_view kStreamBytes = "stream bytes", kStreamChecksum = "stream sum";

  void steps(std::uint8_t version) {
    digest(version);
    version = container::without_digest(version);
    const auto part = [&] {
      get("array", FieldType::varint);
      get("step", FieldType::varint);
      if (version == 0) {
        get("reference step", FieldType::varint);
        get("trend", FieldType::u8);
      }
      get("group", FieldType::varint);
      get("count", FieldType::varint);
      if (version > 0) get("reference", FieldType::varint);
      get("codec", FieldType::u8);
      if (version > 0) get("part bytes", FieldType::varint);
    };
    if (version == container::kBundleVersion)
      bundle();
    else
      version == 0 ? part() : list("parts", part);
  }
  /// Finds the fields of the headers of a bundle.
  void bundle() {
    for (const char* name : {"group", "step", "bundle steps"}) get(name, FieldType::varint);
    list("parts", [&] {
      for (const char* name : {"arrays before", "arrays", "count"}) get(name, FieldType::varint);
    });
  }
  void times() {
    while (in_.left() > 0 && ok()) get("time", FieldType::u64);
  }
  void extras(std::uint8_t version) {
    const auto extra = [&] {
      get("key", FieldType::text);
      get("type", FieldType::u8);
      get("refers", FieldType::u8);
      if (version > 0) get("distance", FieldType::varint);
      list("sides", [&] { get("side", FieldType::varint); });
    };
    version == 0 ? extra() : list("extras", extra);
  }

  void index(std::uint8_t version) {
    get("previous index", FieldType::varint);
    for (const char* name : {"vertices", "cells", "hexahedra", "max active vertices", "steps",
                             "segments", "imported vertices"})
      get(name, FieldType::varint);
    list("blocks", [&] { get("block cells", FieldType::varint); });
    version == 0 ? index_lines() : index_columns();
  }
  void members() {
    version();
    list("members", [&] {
      get("member name", FieldType::text);
      get("member bytes", FieldType::varint);
    });
  }
  /// Finds the fields in the header of a parity packet.
  void parity_packet() {
    get("mark", FieldType::u32);
    for (const char* name : {"packet kind", "packet version", "data", "parity"})
      get(name, FieldType::u8);
    get("protected bytes", FieldType::u64);
    get("set", FieldType::u32);
    get("number", FieldType::u64);
    get("share", FieldType::u32);
    for (const char* name : {"payload sum", "header sum"}) get(name, FieldType::checksum);
  }

  std::uint64_t get(std::string_view name, FieldType type) {
    const std::size_t begin = in_.position();
    const std::uint64_t number = get_number(in_, type);
    fields.push_back({name, type, begin, in_.position()});
    return number;
  }

 private:
  static constexpr auto kGroup = static_cast<std::uint64_t>(container::ChunkKind::group);
  static constexpr auto kStepValues = static_cast<std::uint64_t>(container::ChunkKind::step_values);

  /// Reads the count of a list, then calls `visit` once for each element of the list.
  template <class Visit>
  void list(std::string_view name, Visit&& visit) {
    const std::uint64_t count = get(name, FieldType::varint);
    const std::size_t field = fields.size() - 1;
    std::vector<std::size_t> elements{in_.position()};
    for (std::uint64_t i = 0; i < count && ok(); ++i) {
      visit();
      elements.push_back(in_.position());
    }
    fields[field].elements = std::move(elements);
  }
  /// Reads a column, which has one field for each of `count` elements.
  void column(std::string_view name, FieldType type, std::uint64_t count) {
    for (std::uint64_t i = 0; i < count && ok(); ++i) get(name, type);
  }

  void quantization() {
    const std::uint64_t bits = get("bits", FieldType::u8);
    if (bits == 0) return;
    if (bits == Quantization::kRelative) {
      get("relative bound", FieldType::u64);
      get("positions", FieldType::varint);
      return;
    }
    const bool absolute = bits == Quantization::kAbsolute;
    if (absolute)
      for (const char* name : {"bound", "spacing"}) get(name, FieldType::u64);
    list("ranges", [&] {
      get("minimum", FieldType::u64);
      if (!absolute) get("maximum", FieldType::u64);
    });
  }
  void box(std::uint8_t version) {
    column("box", version == 0 ? FieldType::u64 : FieldType::short_f64, 6);
  }

  void index_lines() {
    list("stream names", [&] {
      get("stream name", FieldType::text);
      get("stream bytes", FieldType::varint);
    });
    list("arrays with ranges", [&] {
      get("array", FieldType::varint);
      list("ranges", [&] {
        get("minimum", FieldType::u64);
        get("maximum", FieldType::u64);
      });
    });
    list("entries", [&] {
      const std::uint64_t kind = get("kind", FieldType::u8);
      get("offset", FieldType::varint);
      get("bytes", FieldType::varint);
      if (kind == kGroup) {
        for (const char* name : {"segment", "first cell", "cells", "first vertex", "vertices"})
          get(name, FieldType::varint);
        box(0);
        get("header bytes", FieldType::varint);
      } else if (kind == kStepValues) {
        for (const char* name : {"array", "step", "first", "count", "group"})
          get(name, FieldType::varint);
        for (const char* name : {"reference", "codec"}) get(name, FieldType::u8);
      }
    });
  }
  void index_columns() {
    const std::uint64_t entries = get("entries", FieldType::varint);
    std::uint64_t groups = 0, chunks = 0, parts = 0;
    for (std::uint64_t i = 0; i < entries && ok(); ++i) {
      const std::uint64_t kind = get("kind", FieldType::u8);
      groups += kind == kGroup;
      chunks += kind == kStepValues;
    }
    column("bytes", FieldType::varint, entries);
    for (const char* name : {"segment", "cells", "vertices", "header bytes"})
      column(name, FieldType::varint, groups);
    for (std::uint64_t i = 0; i < groups && ok(); ++i) box(1);
    for (std::uint64_t i = 0; i < chunks && ok(); ++i) {
      const std::uint64_t more = get("parts", FieldType::varint);
      parts += std::min<std::uint64_t>(more, in_.left());
    }
    for (const char* name : {"array", "group", "step", "count"})
      column(name, FieldType::varint, parts);
    column("reference", FieldType::u8, parts);
    std::uint64_t bundles = 0;
    for (std::uint64_t i = 0; i < parts && ok(); ++i)
      bundles += get("codec", FieldType::u8) == static_cast<std::uint64_t>(container::kBundleCodec);
    for (std::uint64_t i = 0; i < bundles && ok(); ++i)
      for (const char* name : {"arrays", "bundle steps"}) get(name, FieldType::varint);
  }

  ByteReader in_;
};

/// A run of consecutive fields.
struct Section {
  std::vector<std::byte> bytes;
  std::vector<Field> fields;
  /// Number of bytes of data after the fields, such as packed bytes whose length one of the fields
  /// states.
  std::size_t bytes_behind = 0;
  /// put(file, new_bytes) replaces the bytes of this section in the file with `new_bytes`.
  std::function<void(FileParts&, const std::vector<std::byte>&)> put{};

  std::uint64_t number(const Field& field) const {
    ByteReader in(std::span<const std::byte>(bytes).subspan(field.begin));
    return get_number(in, field.type);
  }
  std::span<const std::byte> bytes_of(const Field& field) const {
    return std::span(bytes).subspan(field.begin, field.end - field.begin);
  }
};

// --- replacement values of fields

/// Returns a text that is not a valid name, or that has a special meaning as a path or in a shell.
inline std::string odd_text(std::uint64_t n) {
  static const std::string kTexts[] = {
      "",    "../../x", "/etc/passwd", "..",  ".", "a/b",   "a\\b", std::string("a\0b", 3), "x",
      "con", "a\nb",    "~",           "-rf", "*", "$HOME", "\xff", std::string(256, 'x'),  "mesh/",
  };
  return kTexts[n % std::size(kTexts)];
}

/// Returns the n-th replacement for the number in `field`: a number near it, a number far from it,
/// a power of two, a small number, or the value of another field.
inline std::uint64_t other_number(const Section& section, const Field& field, std::uint64_t n) {
  const std::uint64_t number = section.number(field);
  switch (n % 8) {
    case 0: return number + 1;
    case 1: return number - 1;
    case 2: return 0;
    case 3: return ~std::uint64_t{0};
    case 4: return std::uint64_t{1} << n / 8 % static_cast<std::uint64_t>(bits_of(field.type));
    case 5: return n / 8 % 20;
    case 6: return 2 * number + n / 8 % 3;
    default:
      return section.number(
          section.fields[static_cast<std::size_t>(n / 8 % section.fields.size())]);
  }
}

/// Returns the bytes of the section after one field has been changed in one of several hundred
/// ways, which `n` selects. If the field is a checksum, returns the bytes unchanged.
inline std::vector<std::byte> changed(const Section& section, const Field& field, std::uint64_t n) {
  if (field.type == FieldType::checksum) return section.bytes;
  const auto all = std::span(section.bytes);
  auto behind = all.subspan(field.end);
  const auto pick = [n](std::size_t count) { return static_cast<std::size_t>(n / 8 % count); };
  ByteWriter out;
  out.put_bytes(all.first(field.begin));
  if (field.type == FieldType::text && n % 4 == 0) {
    // Writes a wrong length before the unchanged bytes of the text.
    out.put_varint(other_number(section, field, n / 4));
    behind = all.subspan(field.end - static_cast<std::size_t>(section.number(field)));
  } else if (field.type == FieldType::text) {
    const Field& other = section.fields[pick(section.fields.size())];
    if (n % 4 == 1 && other.type == FieldType::text)
      out.put_bytes(section.bytes_of(other));
    else
      out.put_text(odd_text(n / 4));
  } else if (field.elements.size() > 1 && n % 4 == 0) {
    // Adds or removes one element.
    const std::size_t e = pick(field.elements.size() - 1);
    const std::size_t begin = field.elements[e], end = field.elements[e + 1];
    const bool more = n / 4 % 2 == 0;
    out.put_varint(section.number(field) + (more ? 1 : ~std::uint64_t{0}));
    out.put_bytes(all.subspan(field.end, (more ? end : begin) - field.end));
    behind = all.subspan(more ? begin : end);
  } else if (field.type == FieldType::varint && n % 32 == 1) {
    // Writes the same number as a varint with additional groups of zero bits. In some cases, the
    // varint then has more groups than the format allows.
    out.put_bytes(section.bytes_of(field));
    out.bytes.back() |= std::byte{0x80};
    for (std::uint64_t zeros = n / 32 % 10; zeros > 0; --zeros) out.put_u8(0x80);
    out.put_u8(0);
  } else {
    put_number(out, field.type, other_number(section, field, n));
  }
  out.put_bytes(behind);
  return std::move(out.bytes);
}

// --- the sections of a file

namespace fields {

using Bytes = std::vector<std::byte>;

inline Bytes joined(std::span<const std::byte> first, std::span<const std::byte> second) {
  Bytes all(first.begin(), first.end());
  all.insert(all.end(), second.begin(), second.end());
  return all;
}

/// If all fields that `walk` finds in `bytes` are complete, adds a section with these fields.
/// `put(file, new_bytes, rest)` must replace the fields in the file with `new_bytes`, followed by
/// `rest`, the unchanged bytes after the fields.
template <class Walk, class Put>
void add(std::vector<Section>& to, const Bytes& bytes, Walk&& walk, Put put) {
  FieldWalk fields(bytes);
  walk(fields);
  if (!fields.ok()) return;
  const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(fields.position());
  to.push_back({Bytes(bytes.begin(), end), std::move(fields.fields),
                bytes.size() - fields.position(),
                [put, behind = Bytes(end, bytes.end())](FileParts& parts, const Bytes& other) {
                  put(parts, other, behind);
                }});
}

/// Adds the fields of the file start and of the trailer. If the file start is changed, its copy in
/// the first chunk is changed, too.
inline void add_ends(std::vector<Section>& to, const FileParts& parts) {
  ByteWriter start, trailer;
  container::put_version(start, parts.start);
  add(
      to, start.bytes, [](FieldWalk& walk) { walk.version(); },
      [was = start.bytes](FileParts& of, const Bytes& other, const Bytes&) {
        ByteReader in(other);
        container::get_version(in, of.start);
        if (of.chunks.empty() || of.chunks[0].payload.size() < was.size()) return;
        const auto copy = of.chunks[0].payload.begin();
        if (std::equal(was.begin(), was.end(), copy)) std::copy(other.begin(), other.end(), copy);
      });
  trailer.put_u64(parts.last_offset());
  add(
      to, trailer.bytes, [](FieldWalk& walk) { walk.get("index offset", FieldType::u64); },
      [](FileParts& of, const Bytes& other, const Bytes&) {
        of.index_offset = ByteReader(other).get_u64();
      });
}

inline void add_header(std::vector<Section>& to, const FileParts& parts, std::size_t c) {
  ByteWriter out;
  const container::ChunkHeader& header = parts.chunks[c].header;
  for (const std::uint8_t byte : {header.kind, header.version, header.flags}) out.put_u8(byte);
  for (const std::uint32_t number : {header.sequence, header.segment}) out.put_u32(number);
  add(
      to, out.bytes, [](FieldWalk& walk) { walk.chunk_header(); },
      [c](FileParts& of, const Bytes& other, const Bytes&) {
        ByteReader in(other);
        container::ChunkHeader& its = of.chunks[c].header;
        for (std::uint8_t* byte : {&its.kind, &its.version, &its.flags}) *byte = in.get_u8();
        for (std::uint32_t* number : {&its.sequence, &its.segment}) *number = in.get_u32();
      });
}

/// Adds a section with the fields that `walk` finds at the beginning of the payload of chunk `c`.
template <class Walk>
void add_plain(std::vector<Section>& to, const FileParts& parts, std::size_t c, Walk&& walk) {
  add(to, parts.chunks[c].payload, walk,
      [c](FileParts& of, const Bytes& other, const Bytes& behind) {
        of.chunks[c].payload = joined(other, behind);
      });
}

/// Adds two sections for the packed blob in chunk `c`: one with the fields before the packed bytes,
/// and one with the fields in the unpacked bytes. If `has_version` is true, a version number
/// precedes the blob. If the chunk has a digest, it precedes the blob.
template <class Walk>
void add_packed(std::vector<Section>& to, const FileParts& parts, std::size_t c, Walk&& walk,
                bool has_version = false) {
  const std::uint8_t version_of_chunk = parts.chunks[c].header.version;
  const bool has_first = parts.chunks[c].is(container::ChunkKind::step_times) &&
                         container::has_first_time(version_of_chunk);
  add_plain(to, parts, c, [&](FieldWalk& fields) {
    if (has_version) fields.version();
    fields.digest(version_of_chunk);
    if (has_first) fields.get("first time", FieldType::varint);
    fields.packing();
  });
  constexpr std::uint64_t kMost = 1 << 20;
  ByteReader in(parts.chunks[c].payload);
  in.get_bytes(has_version || container::has_digest(version_of_chunk) ? 8 : 0);
  if (has_first) in.get_varint();
  const std::size_t head = in.position();
  const auto blob = get_packed(in, kMost);
  if (!blob) return;
  add(to, *blob, walk, [c, head](FileParts& of, const Bytes& other, const Bytes& behind) {
    ByteWriter payload;
    payload.put_bytes(std::span(of.chunks[c].payload).first(head));
    put_packed(payload, joined(other, behind), Packing::none);
    of.chunks[c].payload = std::move(payload.bytes);
  });
}

/// Returns the payload of a group with the changed header `header` and unchanged bitstreams.
/// Recomputes all checksums. If the changed header states a different length for a bitstream, the
/// checksum of the bitstream covers that length.
inline Bytes group_payload(Bytes header, std::span<const std::byte> streams, std::uint8_t version) {
  FieldWalk walk(header);
  walk.group(version);
  ByteReader left(streams);
  std::uint64_t bytes = 0;
  for (const Field& field : walk.fields) {
    ByteReader in(std::span<const std::byte>(header).subspan(field.begin));
    if (field.name == FieldWalk::kStreamBytes) bytes = get_number(in, field.type);
    if (field.name != FieldWalk::kStreamChecksum || !walk.ok()) continue;
    ByteWriter sum;
    sum.put_u32(checksum(left.get_bytes(std::min<std::uint64_t>(bytes, left.left()))));
    std::copy(sum.bytes.begin(), sum.bytes.end(),
              header.begin() + static_cast<std::ptrdiff_t>(field.begin));
  }
  ByteWriter out;
  out.put_bytes(header);
  out.put_u32(checksum(header));
  out.put_bytes(streams);
  return std::move(out.bytes);
}

inline void add_group(std::vector<Section>& to, const FileParts& parts, std::size_t c) {
  const std::uint8_t version = parts.chunks[c].header.version;
  add(
      to, parts.chunks[c].payload, [version](FieldWalk& walk) { walk.group(version); },
      [c, version](FileParts& of, const Bytes& other, const Bytes& behind) {
        ByteReader in(behind);
        in.get_u32();  // skips the old checksum
        of.chunks[c].payload = group_payload(other, in.get_bytes(in.left()), version);
      });
}

}  // namespace fields

/// Returns the sections of the header and payload of chunk `c`. Sections that are too damaged to
/// find their fields are omitted. If `c` is the number of chunks, returns the sections of the file
/// start and of the trailer.
inline std::vector<Section> sections_of(const FileParts& parts, std::size_t c) {
  using container::ChunkKind;
  std::vector<Section> all;
  if (c == parts.chunks.size()) {
    fields::add_ends(all, parts);
    return all;
  }
  const std::uint8_t version = parts.chunks[c].header.version;
  const auto plain = [&](auto&& walk) { fields::add_plain(all, parts, c, walk); };
  const auto packed = [&](auto&& walk) { fields::add_packed(all, parts, c, walk); };
  switch (static_cast<ChunkKind>(parts.chunks[c].header.kind)) {
    case ChunkKind::schema:
      fields::add_packed(
          all, parts, c, [](FieldWalk& walk) { walk.schema(); }, true);
      break;
    case ChunkKind::group: fields::add_group(all, parts, c); break;
    case ChunkKind::step_values: plain([&](FieldWalk& walk) { walk.steps(version); }); break;
    case ChunkKind::step_times: packed([](FieldWalk& walk) { walk.times(); }); break;
    case ChunkKind::extra: packed([&](FieldWalk& walk) { walk.extras(version); }); break;
    case ChunkKind::index:
      if (version == 0)
        plain([](FieldWalk& walk) { walk.index(0); });
      else
        packed([&](FieldWalk& walk) { walk.index(version); });
      break;
    case ChunkKind::members: plain([](FieldWalk& walk) { walk.members(); }); break;
  }
  fields::add_header(all, parts, c);
  return all;
}

// --- parity packets, which follow the file

inline constexpr std::size_t kPacketHeader = 40, kPacketPayload = 4096;

/// Returns the offsets of all complete headers of parity packets.
inline std::vector<std::size_t> parity_packets(std::span<const std::byte> file) {
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  std::vector<std::size_t> all;
  for (auto at = text.find("SHMP"); at != text.npos; at = text.find("SHMP", at + 1))
    if (file.size() - at >= kPacketHeader) all.push_back(at);
  return all;
}
/// Returns the header of the parity packet at offset `at`. put_parity_header() replaces this
/// header.
inline Section parity_header(std::span<const std::byte> file, std::size_t at) {
  const auto bytes = file.subspan(at, kPacketHeader);
  FieldWalk walk(bytes);
  walk.parity_packet();
  return {{bytes.begin(), bytes.end()}, std::move(walk.fields)};
}
/// Replaces the header of a parity packet and recomputes the checksums of its payload and of its
/// header.
inline void put_parity_header(std::span<std::byte> file, std::size_t at,
                              std::span<const std::byte> header) {
  const auto packet = file.subspan(at);
  std::copy(header.begin(), header.end(), packet.begin());
  const auto put_sum = [&](std::size_t place, std::span<const std::byte> of) {
    ByteWriter sum;
    sum.put_u32(checksum(of));
    std::copy(sum.bytes.begin(), sum.bytes.end(),
              packet.begin() + static_cast<std::ptrdiff_t>(place));
  };
  if (packet.size() >= kPacketHeader + kPacketPayload)
    put_sum(kPacketHeader - 8, packet.subspan(kPacketHeader, kPacketPayload));
  put_sum(kPacketHeader - 4, packet.first(kPacketHeader - 4));
}

}  // namespace shm
