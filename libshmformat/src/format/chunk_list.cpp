#include "format/chunk_list.h"

#include <string_view>

namespace shm::container {
namespace {

/// Restores the index entries from the lines of a ChunkList.
class EntryReader {
 public:
  explicit EntryReader(std::span<const std::byte> lines) : in_(lines) {}

  struct Line {
    IndexEntry entry;
    bool is_known = false;
  };
  Line next();

 private:
  ByteReader in_;
  std::uint64_t offset_ = kFileStartBytes, cells_ = 0, vertices_ = 0;
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
      if (has_part_ && part_before_.array == part.array && part_before_.step == part.step)
        part.first = part_before_.first + part_before_.count;
      part_before_ = part;
      has_part_ = true;
      entry.parts.push_back(part);
    }
  }
  return line;
}

/// Returns the name of the first field that differs, or an empty string.
std::string_view difference_of(const StepEntry& listed, const StepEntry& there) {
  if (listed.array != there.array) return "array";
  if (listed.step != there.step) return "step";
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
  ++count_;
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
  }
}

std::optional<std::string> ChunkList::difference(std::span<const IndexEntry> entries) const {
  if (entries.size() != count_)
    return "lists " + std::to_string(entries.size()) + " chunks, but the file has " +
           std::to_string(count_);
  EntryReader lines(lines_.bytes);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const EntryReader::Line line = lines.next();
    const std::string_view field = difference_of(entries[i], line);
    if (!field.empty())
      return "entry " + std::to_string(i) + ", of the " + chunk_name(line.entry.kind) +
             " at byte " + std::to_string(line.entry.offset) + ", has another " +
             std::string(field);
  }
  return std::nullopt;
}

}  // namespace shm::container
