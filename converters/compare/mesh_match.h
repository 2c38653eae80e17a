// Which vertex and which cell of one mesh is which of another, however both are ordered.
//
// Vertices are the same where they are at the same place. Where several are at one place (seams,
// cracks, copies), their cells decide: cells are the same when their corners are, turned or not.
// A vertex that was moved is found by the cells around it, where they leave only one.
//
// Memory: of each mesh 33 to 60 bytes a vertex (more where many share a place), and 52 bytes a
// hexahedron (4 for each node, and 20; 4 more with several blocks).
#pragma once

#include <cstdint>
#include <vector>

#include "base/progress.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

struct MeshMatch {
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::vector<std::uint32_t> vertex, cell;            // of each one of A, that of B
  std::vector<std::uint32_t> vertex_of_b, cell_of_b;  // and back
  std::uint64_t matched_vertices = 0, matched_cells = 0;
};

struct MatchRules {
  // Cells are the same only when their blocks are of one class.
  std::vector<std::uint32_t> class_a, class_b;
  double tolerance = 0;  // of coordinates
};

// Throws over_limit for meshes beyond 32-bit numbers.
MeshMatch match_meshes(MeshSource& a, MeshSource& b, const MatchRules& rules,
                       const Progress& progress = {});

}  // namespace shm::converters
