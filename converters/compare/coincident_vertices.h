// Sites: points in space that are shared by vertices of two meshes. Memory: 36 bytes per vertex,
// and 40 more for a vertex that is not at exactly the same place as one of the other mesh.
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

// Vertices at exactly the same place share a site (NaN counts as a place). With a tolerance,
// vertices whose coordinates differ by at most the tolerance also share a site, provided that this
// holds for all pairs of vertices of the site. If vertices of a mesh are closer together than the
// tolerance, each vertex shares a site with the nearest one of the other mesh.
CoincidentVertices find_coincident(MeshSource& a, MeshSource& b, double tolerance);

}  // namespace shm::converters
