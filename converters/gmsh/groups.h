// Physical groups of Gmsh: which entities belong to them, and their names.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gmsh/scan.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Names and groups that sections list. Content that cannot be understood gives none.
struct GmshNaming {
  std::map<std::pair<std::int64_t, std::int64_t>, std::string> names;  // (dimension, group)
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::int64_t>> groups;  // of entities
  bool any_bounds = false;  // has an entity others on its boundary?

  void add_names(std::string_view content);      // $PhysicalNames
  void add_names_of_sets(const MeshInfo& info);  // where these hold what stands there
  void add_entities(std::string_view content, bool partitioned, GmshEncoding encoding, int version);
  // The groups, as (dimension, tag), of a block; `row`: its row of extra gmsh/elements/blocks.
  std::vector<std::pair<std::int64_t, std::int64_t>> groups_of(
      std::span<const std::int32_t> row) const;
  std::string block_name(std::span<const std::int32_t> row) const;  // when it is in one group
};

struct GmshGroup {
  std::int64_t dimension = 0, tag = 0;
  std::string name;                   // may be empty
  std::vector<std::uint32_t> blocks;  // that belong to it
};

// Element sets (shm/sets.h) for the groups that blocks belong to, unless the mesh has some. Where
// they say all that $PhysicalNames does, its content goes, and its kind is "names".
void add_group_sets(MeshInfo& info);
// The content of $PhysicalNames out of the element sets of a mesh.
std::string gmsh_names_of_sets(const MeshInfo& info);

// Whether $Entities has more than groups, and boxes that follow from the nodes.
bool gmsh_entities_have_bounds(const MeshInfo& info);

// Names of the groups of a mesh that came from Gmsh, by (dimension, tag), whether or not a block
// belongs to them.
std::map<std::pair<std::int64_t, std::int64_t>, std::string> gmsh_group_names(const MeshInfo& info);

// Those of a mesh that came from Gmsh, out of its extras, in order of dimension and tag.
std::vector<GmshGroup> gmsh_groups(const MeshInfo& info);

}  // namespace shm::converters
