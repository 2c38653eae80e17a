// The Gmsh reader: reads a file section by section.
#include <algorithm>
#include <cmath>

#include "base/failure.h"
#include "gmsh/gmsh.h"
#include "gmsh/mesh.h"

namespace shm::converters {
namespace {

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string_view trimmed_lines(std::string_view text) {
  return text.find_first_not_of(" \t\r\n") == std::string_view::npos ? std::string_view() : text;
}

// Returns true if a section is kept verbatim and never refers to nodes or elements by tag.
bool names_no_tags(std::string_view section) {
  for (const std::string_view known :
       {"MeshFormat", "Comments", "PhysicalNames", "Entities", "PartitionedEntities",
        "InterpolationScheme", "Parametrizations"})
    if (section == known) return true;
  return false;
}

std::string end_marker(const std::string& name) {
  return (name == "NOD" || name == "ELM" ? "$END" : "$End") + name;
}

// Describes a line with a section marker at a place where `marker` should be.
std::string misplaced(std::string_view line, const std::string& marker) {
  return "'" + std::string(trimmed(line).substr(0, 40)) + "' is where " + marker + " should be";
}

// Returns the first line of a section's content that begins with "$End" or "$END"; empty if there
// is none.
std::string_view other_end_marker(std::string_view content) {
  for (std::size_t begin = 0; begin < content.size();) {
    const std::size_t end = std::min(content.find('\n', begin), content.size());
    const std::string_view line = content.substr(begin, end - begin);
    if (line.starts_with("$End") || line.starts_with("$END")) return line;
    begin = end + 1;
  }
  return {};
}

class SectionReader {
 public:
  SectionReader(const std::string& path, Spool& spool) : r_(path, spool) {}

  std::unique_ptr<MeshSource> read() {
    r_.input.enter("file header");
    while (next_section()) read_section();
    if (r_.sections.empty())
      r_.input.fail(ErrorCode::corrupt, "this is not a Gmsh MSH file: it has no section");
    r_.input.enter("whole file");
    keep_gmsh_tags(r_);
    name_blocks();
    finish_gmsh_data(r_);
    if (!have_format_) r_.add_text("gmsh/mesh_format", "1");
    r_.add_text("gmsh/sections", section_list());
    add_group_sets(r_.mesh->info_);
    return std::move(r_.mesh);
  }

 private:
  // Moves to the content of the next section. Keeps any text between the previous section and this
  // section. Returns false at the end of the file.
  bool next_section() {
    std::string between;
    while (!r_.input.at_end()) {
      const std::string line = r_.input.line();
      if (line.empty() || line[0] != '$') {
        between += line + '\n';
        continue;
      }
      keep_between(between);
      const std::string_view name = trimmed(std::string_view(line).substr(1));
      if (name.empty() || name.find('\t') != std::string_view::npos)
        r_.input.fail(ErrorCode::corrupt, "a section has no proper name");
      r_.sections.push_back(GmshSection{std::string(name), "raw", 0, {}});
      r_.input.enter("$" + std::string(name));
      return true;
    }
    if (!r_.sections.empty()) keep_between(between);
    return false;
  }

  void keep_between(const std::string& text) {
    if (trimmed_lines(text).empty()) return;
    r_.sections.push_back(GmshSection{"", "between", 0, {}});
    keep_raw(text);
  }

  void read_section() {
    const std::string name = r_.sections.back().name;
    std::string& kind = r_.sections.back().kind;
    if (name == "MeshFormat") {
      kind = "format";
      read_format();
    } else if (name == "Nodes" || name == "NOD" || name == "ParametricNodes") {
      kind = "nodes";
      read_gmsh_nodes(r_, name == "ParametricNodes");
      expect_section_end(r_);
    } else if (name == "Elements" || name == "ELM") {
      kind = "elements";
      read_gmsh_elements(r_);
      expect_section_end(r_);
    } else if (name == "NodeData" || name == "ElementData" || name == "ElementNodeData") {
      const std::uint64_t start = r_.input.offset();
      if (read_gmsh_data(r_)) return;
      r_.input.seek(start);
      keep_raw(read_raw());
      r_.tags_are_referred_to = true;
    } else {
      read_small_section(name, kind);
    }
  }

  void read_small_section(const std::string& name, std::string& kind) {
    const std::string content = read_raw();
    if (name == "Periodic" && parse_gmsh_periodic(r_, content)) {
      kind = "links";
      return;
    }
    if (name == "GhostElements" && parse_gmsh_ghosts(r_, content)) {
      kind = "ghosts";
      return;
    }
    if (name == "PhysicalNames") r_.naming.add_names(content);
    if (name == "Entities") r_.naming.add_entities(content, false, r_.scan.encoding, r_.version);
    if (name == "PartitionedEntities")
      r_.naming.add_entities(content, true, r_.scan.encoding, r_.version);
    r_.tags_are_referred_to |= !names_no_tags(name);
    keep_raw(content);
  }

  void name_blocks() {
    auto& blocks = r_.mesh->info_.schema.blocks;
    const std::size_t width = r_.block_table_width();
    for (std::size_t b = 0; b < blocks.size(); ++b)
      blocks[b].name = r_.naming.block_name(std::span(r_.block_table).subspan(b * width, width));
  }

  void keep_raw(std::string_view content) { r_.add_text(r_.section_key(), content); }

  void read_format() {
    if (have_format_) r_.input.fail(ErrorCode::corrupt, "the format is given twice");
    have_format_ = true;
    if (r_.have_nodes || r_.have_elements)
      r_.input.fail(ErrorCode::corrupt, "the format comes after nodes or elements");
    const std::string line = r_.input.line();
    GmshMemoryScan words(line, {});
    const double version = words.real();
    const std::int64_t type = words.integer32(), data_size = words.integer32();
    if (!words.good() || type < 0 || type > 1)
      r_.input.fail(ErrorCode::corrupt,
                    "the line should contain the version, the file type and the data size");
    if (!(version >= 2 && version < 4.15))
      r_.input.fail(ErrorCode::unsupported, "version " + std::string(trimmed(line)) +
                                                " is not one of 1, 2.x, 3.0, 4.0, 4.1");
    r_.version = gmsh_version(version);
    if (r_.version == 30 && type == 1)
      r_.input.fail(ErrorCode::unsupported, "binary files of version 3 are not read");
    r_.add_text("gmsh/mesh_format", trimmed(line));
    if (type == 1) read_byte_order(data_size);
    expect_section_end(r_);
  }

  void read_byte_order(std::int64_t data_size) {
    if (data_size != 8)
      r_.input.fail(ErrorCode::unsupported,
                    "the data size of a binary file must be 8, not " + std::to_string(data_size));
    GmshEncoding& encoding = r_.scan.encoding;
    encoding.binary = true;
    const auto one = static_cast<std::int32_t>(r_.scan.integer32());
    encoding.swapped = one != 1;
    if (one != 1 && swap_bytes(one) != 1)
      r_.input.fail(ErrorCode::corrupt,
                    "the number that identifies the byte order is not 1 in either byte order");
    const bool little = (std::endian::native == std::endian::little) != encoding.swapped;
    r_.add_text("gmsh/byte_order", little ? "little" : "big");
  }

  // Reads the content of a section, up to the line with its end marker.
  std::string read_raw() {
    const std::uint64_t start = r_.input.offset();
    const std::string marker = end_marker(r_.sections.back().name);
    std::string content;
    std::size_t searched = 0;
    while (true) {
      for (std::size_t position = content.find(marker, searched); position != std::string::npos;
           position = content.find(marker, position + 1)) {
        if (position > 0 && content[position - 1] != '\n') continue;
        r_.input.seek(start + position);
        r_.input.skip_line();
        content.resize(position);
        return content;
      }
      searched = content.size() - std::min(content.size(), marker.size());
      const std::uint64_t piece = std::min<std::uint64_t>(r_.input.left(), 65536);
      if (piece == 0) {
        if (const std::string_view other = other_end_marker(content); !other.empty())
          r_.input.fail(ErrorCode::corrupt, misplaced(other, marker));
        r_.input.fail(ErrorCode::truncated, "the file ends before the line " + marker);
      }
      const std::size_t size = content.size();
      content.resize(size + piece);
      r_.input.bytes(reinterpret_cast<std::byte*>(content.data() + size), piece);
    }
  }

  std::string section_list() const {
    std::string list;
    for (const GmshSection& section : r_.sections)
      list += section.name + '\t' + section.kind + '\t' + std::to_string(section.step) + '\t' +
              section.array + '\n';
    return list;
  }

  GmshReading r_;
  bool have_format_ = false;
};

}  // namespace

void expect_section_end(GmshReading& reading) {
  TextInput& input = reading.input;
  const std::string marker = end_marker(reading.sections.back().name);
  while (!input.at_end()) {
    const std::string line = input.line();
    const std::string_view text = trimmed(line);
    if (text.starts_with(marker)) return;
    if (text.empty()) continue;
    if (input.at_end() && marker.starts_with(text)) break;
    if (text[0] == '$') input.fail(ErrorCode::corrupt, misplaced(text, marker));
    input.fail(ErrorCode::corrupt, "the section contains more data than its header states");
  }
  input.fail(ErrorCode::truncated, "the file ends before the line " + marker);
}

std::unique_ptr<MeshSource> open_gmsh(const std::string& path, Spool& spool) {
  return SectionReader(path, spool).read();
}

bool looks_like_gmsh(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos || text[first] != '$') return false;
  for (const std::string_view opening : {"$MeshFormat", "$NOD"}) {
    const std::size_t position = text.find(opening);
    if (position != std::string_view::npos && (position == 0 || text[position - 1] == '\n'))
      return true;
  }
  return false;
}

}  // namespace shm::converters
