// Parses the sections $Periodic and $GhostElements for the Gmsh reader. These sections are small,
// so they are parsed in memory.
#include "gmsh/mesh.h"

namespace shm::converters {
namespace {

// Appends the index of the node or element with tag `tag` to `out`. Returns false if the mesh has
// no such node or element.
bool append_places(GmshTags& tags, std::int64_t tag, std::vector<std::int64_t>& out) {
  const auto place = tags.find(tag);
  if (place) out.push_back(static_cast<std::int64_t>(*place));
  return place.has_value();
}

// Returns the number of affine values in the current link of $Periodic. Moves `scan` to the first
// affine value.
std::uint64_t affine_count(GmshMemoryScan& scan, bool v41) {
  constexpr std::uint64_t kAffineValues = 16;
  if (v41) return scan.count();
  if (scan.binary()) {  // in binary MSH 4.0, a negative node count announces affine values
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
  // In MSH 1 and 2, the section $Periodic is text even in binary files.
  encoding.binary = encoding.binary && reading.version >= 40;
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

}  // namespace shm::converters
