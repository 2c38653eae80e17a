// Physical groups of Gmsh: the entities that belong to each group, and the names of groups.
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

// The names of the physical groups and the groups of each entity, parsed from the sections of a
// file. An add_*() function adds nothing for a section that it cannot parse.
struct GmshNaming {
  // Names of groups. The key is (dimension, tag of the group).
  std::map<std::pair<std::int64_t, std::int64_t>, std::string> names;
  // Tags of the groups to which an entity belongs. The key is (dimension, tag of the entity).
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::int64_t>> groups;
  bool any_bounds = false;  // true if an entity has a boundary

  void add_names(std::string_view content);  // `content` is the content of $PhysicalNames
  // Adds the names of the mesh's element sets. Used if the sets replace the section $PhysicalNames.
  void add_names_of_sets(const MeshInfo& info);
  void add_entities(std::string_view content, bool partitioned, GmshEncoding encoding, int version);
  // Returns the groups of a block as pairs (dimension, tag). `row` is the row of the block in the
  // extra gmsh/elements/blocks.
  std::vector<std::pair<std::int64_t, std::int64_t>> groups_of(
      std::span<const std::int32_t> row) const;
  // Returns the name of the group of a block if the block is in exactly one group, otherwise an
  // empty string.
  std::string block_name(std::span<const std::int32_t> row) const;
};

struct GmshGroup {
  std::int64_t dimension = 0, tag = 0;
  std::string name;                   // empty if the group has no name
  std::vector<std::uint32_t> blocks;  // blocks of the group
};

// Adds an element set (shm/sets.h) for each group that contains blocks, unless the mesh already has
// element sets. If the sets contain everything that the section $PhysicalNames contains, removes
// the content of the section and sets its kind to "names".
void add_group_sets(MeshInfo& info);
// Returns the content of $PhysicalNames, derived from the element sets of a mesh.
std::string gmsh_names_of_sets(const MeshInfo& info);

// Returns true if the section $Entities contains boundaries of entities. Other formats lose only
// these boundaries: the groups in the section become sets, and the bounding boxes can be computed
// from the nodes.
bool gmsh_entities_have_bounds(const MeshInfo& info);

// Returns the names of all groups of a mesh that came from Gmsh, including groups without blocks.
// The key is (dimension, tag of the group).
std::map<std::pair<std::int64_t, std::int64_t>, std::string> gmsh_group_names(const MeshInfo& info);

// Returns the groups of a mesh that came from Gmsh, derived from its extras and sorted by dimension
// and tag.
std::vector<GmshGroup> gmsh_groups(const MeshInfo& info);

}  // namespace shm::converters
