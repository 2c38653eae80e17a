// The Gmsh reader's smaller sections, parsed from memory: $Periodic, $GhostElements, and what
// gives blocks their names.
#include <cctype>

#include "gmsh_mesh.h"
#include "gmsh_types.h"

namespace shm::converters {
namespace {

// Places of tags; false when one is not in the mesh.
bool append_places(GmshTags& tags, std::int64_t tag, std::vector<std::int64_t>& out) {
  const auto place = tags.find(tag);
  if (place) out.push_back(static_cast<std::int64_t>(*place));
  return place.has_value();
}

// How many values of an affine transformation come next in a periodic link.
std::uint64_t affine_count(GmshMemoryScan& scan, bool v41) {
  constexpr std::uint64_t kAffineValues = 16;
  if (v41) return scan.count();
  if (scan.binary()) {  // MSH 4.0: a negative number of nodes announces them
    GmshMemoryScan ahead = scan;
    if (ahead.integer64() >= 0 || !ahead.good()) return 0;
    scan = ahead;
    return kAffineValues;
  }
  if (scan.peek_word() != "Affine") return 0;
  scan.word();
  return kAffineValues;
}

}  // namespace

bool parse_gmsh_periodic(GmshReading& reading, std::string_view content) {
  const bool v41 = reading.version >= 41;
  GmshEncoding encoding = reading.scan.encoding;
  encoding.binary = encoding.binary && reading.version >= 40;  // text in MSH 1 and 2
  if (!reading.have_nodes) return false;
  GmshMemoryScan scan(content, encoding);
  std::vector<std::int64_t> links, nodes;
  std::vector<double> affine;
  const std::uint64_t count = scan.count(v41);
  for (std::uint64_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) links.push_back(scan.integer32());
    const std::uint64_t affine_values = affine_count(scan, v41);
    for (std::uint64_t k = 0; k < affine_values && scan.good(); ++k) affine.push_back(scan.real());
    const std::uint64_t pairs = scan.count();
    for (std::uint64_t k = 0; k < 2 * pairs && scan.good(); ++k)
      if (!append_places(reading.nodes, scan.tag(v41), nodes)) return false;
    if (!scan.good()) return false;
    links.push_back(static_cast<std::int64_t>(affine_values));
    links.push_back(static_cast<std::int64_t>(pairs));
  }
  if (!scan.good() || !scan.only_space_left()) return false;
  const std::string key = reading.section_key();
  reading.add_extra(key + "/links", ScalarType::int64, {count, 5}, links.data());
  reading.add_extra(key + "/affine", ScalarType::float64, {affine.size()}, affine.data());
  reading.add_extra(key + "/nodes", ScalarType::int64, {nodes.size() / 2, 2}, nodes.data(),
                    Reference::vertex);
  return true;
}

bool parse_gmsh_ghosts(GmshReading& reading, std::string_view content) {
  if (!reading.have_elements || reading.version < 40) return false;
  const bool v41 = reading.version >= 41;
  GmshMemoryScan scan(content, reading.scan.encoding);
  std::vector<std::int64_t> cells;
  std::vector<std::int32_t> partitions, ghosts;
  const std::uint64_t count = scan.count(v41);
  for (std::uint64_t i = 0; i < count; ++i) {
    if (!append_places(reading.elements, scan.tag(v41), cells)) return false;
    const std::int64_t partition = scan.integer32();
    const std::uint64_t others = scan.count(v41);
    for (std::uint64_t k = 0; k < others && scan.good(); ++k)
      ghosts.push_back(static_cast<std::int32_t>(scan.integer32()));
    if (!scan.good()) return false;
    partitions.push_back(static_cast<std::int32_t>(partition));
    partitions.push_back(static_cast<std::int32_t>(others));
  }
  if (!scan.good() || !scan.only_space_left()) return false;
  const std::string key = reading.section_key();
  reading.add_extra(key + "/cells", ScalarType::int64, {count}, cells.data(), Reference::cell);
  reading.add_extra(key + "/partitions", ScalarType::int32, {count, 2}, partitions.data());
  reading.add_extra(key + "/ghosts", ScalarType::int32, {ghosts.size()}, ghosts.data());
  return true;
}

void parse_gmsh_names(GmshReading& reading, std::string_view content) {
  GmshMemoryScan scan(content, {});  // text in binary files too
  const std::uint64_t count = scan.count();
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::int64_t dimension = scan.integer32(), tag = scan.integer32();
    const std::string_view rest = scan.rest_of_line();
    if (!scan.good()) return;
    const std::size_t open = rest.find('"'), close = rest.rfind('"');
    if (open < close && close != std::string_view::npos)
      reading.physical_names[{dimension, tag}] = rest.substr(open + 1, close - open - 1);
  }
}

void parse_gmsh_entities(GmshReading& reading, std::string_view content, bool partitioned) {
  GmshMemoryScan scan(content, reading.scan.encoding);
  const bool v41 = reading.version >= 41;
  if (partitioned) {
    scan.count(v41);
    const std::uint64_t ghosts = scan.count(v41);
    for (std::uint64_t i = 0; i < 2 * ghosts && scan.good(); ++i) scan.integer32();
  }
  std::uint64_t counts[4];
  for (std::uint64_t& count : counts) count = scan.count();
  for (std::int64_t dimension = 0; dimension < 4; ++dimension) {
    for (std::uint64_t i = 0; i < counts[dimension]; ++i) {
      const std::int64_t tag = scan.integer32();
      if (partitioned) {
        scan.integer32();
        scan.integer32();
        const std::uint64_t parts = scan.count(v41);
        for (std::uint64_t k = 0; k < parts && scan.good(); ++k) scan.integer32();
      }
      const int box = dimension == 0 && reading.version >= 41 ? 3 : 6;
      for (int k = 0; k < box; ++k) scan.real();
      std::vector<std::int64_t> groups;
      const std::uint64_t group_count = scan.count();
      for (std::uint64_t k = 0; k < group_count && scan.good(); ++k)
        groups.push_back(scan.integer32());
      const std::uint64_t bounds = dimension > 0 ? scan.count() : 0;
      for (std::uint64_t k = 0; k < bounds && scan.good(); ++k) scan.integer32();
      if (!scan.good()) return;
      reading.entity_groups[{dimension, tag}] = std::move(groups);
    }
  }
}

void name_gmsh_blocks(GmshReading& reading) {
  auto& blocks = reading.mesh->info_.schema.blocks;
  const std::size_t width = reading.block_table_width();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const std::int32_t* row = reading.block_table.data() + b * width;
    std::int64_t dimension = 0, group = 0;
    if (reading.version >= 40) {
      const auto entity = reading.entity_groups.find({row[0], row[1]});
      if (entity == reading.entity_groups.end() || entity->second.size() != 1) continue;
      dimension = row[0];
      group = entity->second[0];
    } else {
      dimension = gmsh_type(row[0]).dimension;
      group = row[2];
    }
    const auto name = reading.physical_names.find({dimension, group < 0 ? -group : group});
    if (name != reading.physical_names.end()) blocks[b].name = name->second;
  }
}

}  // namespace shm::converters
