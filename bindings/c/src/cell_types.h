// Cell types of VTK, as vtkCellType.h numbers them.
#pragma once

#include <cstdint>

#include "shm/schema.h"

namespace shmf {

/// Of a cell with so many nodes. 2, a poly-vertex, where VTK has none for it; of polyhedra whose
/// faces are not known 41, a convex point set.
std::uint8_t vtk_cell_type(shm::CellShape shape, std::uint64_t nodes);

}  // namespace shmf
