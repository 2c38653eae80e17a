// The boundary surface of a mesh of any format, with values of some arrays: shm/boundary_surface.h
// for what is no .shm file, and for a part of a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "shm/boundary_surface.h"

namespace shm::converters {

// Where x * normal[0] + y * normal[1] + z * normal[2] <= most.
struct HalfSpace {
  std::array<double, 3> normal{};
  double most = 0;
};

// As read_boundary() gives it: vertex numbers are the mesh's, cell numbers count in its order.
// `kept`: only cells whose middle, the mean of their corners, is there. Two passes over the cells,
// and one more for arrays of cells; memory follows the active surface and what is found. Throws
// Failure.
BoundarySurface boundary_of_mesh(MeshSource& mesh, const std::vector<BoundaryArray>& arrays,
                                 const std::optional<HalfSpace>& kept, Spool& spool,
                                 const Progress& progress);

// Of a mesh without faces: its vertices in `kept`, each a face of one corner, of block 0 and of no
// cell (cell number kNoCell); of very many some, at even distances in their order. Arrays of cells
// have no values. Throws Failure.
inline constexpr std::uint64_t kNoCell = ~std::uint64_t{0};
BoundarySurface points_of_mesh(MeshSource& mesh, const std::vector<BoundaryArray>& arrays,
                               const std::optional<HalfSpace>& kept, const Spool& spool);

}  // namespace shm::converters
