// GmshPlan: the sections and the encoding of an MSH file, determined before the first byte is
// written. If the mesh came from Gmsh, the plan is derived from its extras. For any other mesh, the
// plan is binary MSH 4.1.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gmsh/scan.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// The properties that all elements of a group share: the element type, and the entity (MSH 4) or
// the tags (MSH 1 and 2).
struct GmshElementGroup {
  std::int32_t dimension = 0, entity = 0;  // used in MSH 4
  std::int32_t type = 0;
  std::int32_t tag_count = 0, physical = 0, elementary = 0;  // used in MSH 1 and 2
};

struct GmshPlannedSection {
  enum class Kind { format, raw, between, nodes, elements, array, list, links, ghosts };
  Kind kind = Kind::raw;
  std::string name;
  std::string key;        // prefix of the keys of the section's extras
  std::string header;     // header of a view
  std::string content;    // content of a raw section
  std::size_t array = 0;  // array whose values the view contains
  std::uint64_t step = 0;
  std::uint32_t first_component = 0;  // index of the first component of `array` in the view
  std::uint32_t components = 0;       // number of components of `array` in the view; 0 means all
  std::uint32_t padding = 0;          // number of zeros appended to each value of the view
};

struct GmshPlan {
  int version = 41;  // result of gmsh_version()
  std::string format_line = "4.1 1 8";
  GmshEncoding encoding;
  std::vector<GmshPlannedSection> sections;
  std::vector<std::array<std::int32_t, 3>> node_entities;  // dimension, tag, parametric

  // Groups of elements. If all cells of block b have the same number of nodes, group b contains the
  // elements of block b. The groups in sized_groups come after these groups.
  std::vector<GmshElementGroup> groups;
  // Indices of the groups for blocks whose cells have different numbers of nodes. Such a block has
  // one group for each number of nodes. The key is (block, number of nodes).
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint32_t> sized_groups;
  // Indices of the arrays that contain the tags, entities and parametric coordinates of nodes, and
  // the tags of elements. An index is not set if the mesh does not have this array.
  std::optional<std::size_t> node_tags, node_entity, node_parameters, element_tags;
  std::int64_t first_node_tag = 1, first_element_tag = 1;
  std::array<std::optional<std::size_t>, 64> tag_arrays;  // MSH 1 and 2

  std::uint32_t group_of(std::uint32_t block, std::uint64_t nodes) const {
    const auto sized = sized_groups.find({block, nodes});
    return sized == sized_groups.end() ? block : sized->second;
  }
};

// Finds extras of a mesh by key. All functions except find() throw Failure (corrupt) if an extra
// does not have the form that the format defines.
class GmshExtras {
 public:
  GmshExtras(const MeshInfo& info, std::string path);
  const Extra* find(const std::string& key) const;
  std::string text(const std::string& key) const;
  // Returns the values of an extra. Throws Failure unless the extra exists and its number of values
  // is a multiple of `width`.
  std::vector<std::int64_t> integers(const std::string& key, std::uint64_t width = 1) const;
  std::vector<double> reals(const std::string& key) const;
  [[noreturn]] void fail(const std::string& key, const char* what) const;

 private:
  const Extra& need(const std::string& key) const;
  std::map<std::string, const Extra*> by_key_;
  std::string path_;
};

// Plans the sections of an MSH file for the mesh. `path` is the file name for error messages. May
// read all cells of the mesh once.
GmshPlan plan_gmsh(MeshSource& mesh, const std::string& path);
GmshPlan plan_gmsh_from_extras(const MeshInfo& info, const GmshExtras& extras);
GmshPlan plan_gmsh_anew(MeshSource& mesh, const std::string& path);
// Returns `name`, changed if needed so that it can be written between quotes.
std::string quotable(const std::string& name);

}  // namespace shm::converters
