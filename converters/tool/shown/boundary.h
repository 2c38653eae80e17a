// Computes the boundary surface of a mesh of any format, with the values of some arrays. If the
// boundary of a whole .shm file is needed, use shm/boundary_surface.h instead.
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

// A half space: all points with x * normal[0] + y * normal[1] + z * normal[2] <= most.
struct HalfSpace {
  std::array<double, 3> normal{};
  double most = 0;
};

// Returns the boundary surface, as read_boundary() does for .shm files. Vertices and cells have the
// same numbers as in `mesh`. If `kept` is set, only cells whose centre (the mean of their corners)
// is in this half space are included. Makes two passes over the cells, and one more pass for each
// cell array. The memory needed is proportional to the number of faces found, and to the active
// surface (the faces of which only one cell has been read so far). Throws Failure.
BoundarySurface boundary_of_mesh(MeshSource& mesh, const std::vector<BoundaryArray>& arrays,
                                 const std::optional<HalfSpace>& kept, Spool& spool,
                                 const Progress& progress);

// Returns the vertices in the half space `kept` as a surface, for a mesh without faces. Each vertex
// becomes a face with one corner, block 0 and the cell number kNoCell. If there are very many
// vertices, returns only every n-th vertex. Cell arrays have no values. Throws Failure.
inline constexpr std::uint64_t kNoCell = ~std::uint64_t{0};
BoundarySurface points_of_mesh(MeshSource& mesh, const std::vector<BoundaryArray>& arrays,
                               const std::optional<HalfSpace>& kept, const Spool& spool);

}  // namespace shm::converters
