// The cell types of VTK. Their numbers are those of vtkCellType.h.
#pragma once

#include <cstdint>

#include "shm/schema.h"

namespace shmf {

/// Returns VTK's type of a cell with `nodes` nodes: 2 (a poly-vertex) if VTK has no type for it, 41
/// (a convex point set) for polyhedra whose faces are unknown.
std::uint8_t vtk_cell_type(shm::CellShape shape, std::uint64_t nodes);

}  // namespace shmf
