// Matches the vertices and cells of two meshes, regardless of their order.
//
// Vertices match if they have the same coordinates. If several vertices of a mesh have the same
// coordinates (seams, cracks, copies), they are matched by their cells. Cells match if their
// corners match, possibly after a rotation. A vertex that was moved is matched if the cells around
// it allow only one candidate.
//
// Needs, for each mesh, 33 to 60 bytes of memory per vertex (more if many vertices have the same
// coordinates), and 52 bytes per hexahedron (20 per cell and 4 for each of its corners). If a mesh
// has several blocks, each cell needs 4 more bytes.
#pragma once

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

struct MeshMatch {
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  // for each vertex and cell of A: its match in B, or kNone
  std::vector<std::uint32_t> vertex, cell;
  // for each vertex and cell of B: its match in A, or kNone
  std::vector<std::uint32_t> vertex_of_b, cell_of_b;
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
