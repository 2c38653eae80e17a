// The boundary surface of a mesh of any format, with values of some arrays. For complete .shm
// files, use shm/boundary_surface.h.
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

// The half space of points with x * normal[0] + y * normal[1] + z * normal[2] <= most.
struct HalfSpace {
  std::array<double, 3> normal{};
  double most = 0;
};

// Returns the same surface as read_boundary(). Vertex numbers are those of the mesh; cell numbers
// count the cells in the mesh's order. `kept`: include only cells whose centre, the mean of their
// corners, is in this half space. Makes two passes over the cells, and one more for arrays of
// cells. Memory grows with the active surface and the faces found. Throws Failure.
BoundarySurface boundary_of_mesh(MeshSource& mesh, const std::vector<BoundaryArray>& arrays,
                                 const std::optional<HalfSpace>& kept, Spool& spool,
                                 const Progress& progress);

// Returns the vertices that are in the half space `kept`, for a mesh without faces. Each vertex
// becomes a face with one corner, block 0 and no cell (cell number kNoCell). If there are very many
// vertices, returns only every n-th vertex. Arrays of cells have no values. Throws Failure.
inline constexpr std::uint64_t kNoCell = ~std::uint64_t{0};
BoundarySurface points_of_mesh(MeshSource& mesh, const std::vector<BoundaryArray>& arrays,
                               const std::optional<HalfSpace>& kept, const Spool& spool);

}  // namespace shm::converters
