// The cell types of VTK. Their numbers are those of vtkCellType.h.
#pragma once

#include <cstdint>

#include "shm/schema.h"

namespace shmf {

/// Returns the VTK cell type of a cell of a block. `nodes`: number of nodes of the cell. If VTK has
/// no type for the cell, returns 2 (a poly-vertex). For polyhedra whose faces are unknown, returns
/// 41 (a convex point set).
std::uint8_t vtk_cell_type(const shm::BlockInfo& block, std::uint64_t nodes);

}  // namespace shmf
