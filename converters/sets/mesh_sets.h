// The named groups of a mesh, found among its extras: Exodus sets, Gmsh physical groups.
// For people to look at; nothing else depends on it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

struct MeshSet {
  std::string kind;  // "node set", "side set", "physical volume", ...
  std::string id;
  std::string name;
  std::optional<std::uint64_t> members;
};
std::vector<MeshSet> mesh_sets(const MeshInfo& info);

}  // namespace shm::converters
