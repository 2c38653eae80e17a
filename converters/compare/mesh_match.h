// Matches the vertices and cells of two meshes, regardless of their order.
//
// Vertices match if they are at the same place. If several vertices share a place (seams, cracks,
// copies), they are matched by their cells: cells match if their corners match, possibly after a
// rotation. A vertex that was moved is found through the cells around it if these leave only one
// candidate.
//
// Memory for each mesh: 33 to 60 bytes per vertex (more if many vertices share a place), and 52
// bytes per hexahedron (20 per cell and 4 per node; 4 more with several blocks).
#pragma once

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

struct MeshMatch {
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::vector<std::uint32_t> vertex, cell;            // number in B of each vertex and cell of A
  std::vector<std::uint32_t> vertex_of_b, cell_of_b;  // number in A of each vertex and cell of B
  std::uint64_t matched_vertices = 0, matched_cells = 0;
};

struct MatchRules {
  // Class of each block. Cells can match only if their blocks have the same class.
  std::vector<std::uint32_t> class_a, class_b;
  double tolerance = 0;  // tolerance for coordinates
};

// Matches two meshes. Throws Failure (over_limit) if a mesh has too many vertices or cells for
// 32-bit numbers.
MeshMatch match_meshes(MeshSource& a, MeshSource& b, const MatchRules& rules,
                       const Progress& progress = {});

}  // namespace shm::converters
