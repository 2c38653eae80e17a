// Places that hold vertices of two meshes.
// Memory: 36 bytes a vertex; 40 more where vertices are not exactly at the same place.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

struct CoincidentVertices {
  std::vector<std::uint32_t> of_a, of_b;  // the site of each vertex
  std::uint32_t count = 0;
};

// Vertices at exactly the same place share a site (NaN is a place too). With a tolerance also those
// whose coordinates are at most that far apart, as long as all of a site are; where vertices stand
// closer than that, each one with the nearest of the other mesh.
CoincidentVertices find_coincident(MeshSource& a, MeshSource& b, double tolerance);

}  // namespace shm::converters
