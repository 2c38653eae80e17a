// Sites: points in space that vertices of two meshes share. Needs 36 bytes of memory per vertex,
// and 40 more for a vertex that is not at exactly the same place as a vertex of the other mesh.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

struct CoincidentVertices {
  std::vector<std::uint32_t> of_a, of_b;  // site of each vertex
  std::uint32_t count = 0;
};

// Finds the sites of two meshes. Vertices at exactly the same place share a site (NaN counts as a
// place). With a tolerance, vertices whose coordinates differ by at most the tolerance also share a
// site, if this is true for all pairs of vertices of the site. If vertices of a mesh are closer
// together than the tolerance, each vertex shares a site with the nearest vertex of the other mesh.
CoincidentVertices find_coincident(MeshSource& a, MeshSource& b, double tolerance);

}  // namespace shm::converters
