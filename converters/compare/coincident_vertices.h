// Finds sites: points in space at which two meshes have vertices. Needs 36 bytes of memory per
// vertex, and 40 more bytes for each vertex whose coordinates do not exactly equal those of a
// vertex of the other mesh.
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

// Finds the sites of two meshes. Vertices with equal coordinates share a site; NaN equals NaN here.
// If `tolerance` is not zero, a group of vertices also shares a site if the coordinates of any two
// of them differ by at most `tolerance`. If the vertices of one mesh are too close together to form
// such groups, each vertex shares a site with the nearest vertex of the other mesh.
CoincidentVertices find_coincident(MeshSource& a, MeshSource& b, double tolerance);

}  // namespace shm::converters
