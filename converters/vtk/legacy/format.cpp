// The Format of VTK legacy files: functions that recognize, open and write such files, a list of
// the features that the format supports, and functions that list the data that a conversion loses.
#include <set>
#include <sstream>
#include <string_view>

#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/between/family_source.h"
#include "vtk/between/vtk_from_vtu.h"
#include "vtk/legacy/vtk.h"
#include "vtk/strings.h"
#include "vtk/words.h"

namespace shm::converters {
namespace vtk {
namespace {

// Returns true if the lines of a METADATA section contain anything other than the value ranges of
// the array.
bool has_more_than_ranges(const std::string& metadata) {
  std::istringstream lines(metadata);
  std::string line;
  while (std::getline(lines, line)) {
    if (lower_case(line).starts_with("component_names")) return true;
    if (line.starts_with("NAME ") && !is_range_key(line)) return true;
  }
  return false;
}

// Returns the lines of a METADATA section without the information keys that contain ranges. A key
// consists of its NAME line and all lines up to the next NAME line. A line before the first key
// states the number of keys.
std::string without_ranges(const std::string& metadata) {
  std::istringstream lines(metadata);
  std::string before, keys, line;
  std::size_t count = 0;
  bool is_key = false, kept = true;
  while (std::getline(lines, line)) {
    if (line.starts_with("INFORMATION ")) continue;
    if (line.starts_with("NAME ")) {
      is_key = true;
      kept = !is_range_key(line);
      count += kept;
    }
    if (kept) (is_key ? keys : before) += line + '\n';
  }
  return before + (count > 0 ? "INFORMATION " + std::to_string(count) + '\n' : "") + keys;
}

void add_losses_of_skeleton(const Skeleton& skeleton, const Keys& used, LossList& losses) {
  const std::string dataset(dataset_word(skeleton.dataset));
  if (skeleton.dataset == Dataset::polydata) losses.push_back("kind of data set (" + dataset + ")");
  std::set<EntryKind> attributes;  // kinds of attributes found so far in this section
  for (const Entry& entry : skeleton.entries) {
    const std::string name = decode_name(entry.name);
    if (entry.kind == EntryKind::point_data || entry.kind == EntryKind::cell_data)
      attributes.clear();
    if (entry.kind == EntryKind::dimensions || entry.kind == EntryKind::extent)
      losses.push_back(lower_case(keyword(entry.kind)) + ' ' + entry.type + " (" + dataset + ")");
    if (has_more_than_ranges(entry.metadata))
      losses.push_back("metadata of " + (entry.name.empty() ? "points" : quoted_array(name)));
    if (entry.origin == Origin::array) {
      if (is_attribute(entry.kind) && attributes.insert(entry.kind).second)  // VTK uses the first
        losses.push_back("attribute " + std::string(keyword(entry.kind)) + " of " +
                         quoted_array(name));
      if (form_of_word(entry.type) == ValueForm::bit)
        losses.push_back("type bit of " + quoted_array(name) + " (written as numbers 0 and 1)");
    }
    if (entry.origin != Origin::extra || used.contains(data_key(entry.index))) continue;
    if (entry.kind >= EntryKind::x_coordinates && entry.kind <= EntryKind::z_coordinates)
      continue;  // no values are lost, because the points contain the coordinates of the axes
    const bool table = entry.kind == EntryKind::lookup_table;
    losses.push_back((table ? "lookup table" : "field data") + quoted(name));
  }
}

class LegacySource final : public FamilySource {
 public:
  std::string title(const MeshInfo& info, Keys&) const override {
    const auto skeleton = skeleton_of(info);
    return skeleton && skeleton->title != Skeleton().title ? skeleton->title : std::string();
  }

  bool describes_steps(const MeshInfo&) const override { return false; }

  std::vector<std::size_t> blocks_with_own_nodes(MeshSource& mesh) const override {
    return vtk::blocks_with_own_nodes(mesh);
  }

  // Returns true if the mesh has voxels, whose corners must be ordered along the axes.
  bool needs_corner_order(const MeshInfo& info) const override {
    for (const BlockInfo& block : info.schema.blocks)
      if (block.shape == CellShape::hexahedron && block.id == kVoxel) return true;
    return false;
  }

  LossList losses(const MeshInfo& info, const Keys& used) const override {
    constexpr std::string_view kKnown[] = {"vtk/skeleton",    "vtk/cell_types", "vtk/data/",
                                           "vtk/polyhedron/", "vtk/strings/",   kNewNumbering};
    LossList losses = losses_by_key(info, used, kKnown);
    if (const auto skeleton = skeleton_of(info)) add_losses_of_skeleton(*skeleton, used, losses);
    return losses;
  }

 private:
  std::string skeleton_without_ranges(const MeshInfo& info) const override {
    auto skeleton = skeleton_of(info);
    if (!skeleton) return {};
    for (Entry& entry : skeleton->entries) entry.metadata = without_ranges(entry.metadata);
    return to_text(*skeleton);
  }
  static std::optional<Skeleton> skeleton_of(const MeshInfo& info) {
    const Extra* text = find_extra(info, "vtk/skeleton");
    return text == nullptr ? std::nullopt : parse_skeleton(text_of_extra(*text));
  }
};

constexpr LegacySource kSource;
// Role of arrays of strings. The role is the same in both VTK formats.
constexpr Role kRoles[] = {
    {.name = kStringRole, .is_private = true, .loss = [](const std::string& array) {
       return "strings of " + quoted_array(array);
     }}};

}  // namespace
}  // namespace vtk

constinit const Format kVtkFormat = {
    .name = "vtk",
    .title = "VTK legacy",
    .extensions = {".vtk"},
    .looks_like = looks_like_vtk,
    .open = open_vtk,
    .write = write_vtk,
    .capabilities = {.sets = Capabilities::Sets::arrays,
                     .blocks_by_type = true,
                     .beside_mesh = Capabilities::BesideMesh::global,
                     .title_bytes = 255,
                     .block = vtk::has_cell_type,
                     .sibling = "vtu",
                     .losses_of_sibling = vtk::losses_in_vtk},
    .roles = vtk::kRoles,
    .source = &vtk::kSource};

}  // namespace shm::converters
